//! Several processes on one catalog, and processes that are stopped, held up or told to end.

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

use crate::cli::{call, mocban};
use crate::resume::{finished, pairs, project, results, run, run_telling, stages_done};

/// Makes leases last a second instead of nearly a minute, and everything else that goes with them as much shorter.
const TIME_SCALE: (&str, &str) = ("MOCBAN_TIME_SCALE", "50");

/// Most pairs of a test here.
const MOST: &str = "4";

/// What an unbroken run of so many pairs gives.
static UNBROKEN: LazyLock<Vec<String>> = LazyLock::new(|| {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let unbroken = project(dir.path(), "p", MOST);
    call(&mut run(&unbroken, &[])).expect(0);
    results(&unbroken)
});

/// A project that has not run.
struct World {
    project: Project,
    dir: tempfile::TempDir,
}

impl World {
    fn new(count: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = project(dir.path(), "p", count);
        Self { project, dir }
    }

    /// `run --json` with one worker that is held up at a point until the file is removed.
    fn held(&self, point: &str) -> (Running, PathBuf) {
        let file = self.dir.path().join("held");
        let mut command = run_telling(&self.project, "json", &["-j", "1", "--json"]);
        command.env("MOCBAN_HOLD_AT", point);
        command.env("MOCBAN_HOLD_FILE", &file);
        command.stderr(File::create(self.said()).expect("a file"));
        let mut child = Running(Some(
            command
                .stdout(Stdio::piped())
                .spawn()
                .expect("the binary starts"),
        ));
        child.wait_until("it is held", || file.exists());
        (child, file)
    }

    /// A project whose run with one worker is stopped with the first stage's files on the disk and its rows not yet
    /// written. The signal may strike while another of its threads writes a sign of life: then all others wait for it,
    /// which is not what is asked here, and another is begun.
    fn stopped(count: &str) -> (Self, Running) {
        loop {
            let world = Self::new(count);
            let stopped = world.stopped_at("fit:synced", &[TIME_SCALE]);
            if lock_owner(&world.project.catalog_path()).is_none() {
                return (world, stopped);
            }
        }
    }

    /// `run --json` with one worker, stopped at a point.
    fn stopped_at(&self, point: &str, pace: &[(&str, &str)]) -> Running {
        let mut command = run(&self.project, &["-j", "1", "--json"]);
        command
            .env("MOCBAN_STOP_AT", point)
            .envs(pace.iter().copied());
        let mut stopped = Running::start(&mut command);
        let pid = stopped.pid();
        stopped.wait_until("it is stopped", || is_stopped(pid));
        stopped
    }

    /// Where a held process says what happens.
    fn said(&self) -> PathBuf {
        self.dir.path().join("said")
    }

    /// How often a held process was told to stop, by its own word.
    fn stops(&self) -> usize {
        let said = std::fs::read_to_string(self.said()).expect("a file");
        said.matches("asked to stop").count()
    }

    /// All is done as without a break, and no stage was stored twice.
    fn is_as_unbroken(&self) {
        let found = results(&self.project);
        // The lines are in the order of pairs, and fewer pairs of the dataset are the first of more.
        assert_eq!(found, UNBROKEN[..found.len()]);
        assert!(finished(&self.project).iter().all(|times| *times == 1));
    }
}

/// A process that ends with its test.
struct Running(Option<Child>);

impl Running {
    fn start(command: &mut Command) -> Self {
        let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().expect("the binary starts")))
    }

    fn child(&mut self) -> &mut Child {
        self.0.as_mut().expect("it has not ended")
    }

    fn pid(&mut self) -> u32 {
        self.child().id()
    }

    fn send(&mut self, signal: Signal) {
        kill_process(Pid::from_child(self.child()), signal).expect("sent");
    }

    /// Waits for something that the process brings about.
    fn wait_until(&mut self, what: &str, is_so: impl Fn() -> bool) {
        let patience = Instant::now() + Duration::from_mins(1);
        while !is_so() {
            let ended = self.child().try_wait().expect("a child that can be asked");
            assert!(ended.is_none(), "it ended before {what}: {ended:?}");
            assert!(Instant::now() < patience, "{what} never came");
            std::thread::yield_now();
        }
    }

    /// Waits for its end; gives the exit code, what `--json` printed and what it said.
    fn end(mut self) -> (Option<i32>, Value, String) {
        let child = self.0.take().expect("it has not ended");
        let output = child.wait_with_output().expect("it ends");
        let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), json, said)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            // It may have ended by itself; then there is nothing to kill.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Whether a process is stopped by a signal (`proc_pid_stat(5)`: the state follows the name in brackets).
