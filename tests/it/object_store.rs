//! Inputs and artifacts in an object store: the results are those of local files, also when the store loses requests and
//! processes are killed.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Lines};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use mocban::catalog::Catalog;
use mocban::check::{CheckOptions, check};
use mocban::store::Project;

use crate::cli::{Call, binary, call, empty, mocban};
use crate::fault::{ENOSPC, Fault};
use crate::resume::project;
use crate::s3_server::{Faults, Outage, S3Server, proxy, proxy_with_outage};
use crate::uninterrupted::{assert_same_files, files};

const PAIRS: &str = "6";
const GOOD: Faults = Faults {
    refused: 0,
    lost: 0,
    slow: 0,
};

/// A project with local files that has been run, and one with the same pairs in an object store, not run yet.
pub(crate) struct Remote {
    dir: tempfile::TempDir,
    pub(crate) server: S3Server,
}

impl Remote {
    /// Returns `None` if no server is installed.
    pub(crate) fn new() -> Option<Self> {
        let server = S3Server::start()?;
        let dir = empty();
        let local = project(dir.path(), "local", PAIRS);
        server.upload(&local.dir().join("data"), "scans");
        let list = std::fs::read_to_string(local.dir().join("data/manifest.csv")).expect("a list");
        let list = list
            .replace(",meshes/", ",scans:meshes/")
            .replace(",prints/", ",scans:prints/");
        std::fs::write(dir.path().join("remote.csv"), list).expect("written");
        let settings = "[storage]\nartifacts = \"s3://mocban/results\"\n[storage.roots]\nscans = \"s3://mocban/scans\"\n";
        let remote = dir.path().join("remote");
        std::fs::create_dir(&remote).expect("a folder");
        std::fs::write(remote.join("mocban.toml"), settings).expect("written");
        // The same paths, but below a folder.
        let file = dir.path().join("file");
        std::fs::create_dir(&file).expect("a folder");
        let root = format!(
            "storage.roots.scans = '{}'\n",
            local.dir().join("data").display()
        );
        std::fs::write(file.join("mocban.toml"), root).expect("written");
        mocban(dir.path(), &["-C", "file", "import", "remote.csv"]).expect(0);
        mocban(dir.path(), &["-C", "file", "run"]).expect(0);
        let made = Self { dir, server };
        made.remote(made.server.port(), &["import", "remote.csv"])
            .expect(0);
        Some(made)
    }

    pub(crate) fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Returns a command on the remote project through a port, with the cache of one machine.
    pub(crate) fn command(&self, port: u16, cache: &str, args: &[&str]) -> Command {
        let mut command = self.command_of("remote", port, cache);
        command.args(args);
        command
    }

    /// Like [`Self::command`], on another project and without arguments.
    pub(crate) fn command_of(&self, project: &str, port: u16, cache: &str) -> Command {
        let mut command = binary();
        command.current_dir(self.path());
        command.env("XDG_CACHE_HOME", self.path().join(cache));
        // A busy machine would store the stages of a pair in several packs, and ask for inputs again.
        command.env("MOCBAN_STORE_FACTOR", "300");
        S3Server::configure(&mut command, port);
        command.args(["-C", project]);
        command
    }

    pub(crate) fn remote(&self, port: u16, args: &[&str]) -> Call {
        call(&mut self.command(port, "cache", args))
    }

    /// Makes the project the owner of the store, so that the first request of a run that writes stores a result.
    fn own_the_store(&self) {
        let port = self.server.port();
        self.remote(port, &["check", "--take-over"]).expect(0);
    }

    /// Checks that both projects have the same export, and that nothing is damaged.
    #[track_caller]
    pub(crate) fn assert_same_results(&self) {
        for folder in ["of-local", "of-remote"] {
            let _ = std::fs::remove_dir_all(self.path().join(folder));
        }
        let export = ["export", "--to", "jsonl", "-o"];
        mocban(
            self.path(),
            &["-C", "file", "export", "--to", "jsonl", "-o", "of-local"],
        )
        .expect(0);
        let port = self.server.port();
        self.remote(port, &[&export[..], &["of-remote"]].concat())
            .expect(0);
        let [local, remote] = ["of-local", "of-remote"].map(|name| self.path().join(name));
        assert_same_files(&local, &remote);
        self.remote(port, &["check"]).expect(0);
    }
}

