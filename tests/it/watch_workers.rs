//! Watching workers: `status --hosts` and `--metrics`.

use std::io::{BufRead as _, BufReader};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::cli::{Call, binary, call, empty, mocban};
use crate::page;
use crate::postgres_server::Server;
use crate::resume::{project, run};
use crate::waiting::wait_until;

/// Heartbeats once in 2 s. Leases last 10 s: if they ended on a slow machine, stages would run again.
const TIME_SCALE: (&str, &str) = ("MOCBAN_TIME_SCALE", "5");

/// A worker that serves its metrics and is held in the fit of its second pair.
struct HeldWorker {
    child: Child,
    metrics: SocketAddr,
    /// Kept open, because the worker writes to it.
    _stderr: BufReader<ChildStderr>,
    hold: PathBuf,
}

impl HeldWorker {
    /// Starts a worker, and waits until it is held.
    fn start(command: &mut Command, hold: PathBuf) -> Self {
        let command = command
            .args(["-j", "1", "--metrics", "0"])
            .env(TIME_SCALE.0, TIME_SCALE.1)
            .env("MOCBAN_HOLD_AT", "fit:computed:2")
            .env("MOCBAN_HOLD_FILE", &hold);
        let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary starts");
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        let mut line = String::new();
        stderr.read_line(&mut line).expect("a line");
        let address = line.trim().strip_prefix("metrics: http://");
        let address = address.and_then(|rest| rest.strip_suffix("/metrics"));
        let worker = Self {
            child,
            metrics: address.and_then(|text| text.parse().ok()).expect(&line),
            _stderr: stderr,
            hold,
        };
        wait_until("the hold", || worker.hold.exists());
        worker
    }

    /// Asks for a path under a host name.
    fn get(&self, path: &str, host: &str) -> page::Reply {
        let host = [("host", host.to_owned())];
        page::send(self.metrics, "GET", path, &host, b"").expect("a reply")
    }

    /// Returns the value of a metric with its labels.
    fn metric(&self, name: &str) -> f64 {
        let reply = self.get("/metrics", &self.metrics.to_string());
        assert_eq!(reply.status, 200);
        let kind = reply.header("content-type");
        assert_eq!(kind, Some("text/plain; version=0.0.4; charset=utf-8"));
        let text = String::from_utf8(reply.body).expect("UTF-8");
        let mut lines = text.lines().filter_map(|line| line.rsplit_once(' '));
        let found = lines.find(|(found, _)| *found == name);
        let value = found.and_then(|(_, value)| value.parse().ok());
        value.expect(name)
    }

    fn send(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("sent");
    }

    /// Lets the worker go on, and returns its exit code.
    fn release(&mut self) -> Option<i32> {
        std::fs::remove_file(&self.hold).expect("released");
        self.child.wait().expect("it ends").code()
    }
}

