//! Several processes on one catalog, and processes that are suspended, held at a failpoint, or told to stop.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use mocban::catalog::lock_owner;
use mocban::domain::{JobStatus, Stage};
use mocban::store::Project;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::cli::{call, mocban, shell};
use crate::resume::{attempts, pairs, project, results, run, run_with_progress, stages_done};
use crate::waiting::{LONGEST, pause};

/// Shortens leases from nearly a minute to about a second, and the intervals that depend on leases by the same factor.
const TIME_SCALE: (&str, &str) = ("MOCBAN_TIME_SCALE", "50");

/// Most pairs of a test in this module.
const MAX_PAIRS: &str = "4";

/// The results of an uninterrupted run of [`MAX_PAIRS`] pairs.
static UNINTERRUPTED: LazyLock<Vec<String>> = LazyLock::new(|| {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", MAX_PAIRS);
    call(&mut run(&project, &[])).expect(0);
    results(&project)
});

/// A project that has not run.
struct Fixture {
    project: Project,
    dir: tempfile::TempDir,
}

impl Fixture {
    fn new(count: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = project(dir.path(), "p", count);
        Self { project, dir }
    }

    /// Starts `run --json` with one worker and holds it at a failpoint until the returned file is removed.
    fn hold_at(&self, point: &str) -> (Running, PathBuf) {
        self.hold_at_under(point, |run| run)
    }

    /// Like [`Self::hold_at`], with a command that starts `run` in another way.
    fn hold_at_under(&self, point: &str, start: impl Fn(Command) -> Command) -> (Running, PathBuf) {
        let file = self.dir.path().join("held");
        let run = run_with_progress(&self.project, "json", &["-j", "1", "--json"]);
        let mut command = start(run);
        command.env("MOCBAN_HOLD_AT", point);
        command.env("MOCBAN_HOLD_FILE", &file);
        command.stderr(File::create(self.stderr_path()).expect("a file"));
        let mut child = Running(Some(
            command
                .stdout(Stdio::piped())
                .spawn()
                .expect("the binary starts"),
        ));
        child.wait_until("it is held", || file.exists());
        (child, file)
    }

    /// Returns a project whose run is suspended between the sync of the first stage's files and the write of its rows.
    /// Tries again if the run was suspended while a thread wrote a heartbeat, because it then keeps the catalog locked.
    fn suspended(count: &str) -> (Self, Running) {
        loop {
            let fixture = Self::new(count);
            let suspended = fixture.suspended_at("fit:synced", &[TIME_SCALE], &[]);
            if lock_owner(&fixture.project.catalog_path()).is_none() {
                return (fixture, suspended);
            }
        }
    }

    /// Starts `run --json` with one worker and waits until it is suspended at a failpoint.
    fn suspended_at(&self, point: &str, time_scale: &[(&str, &str)], args: &[&str]) -> Running {
        let mut command = run(&self.project, &[&["-j", "1", "--json"], args].concat());
        command
            .env("MOCBAN_STOP_AT", point)
            .envs(time_scale.iter().copied());
        let mut suspended = Running::start(&mut command);
        let pid = suspended.pid();
        suspended.wait_until("it is suspended", || is_suspended(pid));
        suspended
    }

    /// Returns the file that a held process writes its stderr to.
    fn stderr_path(&self) -> PathBuf {
        self.dir.path().join("stderr")
    }

    /// Returns how many stop requests a held process has reported.
    fn stop_requests(&self) -> usize {
        let stderr = std::fs::read_to_string(self.stderr_path()).expect("a file");
        stderr.matches("asked to stop").count()
    }

    /// Asserts that the results equal those of an uninterrupted run and no stage was stored twice.
    fn assert_uninterrupted_results(&self) {
        let found = results(&self.project);
        // Results are sorted by pair, and a small dataset consists of the first pairs of a large one.
        assert_eq!(found, UNINTERRUPTED[..found.len()]);
        assert!(attempts(&self.project).iter().all(|count| *count == 1));
    }
}

/// A process that is killed when this is dropped.
pub(crate) struct Running(Option<Child>);