#[test]
fn a_pair_is_one_object_and_two_reads_and_the_results_are_those_of_local_files() {
    let Some(remote) = Remote::new() else { return };
    let (port, requests) = proxy(remote.server.port(), GOOD);
    remote.remote(port, &["run"]).expect(0);
    let pairs: u64 = PAIRS.parse().expect("a number");
    // One more object names the owner of the results.
    assert_eq!(requests.put.load(Ordering::Relaxed), pairs + 1);
    // One list at the start shows that each bucket can be read. The owner is looked for, two lists show that there are no
    // results yet, and the owner is read again; a slow run reads it a few times more, but less than once a pair.
    assert!(
        requests.get.load(Ordering::Relaxed) < 3 * pairs + 2 + 4,
        "{requests:?}"
    );
    assert_eq!(remote.server.list("results/packs").len() as u64, pairs);
    remote.assert_same_results();
    // Another computer has no copies of the inputs, and nothing to do.
    let run = call(&mut remote.command(port, "other", &["run"])).expect(0);
    assert!(
        run.err.contains("nothing") || run.err.contains("0 left"),
        "{}",
        run.err
    );
    assert_eq!(remote.server.list("results/packs").len() as u64, pairs);
    remote.remote(port, &["run", "--rerun", "all"]).expect(0);
    assert_eq!(remote.server.list("results/packs").len() as u64, 2 * pairs);
    let collected = remote.remote(port, &["check", "--collect=1"]).expect(0);
    assert!(
        collected.out.contains("removed 0 of 6 files"),
        "{}",
        collected.out
    );
    remote.assert_same_results();
}

#[test]
fn a_store_that_loses_requests_and_killed_processes_change_no_result() {
    let Some(remote) = Remote::new() else { return };
    let faults = Faults {
        refused: 20,
        lost: 15,
        slow: 5,
    };
    let (port, requests) = proxy(remote.server.port(), faults);
    for point in ["register:written", "register:synced"] {
        let mut killed = remote.command(port, "cache", &["run", "-j", "1"]);
        killed.env("MOCBAN_BREAK_AT", point).stderr(Stdio::null());
        let ended = killed.status().expect("it ends");
        assert!(!ended.success(), "the failpoint was not reached");
    }
    remote.remote(port, &["run"]).expect(0);
    assert!(
        requests.disturbed.load(Ordering::Relaxed) > 5,
        "{requests:?}"
    );
    remote.assert_same_results();
}

#[test]
fn a_full_cache_folder_is_named_and_the_next_run_continues() {
    let Some(remote) = Remote::new() else { return };
    let port = remote.server.port();
    let full = Fault::once("write", "cache/*", ENOSPC).and_later();
    let mut run = remote.command(port, "cache", &["run"]);
    full.inject(4, remote.path(), remote.path(), &mut run);
    let run = call(&mut run).expect(1);
    assert!(Fault::injected(remote.path()) > 0);
    let advice = "cache/mocban: No space left on device; free some space";
    assert!(run.err.contains(advice), "{}", run.err);
    remote.remote(port, &["run"]).expect(0);
    remote.assert_same_results();
}

/// A run with a process of its own, whose object store is given up after a second.
struct RunInOutage {
    process: Child,
    lines: Lines<BufReader<ChildStderr>>,
}

impl RunInOutage {
    fn start(command: &mut Command) -> Self {
        command.env("MOCBAN_STORE_TIME_SCALE", "240");
        let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().expect("the binary starts");
        let lines = BufReader::new(process.stderr.take().expect("a pipe")).lines();
        Self { process, lines }
    }

    /// Waits for a line with this text.
    #[track_caller]
    fn wait_for(&mut self, wanted: &str) {
        let mut seen = Vec::new();
        for line in self.lines.by_ref() {
            seen.push(line.expect("text"));
            if seen.last().is_some_and(|line| line.contains(wanted)) {
                return;
            }
        }
        unreachable!("no line with {wanted:?} in {seen:#?}");
    }