impl Drop for HeldWorker {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the workers of the only host, which are sorted by their registration.
fn workers(status: &Value) -> Vec<Value> {
    let hosts = status["hosts"].as_array().expect("hosts");
    assert_eq!(hosts.len(), 1, "{status}");
    hosts[0]["workers"].as_array().expect("workers").clone()
}

fn states(status: &Value) -> Vec<String> {
    let workers = workers(status).into_iter();
    let state = |worker: Value| worker["state"].as_str().unwrap_or_default().to_owned();
    workers.map(state).collect()
}

#[test]
fn two_workers_are_shown_while_they_run_stop_and_end() {
    let Some(server) = Server::start() else {
        return;
    };
    let dir = empty();
    let pairs = project(dir.path(), "shared", "8");
    mocban(dir.path(), &["copy", "shared", server.url()]).expect(0);
    std::fs::remove_file(pairs.catalog_path()).expect("removed");
    let shared = |args: &[&str]| {
        let mut command = binary();
        command.current_dir(dir.path());
        command.args(["-C", "shared", "--catalog", server.url()]);
        command.args(args);
        command
    };
    let hosts = || -> Value {
        let call: Call = call(&mut shared(&["status", "--hosts", "--json"]));
        call.expect(0).json()
    };
    call(&mut shared(&["plan"])).expect(0);
    assert_eq!(hosts()["hosts"], serde_json::json!([]), "nobody works yet");
    let start = |name: &str| HeldWorker::start(&mut shared(&["worker"]), dir.path().join(name));
    let (mut first, mut second) = (start("first"), start("second"));
    for worker in [&first, &second] {
        wait_until("the first pair", || {
            worker.metric("mocban_pairs_done_total") == 1.0
        });
        assert_eq!(worker.metric("mocban_pairs_failed_total"), 0.0);
        assert!(worker.metric("mocban_pairs_leased") >= 1.0);
        let count = "mocban_stage_duration_seconds_count";
        assert_eq!(worker.metric(&format!("{count}{{stage=\"fit\"}}")), 2.0);
        let register = format!("{count}{{stage=\"register\"}}");
        assert_eq!(worker.metric(&register), 1.0);
        for reason in ["database", "inputs"] {
            let name = format!("mocban_wait_seconds_total{{for=\"{reason}\"}}");
            assert!(worker.metric(&name) > 0.0, "{reason}");
        }
        let port = worker.metrics.port();
        assert_eq!(worker.get("/", &format!("localhost:{port}")).status, 404);
        for path in ["/metrics", "/"] {
            let rebound = worker.get(path, &format!("evil.example:{port}"));
            assert_eq!(rebound.status, 421);
            assert!(!rebound.body.starts_with(b"mocban") && rebound.body.len() < 200);
        }
    }
    wait_until("the heartbeats", || hosts()["total"]["done"] == 2);
    let shown = hosts();
    assert_eq!(states(&shown), ["alive", "alive"]);
    for (worker, child) in workers(&shown).iter().zip([&first, &second]) {
        assert_eq!(worker["pid"], child.child.id());
        assert_eq!(worker["version"], env!("CARGO_PKG_VERSION"));
        assert!(worker["mean_stage_ms"]["fit"].as_f64() > Some(0.0));
        assert!(worker["leased"].as_u64() >= Some(1));
    }
    first.send(Signal::TERM);
    wait_until("the stop", || states(&hosts()) == ["stopping", "alive"]);
    assert_eq!(first.release(), Some(130));
    assert_eq!(states(&hosts()), ["ended", "alive"]);
    assert_eq!(second.release(), Some(0));
    let shown = hosts();
    assert_eq!(states(&shown), ["ended", "ended"]);
    assert_eq!(shown["total"]["done"], 8, "{shown}");
    assert_eq!(shown["total"]["leased"], 0);
}

#[test]
fn a_run_on_a_catalog_in_a_file_is_shown_too() {
    let dir = empty();
    let pairs = project(dir.path(), "file", "2");
    call(&mut run(&pairs, &["--metrics", "127.0.0.1:0"])).expect(0);
    let status = |args: &[&str]| {
        let args = [&["-C", "file", "status", "--hosts"], args].concat();
        mocban(dir.path(), &args).expect(0)
    };
    let shown = status(&["--json"]).json();
    assert_eq!(states(&shown), ["ended"]);
    assert_eq!(shown["total"]["done"], 2);
    let text = status(&[]).out;
    let first = text.lines().next().expect("a line");
    assert!(first.starts_with("host, pid"), "{text}");
    assert!(text.contains("0 of 1 alive"), "{text}");
}

#[test]
fn a_taken_port_is_one_clear_error_before_anything_starts() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    let dir = empty();
    let refused = |folder: &Path, command: &str| {
        let call = mocban(folder, &[command, "--metrics", &address]).expect(2);
        assert_eq!(call.err.lines().count(), 1, "{}", call.err);
        let text = format!("error: cannot serve metrics on {address}: ");
        assert!(call.err.starts_with(&text), "{}", call.err);
        assert!(call.err.contains("another port"), "{}", call.err);
    };
    refused(dir.path(), "worker");
    let pairs = project(dir.path(), "file", "1");
    refused(pairs.dir(), "run");
    let shown = mocban(pairs.dir(), &["status", "--hosts", "--json"]).expect(0);
    assert_eq!(shown.json()["hosts"], serde_json::json!([]));
}