impl Running {
    pub(crate) fn start(command: &mut Command) -> Self {
        let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().expect("the binary starts")))
    }

    fn child(&mut self) -> &mut Child {
        self.0.as_mut().expect("a running process")
    }

    fn pid(&mut self) -> u32 {
        self.child().id()
    }

    pub(crate) fn send(&mut self, signal: Signal) {
        kill_process(Pid::from_child(self.child()), signal).expect("sent");
    }

    /// Waits until a condition holds that the process brings about.
    pub(crate) fn wait_until(&mut self, what: &str, condition: impl Fn() -> bool) {
        let deadline = Instant::now() + LONGEST;
        loop {
            // Asked for first, because the last act of the process may be what is waited for.
            let ended = self.child().try_wait().expect("the child's state");
            if condition() {
                return;
            }
            assert!(ended.is_none(), "it ended before {what}: {ended:?}");
            assert!(Instant::now() < deadline, "timeout before {what}");
            pause();
        }
    }

    /// Waits for the process to end. Returns the exit code, the output of `--json`, and stderr.
    pub(crate) fn end(mut self) -> (Option<i32>, Value, String) {
        let child = self.0.take().expect("a running process");
        let output = child.wait_with_output().expect("it ends");
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), json, stderr)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            // The process may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Returns whether a signal has stopped a process (`proc_pid_stat(5)`: the state follows the name in parentheses).
fn is_suspended(pid: u32) -> bool {
    let stat = std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("stat"));
    stat.is_ok_and(|stat| {
        stat.rsplit(") ")
            .next()
            .is_some_and(|rest| rest.starts_with('T'))
    })
}

/// Returns the signals that stop a run. SIGINT stays ignored if these tests run in the background of a script.
fn stop_signals() -> Vec<Signal> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let is_ignored = mask.unwrap_or(0) >> (Signal::INT.as_raw() - 1) & 1 == 1;
    let interrupt = (!is_ignored).then_some(Signal::INT);
    interrupt.into_iter().chain([Signal::TERM]).collect()
}

fn joined(project: &Project) -> Command {
    run(project, &["--join", "-j", "1", "--json"])
}

#[test]
fn two_processes_share_the_work() {
    let fixture = Fixture::new(MAX_PAIRS);
    let (owner, file) = fixture.hold_at("fit:computed");
    let refused = call(&mut run(&fixture.project, &[])).expect(11);
    assert!(refused.err.contains("in use by pid"), "{}", refused.err);

    let mut second = Running::start(&mut joined(&fixture.project));
    // The second process finishes the three pairs that the held process has not leased. Then it waits for that process.
    second.wait_until("the others are done", || {
        stages_done(&fixture.project) == 12
    });
    std::fs::remove_file(file).expect("removed");
    let (first, second) = (owner.end(), second.end());
    assert_eq!(
        (first.0, second.0),
        (Some(0), Some(0)),
        "{}{}",
        first.2,
        second.2
    );
    assert_eq!(
        (&first.1["stages"], &second.1["stages"]),
        (&4.into(), &12.into())
    );
    fixture.assert_uninterrupted_results();
}

#[test]
fn joining_with_other_settings_is_refused_with_the_difference() {
    let fixture = Fixture::new("1");
    let (owner, file) = fixture.hold_at("fit:computed");
    let mut other = joined(&fixture.project);
    other.args(["--set", "register.smoothing_px=1.5"]);
    let refused = call(&mut other).expect(2);
    let expected = "the run in progress has other settings (register.smoothing_px: 1.22 -> 1.5); \
        use the same settings, or wait until it has ended";
    assert!(refused.err.contains(expected), "{}", refused.err);
    std::fs::remove_file(file).expect("removed");
    assert_eq!(owner.end().0, Some(0));
    fixture.assert_uninterrupted_results();
}

#[test]
fn a_late_checkpoint_of_a_suspended_process_changes_nothing() {
    let (fixture, mut suspended) = Fixture::suspended("2");

    let second = Running::start(joined(&fixture.project).envs([TIME_SCALE]));
    let (code, json, stderr) = second.end();
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(json["stages"], 8);
    let before = results(&fixture.project);
    suspended.send(Signal::CONT);
    let (code, json, stderr) = suspended.end();
    assert_eq!((code, &json["stages"]), (Some(0), &0.into()), "{stderr}");
    assert_eq!(results(&fixture.project), before);
    fixture.assert_uninterrupted_results();
}