    /// Waits for the end. Returns the exit code and the remaining lines.
    fn end(mut self) -> (Option<i32>, String) {
        let lines = self.lines.map(|line| line.expect("text"));
        let lines = lines.collect::<Vec<_>>().join("\n");
        (self.process.wait().expect("an exit code").code(), lines)
    }
}

#[test]
fn a_store_that_is_away_is_waited_for_and_nobody_is_blamed() {
    let Some(remote) = Remote::new() else { return };
    let outage = Outage::default();
    let (port, _) = proxy_with_outage(remote.server.port(), GOOD, &outage);
    remote.own_the_store();
    outage.begin_at_put();
    let mut run = RunInOutage::start(&mut remote.command(port, "cache", &["run", "-j", "2"]));
    run.wait_for("a request to the object store has been running");
    run.wait_for("waiting for it to store results");
    // The store is away for longer than a request is repeated.
    run.wait_for("a request to the object store has been running");
    outage.end();
    let (code, lines) = run.end();
    assert_eq!(code, Some(0), "{lines}");
    remote.assert_same_results();
}

#[cfg(unix)]
#[test]
fn a_stop_request_ends_the_wait_for_a_store_that_is_away() {
    let Some(remote) = Remote::new() else { return };
    let outage = Outage::default();
    let (port, _) = proxy_with_outage(remote.server.port(), GOOD, &outage);
    remote.own_the_store();
    outage.begin_at_put();
    let mut run = RunInOutage::start(&mut remote.command(port, "cache", &["run", "-j", "2"]));
    run.wait_for("waiting for it to store results");
    let id = rustix::process::Pid::from_child(&run.process);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("sent");
    let (code, lines) = run.end();
    assert_eq!(code, Some(130), "{lines}");
    let status = remote.remote(port, &["status", "--json"]).expect(0).json();
    assert_eq!(status["jobs"]["leased"], 0, "{status}");
    assert_eq!(status["jobs"]["quarantined"], 0, "{status}");
    outage.end();
    remote.remote(port, &["run"]).expect(0);
    remote.assert_same_results();
}

/// Requests are repeated for minutes before the store counts as unavailable. A stop request does not wait for that.
#[cfg(unix)]
#[test]
fn a_stop_request_does_not_wait_until_a_request_is_given_up() {
    /// Longer than a busy machine needs, and shorter than the four minutes for which requests are repeated.
    const LONGEST: Duration = Duration::from_secs(200);
    let Some(remote) = Remote::new() else { return };
    let outage = Outage::default();
    let (port, _) = proxy_with_outage(remote.server.port(), GOOD, &outage);
    remote.own_the_store();
    outage.begin_at_put();
    let mut command = remote.command(port, "cache", &["run", "-j", "2"]);
    let mut run = command.spawn().expect("the binary starts");
    crate::waiting::until(&mut run, || outage.has_begun());
    let asked = Instant::now();
    let id = rustix::process::Pid::from_child(&run);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("sent");
    assert_eq!(run.wait().expect("an exit code").code(), Some(130));
    assert!(asked.elapsed() < LONGEST, "{:?}", asked.elapsed());
    outage.end();
    let status = remote.remote(port, &["status", "--json"]).expect(0).json();
    assert_eq!(status["jobs"]["leased"], 0, "{status}");
    assert_eq!(status["jobs"]["quarantined"], 0, "{status}");
    remote.remote(port, &["run"]).expect(0);
    remote.assert_same_results();
}

#[test]
fn a_lost_pack_is_computed_again() {
    let Some(remote) = Remote::new() else { return };
    let port = remote.server.port();
    remote.remote(port, &["run"]).expect(0);
    let packs = remote.server.list("results/packs");
    remote.server.remove(&packs[0]);
    let checked = remote.remote(port, &["check"]).expect(12);
    assert!(
        checked.out.contains(&packs[0]["results/".len()..]),
        "{}",
        checked.out
    );
    remote.remote(port, &["check", "--repair"]).expect(0);
    remote.remote(port, &["run"]).expect(0);
    remote.assert_same_results();
}