fn is_stopped(pid: u32) -> bool {
    let stat = std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("stat"));
    stat.is_ok_and(|stat| {
        stat.rsplit(") ")
            .next()
            .is_some_and(|rest| rest.starts_with('T'))
    })
}

fn joined(project: &Project) -> Command {
    run(project, &["--join", "-j", "1", "--json"])
}

#[test]
fn two_processes_share_the_work() {
    let world = World::new(MOST);
    let (owner, file) = world.held("fit:computed");
    let refused = call(&mut run(&world.project, &[])).expect(11);
    assert!(refused.err.contains("in use by pid"), "{}", refused.err);

    let mut second = Running::start(&mut joined(&world.project));
    // All that the held one does not have; then it waits for that too.
    second.wait_until("the others are done", || stages_done(&world.project) == 12);
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
    world.is_as_unbroken();
}

#[test]
fn who_joins_with_other_settings_is_refused_and_told_which() {
    let world = World::new("1");
    let (owner, file) = world.held("fit:computed");
    let mut other = joined(&world.project);
    other.args(["--set", "register.smoothing_px=1.5"]);
    let refused = call(&mut other).expect(2);
    let told = "the run in progress has other settings (register.smoothing_px: 1.22 -> 1.5); \
        use the same settings, or wait until it has ended";
    assert!(refused.err.contains(told), "{}", refused.err);
    std::fs::remove_file(file).expect("removed");
    assert_eq!(owner.end().0, Some(0));
    world.is_as_unbroken();
}

#[test]
fn what_a_stopped_process_stores_too_late_changes_nothing() {
    let (world, mut stopped) = World::stopped("2");

    let second = Running::start(joined(&world.project).envs([TIME_SCALE]));
    let (code, json, said) = second.end();
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(json["stages"], 8);
    let before = results(&world.project);
    stopped.send(Signal::CONT);
    let (code, json, said) = stopped.end();
    assert_eq!((code, &json["stages"]), (Some(0), &0.into()), "{said}");
    assert_eq!(results(&world.project), before);
    world.is_as_unbroken();
}

/// A process may be stopped inside a commit; then nobody else can write until it goes on.
#[test]
fn who_is_stopped_inside_a_commit_is_named_to_those_who_wait() {
    let world = World::new("2");
    let mut stopped = world.stopped_at("fit:claiming", &[]);
    let pid = stopped.pid();
    let found = lock_owner(&world.project.catalog_path()).expect("a lock_owner");
    assert_eq!((found.pid, found.is_stopped), (pid, true));
    let mut command = joined(&world.project);
    command.stderr(File::create(world.said()).expect("a file"));
    let second = command.stdout(Stdio::piped()).spawn();
    let mut second = Running(Some(second.expect("the binary starts")));
    let told = format!("catalog.sqlite is kept locked by pid {pid}, which is stopped");
    second.wait_until("it names who is waited for", || {
        let said = std::fs::read_to_string(world.said()).expect("a file");
        said.contains(&told)
    });
    stopped.send(Signal::CONT);
    let (first, second) = (stopped.end(), second.end());
    assert_eq!((first.0, second.0), (Some(0), Some(0)), "{}", first.2);
    world.is_as_unbroken();
}

/// Nobody takes its leases back: its own late write is refused all the same, and it goes on under another number.
#[test]
fn a_process_held_up_past_its_leases_drops_what_it_had_and_goes_on() {
    let (world, mut stopped) = World::stopped("2");
    // Time itself is what runs out here: a lease is a second long.
    std::thread::sleep(Duration::from_millis(1200));
    stopped.send(Signal::CONT);
    let (code, json, said) = stopped.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("suspended past the end of its leases"),
        "{said}"
    );
    assert_eq!(json["stages"], 8);
    world.is_as_unbroken();
    assert!(pairs(&world.project).iter().all(|pair| pair.crashes == 0));
}