/// While a process is suspended inside a transaction, no other process can write.
#[test]
fn a_process_suspended_inside_a_transaction_is_named_to_those_that_wait() {
    let fixture = Fixture::new("2");
    let mut suspended = fixture.suspended_at("fit:claiming", &[], &[]);
    let pid = suspended.pid();
    let found = lock_owner(&fixture.project.catalog_path()).expect("a lock_owner");
    assert_eq!((found.pid, found.is_stopped), (pid, true));
    let mut command = joined(&fixture.project);
    command.stderr(File::create(fixture.stderr_path()).expect("a file"));
    let second = command.stdout(Stdio::piped()).spawn();
    let mut second = Running(Some(second.expect("the binary starts")));
    let message = format!("catalog.sqlite is locked by pid {pid}, which is stopped");
    second.wait_until("it names the process that it waits for", || {
        let stderr = std::fs::read_to_string(fixture.stderr_path()).expect("a file");
        stderr.contains(&message)
    });
    suspended.send(Signal::CONT);
    let (first, second) = (suspended.end(), second.end());
    assert_eq!((first.0, second.0), (Some(0), Some(0)), "{}", first.2);
    fixture.assert_uninterrupted_results();
}

/// The leases of the suspended process expire, but no other process recovers them. The process drops its late result
/// all the same, and continues under a new worker id.
#[test]
fn a_process_suspended_past_its_leases_drops_its_work_and_continues() {
    let (fixture, mut suspended) = Fixture::suspended("2");
    // The lease of one second has to expire.
    std::thread::sleep(Duration::from_millis(1200));
    suspended.send(Signal::CONT);
    let (code, json, stderr) = suspended.end();
    assert_eq!(code, Some(0), "{stderr}");
    assert!(
        stderr.contains("could not reach the catalog until its leases ended"),
        "{stderr}"
    );
    assert_eq!(json["stages"], 8);
    fixture.assert_uninterrupted_results();
    assert!(pairs(&fixture.project).iter().all(|pair| pair.crashes == 0));
}

/// Reads, stages and writes in progress have taken longer than the limit when the process continues. The limit is longer
/// than a stage takes on a busy machine.
#[test]
fn a_process_suspended_for_longer_than_a_stage_may_take_continues() {
    let limit = ["--set", "run.stage_timeout_s=20"];
    let continues = |point: &str| {
        let fixture = Fixture::new("2");
        let mut suspended = fixture.suspended_at(point, &[], &limit);
        std::thread::sleep(Duration::from_secs(21));
        suspended.send(Signal::CONT);
        let (code, json, stderr) = suspended.end();
        assert_eq!((code, &json["stages"]), (Some(0), &8.into()), "{stderr}");
        fixture.assert_uninterrupted_results();
    };
    std::thread::scope(|scope| {
        for point in ["fit:synced", "register:written"] {
            scope.spawn(move || continues(point));
        }
    });
}

#[test]
fn pairs_of_a_dead_process_are_recovered_by_a_living_one() {
    let fixture = Fixture::new("3");
    let (mut owner, _file) = fixture.hold_at("fit:computed");
    let mut command = joined(&fixture.project);
    let mut second = Running::start(command.envs([TIME_SCALE]));
    second.wait_until("the others are done", || stages_done(&fixture.project) >= 8);
    owner.send(Signal::KILL);
    let (code, json, stderr) = second.end();
    assert_eq!((code, &json["stages"]), (Some(0), &12.into()), "{stderr}");
    fixture.assert_uninterrupted_results();
}

/// Leases have their full length here. They end early because the run lock proves that no other process is alive.
#[test]
fn pairs_of_a_dead_process_are_recovered_at_once_by_the_only_process() {
    let fixture = Fixture::new("2");
    let (mut owner, _file) = fixture.hold_at("fit:computed");
    owner.send(Signal::KILL);
    owner.end();
    let dir = fixture.project.dir();
    let status = mocban(dir, &["status", "--json"]).expect(0).json();
    assert_eq!(
        (&status["running"], &status["jobs"]["leased"]),
        (&false.into(), &1.into())
    );
    let shown = mocban(dir, &["status"]).expect(0);
    assert!(shown.out.contains("1 interrupted"), "{}", shown.out);
    assert!(!shown.out.contains("running"), "{}", shown.out);
    let ended = call(&mut run_with_progress(&fixture.project, "json", &[])).expect(0);
    let position = |kind: &str| {
        let event = format!("\"message_type\":\"{kind}\"");
        ended.err.lines().position(|line| line.contains(&event))
    };
    let (recovered, computed) = (position("recovered"), position("stage_started"));
    assert!(recovered.is_some() && recovered < computed, "{}", ended.err);
    fixture.assert_uninterrupted_results();
}