#[test]
fn inputs_below_a_folder_with_a_name_move_with_it() {
    let dir = empty();
    let local = project(dir.path(), "local", "2");
    let data = local.dir().join("data");
    let root = |folder: &Path| format!("storage.roots.nas={}", folder.display());
    let list = data.join("manifest.csv");
    let import = [
        "-C",
        "named",
        "--set",
        &root(&data),
        "import",
        list.to_str().expect("UTF-8"),
    ];
    mocban(dir.path(), &import).expect(0);
    mocban(dir.path(), &["-C", "named", "--set", &root(&data), "run"]).expect(0);
    let moved = dir.path().join("moved");
    std::fs::rename(&data, &moved).expect("moved");
    let plan = [
        "-C",
        "named",
        "--set",
        &root(&moved),
        "run",
        "--dry-run",
        "--json",
    ];
    let plan = mocban(dir.path(), &plan).expect(0).json();
    assert_eq!(plan["pairs"], 0, "{plan}");
    assert!(Project::open(&dir.path().join("named")).is_ok());

    // A disk that is not mounted is an empty folder. The first failure ends the run, and no pair fails.
    std::fs::create_dir(&data).expect("an empty folder");
    for (folder, reason) in [
        (&data, "is empty"),
        (&dir.path().join("away"), "does not exist"),
    ] {
        let settings = ["-C", "named", "--set", &root(folder)];
        let run = [&settings[..], &["run", "--rerun", "all", "-j", "1"]].concat();
        let refused = mocban(dir.path(), &run).expect(2);
        let reason = format!("{} {reason} on this computer", folder.display());
        assert!(refused.err.contains(&reason), "{}", refused.err);
        let status = [&settings[..], &["status", "--json"]].concat();
        let status = mocban(dir.path(), &status).expect(0).json();
        assert_eq!(status["jobs"]["ready"], 2, "{status}");
    }
    mocban(dir.path(), &["-C", "named", "--set", &root(&moved), "run"]).expect(0);
}

/// Settings alternate, so that results become unreferenced and are then computed again with the same bytes. Before each
/// run, all files are made old.
#[tokio::test(flavor = "multi_thread")]
async fn old_files_are_removed_while_the_same_results_are_computed_again() {
    let dir = empty();
    let local = project(dir.path(), "local", "4");
    let options = CheckOptions {
        accept_missing: false,
        take_over: false,
        quick: true,
        repair: false,
        in_use: true,
        now: 1,
        collect: Some(Duration::from_mins(30)),
    };
    mocban(local.dir(), &["run"]).expect(0);
    let mut removed = 0;
    for smoothing in ["1.3", "1.22", "1.3", "1.22", "1.3"] {
        make_old(&local.artifacts_dir());
        let setting = format!("register.smoothing_px={smoothing}");
        let path = local.dir().to_owned();
        let run = move || {
            call(
                binary()
                    .arg("-C")
                    .arg(path)
                    .args(["--set", &setting, "run"]),
            )
        };
        let running = tokio::task::spawn_blocking(run);
        while !running.is_finished() {
            let Ok(catalog) = Catalog::open_read_only(&local.catalog_path()).await else {
                continue;
            };
            let summary = check(&local, &catalog, options).await.expect("checked");
            assert_eq!(summary.found(), 0, "{summary:?}");
            removed += summary.unreferenced.map_or(0, |found| found.removed);
            catalog.close().await;
        }
        running.await.expect("it ends").expect(0);
    }
    assert!(removed > 0);
    mocban(local.dir(), &["check"]).expect(0);
}

/// Sets the times of all files below a folder back by an hour.
fn make_old(folder: &Path) {
    let old = SystemTime::now() - Duration::from_hours(1);
    for (path, _) in files(folder) {
        let file = File::options().append(true).open(folder.join(path));
        let changed = file.and_then(|file| file.set_modified(old));
        changed.expect("changed");
    }
}