#[test]
fn pairs_of_a_dead_process_come_back_to_one_that_lives() {
    let world = World::new("3");
    let (mut owner, _file) = world.held("fit:computed");
    let mut command = joined(&world.project);
    let mut second = Running::start(command.envs([TIME_SCALE]));
    second.wait_until("the others are done", || stages_done(&world.project) == 8);
    owner.send(Signal::KILL);
    let (code, json, said) = second.end();
    assert_eq!((code, &json["stages"]), (Some(0), &12.into()), "{said}");
    world.is_as_unbroken();
}

/// Nothing is hastened: a lease would last for most of a minute, but the lock says that nobody else lives.
#[test]
fn pairs_of_a_dead_process_come_back_at_once_to_one_that_is_alone() {
    let world = World::new("2");
    let (mut owner, _file) = world.held("fit:computed");
    owner.send(Signal::KILL);
    owner.end();
    let dir = world.project.dir();
    let status = mocban(dir, &["status", "--json"]).expect(0).json();
    assert_eq!(
        (&status["running"], &status["jobs"]["leased"]),
        (&false.into(), &1.into())
    );
    let shown = mocban(dir, &["status"]).expect(0);
    assert!(shown.out.contains("1 cut off"), "{}", shown.out);
    assert!(!shown.out.contains("running"), "{}", shown.out);
    let begun = Instant::now();
    call(&mut run(&world.project, &[])).expect(0);
    assert!(begun.elapsed() < Duration::from_secs(30));
    world.is_as_unbroken();
}

#[test]
fn one_signal_drains_and_gives_the_try_back() {
    for signal in [Signal::INT, Signal::TERM] {
        let world = World::new("2");
        let (mut child, file) = world.held("fit:computed");
        child.send(signal);
        child.wait_until("it drains", || world.stops() == 1);
        std::fs::remove_file(file).expect("removed");
        let (code, json, said) = child.end();
        assert_eq!(
            (code, &json["stopped"]),
            (Some(130), &true.into()),
            "{said}"
        );
        let first = &pairs(&world.project)[0];
        assert_eq!((first.results.status, first.attempt), (JobStatus::Ready, 0));
        assert_eq!(first.results.next_stage, Some(Stage::Depth));
        assert_eq!((&json["stages"], &json["left"]), (&1.into(), &2.into()));
        call(&mut run(&world.project, &[])).expect(0);
        world.is_as_unbroken();
    }
}

#[test]
fn a_second_signal_stops_at_once_and_leaves_all_resumable() {
    for signal in [Signal::INT, Signal::TERM] {
        let world = World::new("2");
        // The file stays: the stage in hand never ends by itself.
        let (mut child, _file) = world.held("fit:computed");
        child.send(signal);
        child.wait_until("it drains", || world.stops() == 1);
        child.send(signal);
        let (code, json, said) = child.end();
        assert_eq!((code, &json["stages"]), (Some(130), &0.into()), "{said}");
        for pair in pairs(&world.project) {
            let state = (pair.results.status, pair.attempt, pair.crashes);
            assert_eq!(state, (JobStatus::Ready, 0, 0));
        }
        call(&mut run(&world.project, &[])).expect(0);
        world.is_as_unbroken();
    }
}

#[test]
fn a_second_signal_does_not_wait_for_a_disk_that_hangs() {
    // With the last stage's files nothing is left to compute, and yet the pair is not done.
    for (at, stored, next) in [
        ("depth:written", 1, Stage::Depth),
        ("register:written", 3, Stage::Register),
    ] {
        let world = World::new("1");
        let (mut child, _file) = world.held(at);
        child.send(Signal::INT);
        child.wait_until("it drains", || world.stops() == 1);
        child.send(Signal::INT);
        let (code, json, said) = child.end();
        // What has its files is stored; nothing is, that comes after files which are not on disk.
        let told = (code, &json["stages"], &json["done"]);
        assert_eq!(told, (Some(130), &stored.into(), &0.into()), "{said}");
        let pair = &pairs(&world.project)[0];
        let state = (pair.results.status, pair.attempt, pair.crashes);
        assert_eq!(state, (JobStatus::Ready, 0, 0));
        assert_eq!(pair.results.next_stage, Some(next));
        call(&mut run(&world.project, &[])).expect(0);
        world.is_as_unbroken();
    }
}