#[test]
fn one_signal_drains_and_does_not_count_the_attempt() {
    for signal in stop_signals() {
        let fixture = Fixture::new("2");
        let (mut child, file) = fixture.hold_at("fit:computed");
        child.send(signal);
        child.wait_until("it drains", || fixture.stop_requests() == 1);
        std::fs::remove_file(file).expect("removed");
        let (code, json, stderr) = child.end();
        assert_eq!(
            (code, &json["stopped"]),
            (Some(130), &true.into()),
            "{stderr}"
        );
        let first = &pairs(&fixture.project)[0];
        assert_eq!((first.results.status, first.attempt), (JobStatus::Ready, 0));
        assert_eq!(first.results.next_stage, Some(Stage::Depth));
        assert_eq!((&json["stages"], &json["left"]), (&1.into(), &2.into()));
        call(&mut run(&fixture.project, &[])).expect(0);
        fixture.assert_uninterrupted_results();
    }
}

/// `nohup` and a script's background jobs start a process with ignored signals.
#[test]
fn a_hang_up_that_is_ignored_from_the_start_does_not_stop_a_run() {
    let fixture = Fixture::new("2");
    let (mut child, file) = fixture.hold_at_under("fit:computed", |run| {
        let mut script = shell("trap '' HUP; exec \"$@\"");
        script.arg("sh").arg(run.get_program()).args(run.get_args());
        script
    });
    child.send(Signal::HUP);
    std::fs::remove_file(file).expect("removed");
    let (code, json, stderr) = child.end();
    assert_eq!((code, &json["stages"]), (Some(0), &8.into()), "{stderr}");
    fixture.assert_uninterrupted_results();
}

#[test]
fn a_second_signal_stops_at_once_and_leaves_all_resumable() {
    for signal in stop_signals() {
        let fixture = Fixture::new("2");
        // The file stays, so the stage in progress never ends.
        let (mut child, _file) = fixture.hold_at("fit:computed");
        child.send(signal);
        child.wait_until("it drains", || fixture.stop_requests() == 1);
        child.send(signal);
        let (code, json, stderr) = child.end();
        assert_eq!((code, &json["stages"]), (Some(130), &0.into()), "{stderr}");
        for pair in pairs(&fixture.project) {
            let state = (pair.results.status, pair.attempt, pair.crashes);
            assert_eq!(state, (JobStatus::Ready, 0, 0));
        }
        call(&mut run(&fixture.project, &[])).expect(0);
        fixture.assert_uninterrupted_results();
    }
}

#[test]
fn a_second_signal_does_not_wait_for_a_disk_that_hangs() {
    // After `register` nothing is left to compute, but the pair is not done before its files are written.
    for (at, stored, next) in [
        ("depth:written", 1, Stage::Depth),
        ("register:written", 3, Stage::Register),
    ] {
        let fixture = Fixture::new("1");
        let (mut child, _file) = fixture.hold_at(at);
        child.send(Signal::TERM);
        child.wait_until("it drains", || fixture.stop_requests() == 1);
        child.send(Signal::TERM);
        let (code, json, stderr) = child.end();
        // A stage is stored only after its files and the files of all earlier stages were written.
        let ended = (code, &json["stages"], &json["done"]);
        assert_eq!(ended, (Some(130), &stored.into(), &0.into()), "{stderr}");
        let pair = &pairs(&fixture.project)[0];
        let state = (pair.results.status, pair.attempt, pair.crashes);
        assert_eq!(state, (JobStatus::Ready, 0, 0));
        assert_eq!(pair.results.next_stage, Some(next));
        call(&mut run(&fixture.project, &[])).expect(0);
        fixture.assert_uninterrupted_results();
    }
}
