//! Attacks at random moments: kills during commands that write, a deleted log of the catalog, a copy of a running
//! project, suspended processes, long lists, many review tabs. Nothing acknowledged is lost, and the results are those
//! of an undisturbed run. `MOCBAN_TRIALS` sets the number of trials.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::cli::{Call, call, mocban};
use crate::crowd::watched;
use crate::page::{NO_CHECKS, Page, Site, answer, read_project};
use crate::renamed::held;
use crate::resume::{copy, project, results, run};
use crate::test_size::trials;

/// A project with results and a failed pair, to be attacked in copies.
struct Target {
    dir: tempfile::TempDir,
    fresh: Project,
    done: Project,
    expected: Vec<String>,
    dice: ChaCha8Rng,
}

impl Target {
    fn new(seed: u64) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let fresh = project(dir.path(), "fresh", "2");
        let done = copy(&fresh, &dir.path().join("done"));
        call(&mut run(&done, &[])).expect(0);
        Self {
            expected: results(&done),
            dir,
            fresh,
            done,
            dice: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Returns a new copy of a project in place of the last one.
    fn copy_of(&self, original: &Project) -> Project {
        let to = self.dir.path().join("p");
        if to.exists() {
            std::fs::remove_dir_all(&to).expect("removed");
        }
        copy(original, &to)
    }

    /// Starts a command and kills it after at most `longest`, unless it ends before.
    fn kill(&mut self, command: &mut Command, longest: Duration) {
        let mut child = quiet(command);
        self.wait(&mut child, longest);
        let _ = child.kill();
        child.wait().expect("dead");
    }

    /// Waits for a random time, or until the process ends. An event would not give random moments.
    fn wait(&mut self, child: &mut Child, longest: Duration) {
        let moment = longest.mul_f64(self.dice.random::<f64>());
        let end = Instant::now() + moment;
        while Instant::now() < end && child.try_wait().expect("its state").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

fn quiet(command: &mut Command) -> Child {
    let command = command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().expect("the binary starts")
}

/// Returns the command with these arguments for a project.
fn command(project: &Project, args: &[&str]) -> Command {
    let mut command = crate::cli::binary();
    command.arg("-C").arg(project.dir()).args(args);
    command
}

/// Checks that a project is whole, or that its damage is repaired by `check --repair`.
#[track_caller]
fn assert_whole(project: &Project) {
    let checked = mocban(project.dir(), &["check"]);
    if checked.code == 12 {
        mocban(project.dir(), &["check", "--repair", "--accept-missing"]).expect(0);
    } else {
        checked.expect(0);
    }
}

#[test]
fn a_run_of_all_pairs_again_survives_kills() {
    let mut target = Target::new(1);
    for _ in 0..trials(4) {
        let p = target.copy_of(&target.done);
        target.kill(&mut run(&p, &["--rerun", "all"]), Duration::from_secs(2));
        assert_whole(&p);
        call(&mut run(&p, &[])).expect(0);
        assert_eq!(results(&p), target.expected);
    }
}

#[test]
fn a_repair_survives_kills() {
    let mut target = Target::new(2);
    for _ in 0..trials(4) {
        let p = target.copy_of(&target.done);
        let artifacts = crate::uninterrupted::files(&p.artifacts_dir());
        for path in artifacts.keys().step_by(2) {
            std::fs::remove_file(p.artifacts_dir().join(path)).expect("removed");
        }
        let mut repair = command(&p, &["check", "--repair", "--accept-missing"]);
        target.kill(&mut repair, Duration::from_millis(200));
        assert_whole(&p);
        call(&mut run(&p, &[])).expect(0);
        assert_eq!(results(&p), target.expected);
    }
}

/// Returns the number of pairs with this status.
fn jobs(project: &Project, status: &str) -> u64 {
    let found = mocban(project.dir(), &["status", "--json"])
        .expect(0)
        .json();
    found["jobs"][status].as_u64().expect("a count")
}

#[test]
fn a_retry_survives_kills() {
    let mut target = Target::new(3);
    let list = "id,mesh,print\nx1,no.obj,no.png\nx2,no.obj,no.png\n";
    let path = target.done.dir().join("more.csv");
    std::fs::write(&path, list).expect("written");
    mocban(
        target.done.dir(),
        &["import", "more.csv", "--allow-missing"],
    )
    .expect(0);
    call(&mut run(&target.done, &[])).expect(3);
    for _ in 0..trials(6) {
        let p = target.copy_of(&target.done);
        target.kill(&mut command(&p, &["retry"]), Duration::from_millis(100));
        assert_whole(&p);
        let (failed, ready) = (jobs(&p, "quarantined"), jobs(&p, "ready"));
        assert!(
            [(2, 0), (0, 2)].contains(&(failed, ready)),
            "{failed} {ready}"
        );
        let retried = mocban(p.dir(), &["retry"]);
        assert!([0, 4].contains(&retried.code), "{}", retried.err);
        call(&mut run(&p, &[])).expect(3);
        assert_eq!((jobs(&p, "quarantined"), jobs(&p, "done")), (2, 2));
    }
}

/// Returns the number of lines in the log of verdicts.
fn verdicts(project: &Project) -> usize {
    let log = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    log.out.lines().count()
}

#[test]
fn an_import_of_verdicts_is_whole_despite_kills() {
    let mut target = Target::new(4);
    let lines = (0..2000).map(|i| format!("upright-000{},pass,reader {},n{i}\n", i % 2, i / 2));
    let list = format!("pair,verdict,reviewer,note\n{}", lines.collect::<String>());
    let file = target.dir.path().join("verdicts.csv");
    std::fs::write(&file, list).expect("written");
    let file = file.to_str().expect("UTF-8");
    let import = ["verdict", "import", file];
    let all = target.copy_of(&target.done);
    call(&mut command(&all, &import)).expect(0);
    let all = verdicts(&all);
    for _ in 0..trials(6) {
        let p = target.copy_of(&target.done);
        target.kill(&mut command(&p, &import), Duration::from_secs(1));
        assert_whole(&p);
        let stored = verdicts(&p);
        assert!([0, all].contains(&stored), "{stored} of {all}");
        if stored == 0 {
            call(&mut command(&p, &import)).expect(0);
            assert_eq!(verdicts(&p), all);
        }
    }
}

#[test]
fn a_lost_log_of_the_catalog_loses_only_what_is_computed_again() {
    let mut target = Target::new(5);
    for trial in 0..trials(6) {
        let p = target.copy_of(&target.fresh);
        target.kill(&mut run(&p, &[]), Duration::from_secs(3));
        let log = p.dir().join("catalog.sqlite-wal");
        match std::fs::metadata(&log) {
            Ok(_) if trial % 2 == 0 => std::fs::remove_file(&log).expect("removed"),
            Ok(found) => {
                let bytes = target.dice.random_range(0..=found.len());
                let file = OpenOptions::new().write(true).open(&log).expect("a log");
                file.set_len(bytes).expect("truncated");
            }
            Err(_) => {}
        }
        assert_whole(&p);
        call(&mut run(&p, &[])).expect(0);
        assert_eq!(results(&p), target.expected);
    }
}

/// How another program harms the log of the catalog.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LogAttack {
    Delete,
    Replace,
    Cut,
}

impl LogAttack {
    fn act(self, log: &Path) {
        let file = OpenOptions::new().write(true).open(log).expect("a log");
        assert!(file.metadata().expect("a length").len() > 0);
        match self {
            Self::Delete => std::fs::remove_file(log).expect("removed"),
            Self::Replace => {
                std::fs::remove_file(log).expect("removed");
                std::fs::write(log, "").expect("written");
            }
            Self::Cut => file.set_len(0).expect("cut"),
        }
    }
}

#[test]
fn a_run_whose_log_is_deleted_replaced_or_cut_stops_and_claims_nothing_false() {
    let target = Target::new(8);
    for attack in [LogAttack::Delete, LogAttack::Replace, LogAttack::Cut] {
        for failpoint in ["fit:computed", "depth:written", "register:synced"] {
            let p = target.copy_of(&target.fresh);
            let hold = target.dir.path().join("hold");
            let child = held(&p, failpoint, &hold);
            attack.act(&p.dir().join("catalog.sqlite-wal"));
            std::fs::remove_file(&hold).expect("released");
            let ended = child.wait_with_output().expect("an end");
            let err = String::from_utf8(ended.stderr).expect("UTF-8");
            // A log whose pages are all in the main file may be cut without loss, and the run goes on.
            let is_harmless = attack == LogAttack::Cut && ended.status.success();
            // A log that is cut between the look at it and the end of a commit has a hole, which reads as damage.
            let is_damaged = attack == LogAttack::Cut && err.contains("part of it was overwritten");
            if is_damaged {
                assert!(!ended.status.success(), "{err}");
                if mocban(p.dir(), &["check"]).code != 0 {
                    continue;
                }
            }
            if !is_harmless && !is_damaged {
                assert_eq!(ended.status.code(), Some(12), "{attack:?}: {err}");
                let wanted = "another program deleted, replaced or cut";
                assert!(err.contains(wanted) && !err.contains("is safe"), "{err}");
                let may_lose = err.contains("may be lost");
                assert_eq!(may_lose, attack == LogAttack::Cut, "{attack:?}: {err}");
            }
            assert_whole(&p);
            if is_harmless {
                assert_eq!(results(&p), target.expected);
            }
            call(&mut run(&p, &[])).expect(0);
            assert_eq!(results(&p), target.expected);
        }
    }
}

/// A copy made during a run may be damaged. In that case `check --repair` fails, and `run` reports the damage.
#[test]
fn a_copy_of_a_running_project_can_be_continued_or_is_refused_as_damaged() {
    let mut target = Target::new(6);
    for _ in 0..trials(4) {
        let p = target.copy_of(&target.fresh);
        let mut running = quiet(&mut run(&p, &[]));
        target.wait(&mut running, Duration::from_secs(3));
        let to = target.dir.path().join("copied");
        let mut cp = Command::new("cp");
        cp.arg("-r").args([p.dir(), &to]).stderr(Stdio::null());
        // Fails if a temporary file is removed before it is copied.
        cp.status().expect("cp");
        assert!(running.wait().expect("an end").success());
        let copied = Project::open(&to).expect("a project");
        let repaired = mocban(&to, &["check", "--repair"]);
        let continued = call(&mut run(&copied, &[]));
        if repaired.code == 0 {
            continued.expect(0);
            assert_eq!(results(&copied), target.expected);
        } else {
            assert_refused_as_damaged(&repaired, &continued);
        }
        std::fs::remove_dir_all(&to).expect("removed");
    }
}

#[track_caller]
fn assert_refused_as_damaged(repaired: &Call, continued: &Call) {
    assert_eq!(repaired.code, 12, "{}", repaired.err);
    assert_ne!(continued.code, 0, "{}", continued.err);
    assert!(continued.err.contains("damaged"), "{}", continued.err);
}

#[test]
fn processes_suspended_at_random_moments_for_two_leases_change_nothing() {
    let mut target = Target::new(7);
    for _ in 0..trials(2) {
        let p = target.copy_of(&target.fresh);
        // Leases last 2.5 s. If shorter ones ended on a busy machine, workers would take each other for dead.
        let scale = ("MOCBAN_TIME_SCALE", "20");
        // Suspended before it has begun, the first run comes after the second one.
        let mut first = quiet(run(&p, &["--join", "-j", "1"]).envs([scale]));
        target.wait(&mut first, Duration::from_secs(1));
        let pid = Pid::from_child(&first);
        // Fails if the run has ended.
        let _ = kill_process(pid, Signal::STOP);
        let second = quiet(run(&p, &["--join", "-j", "1"]).envs([scale]));
        std::thread::sleep(Duration::from_millis(5500));
        let _ = kill_process(pid, Signal::CONT);
        for mut child in [first, second] {
            assert!(child.wait().expect("an end").success());
        }
        mocban(p.dir(), &["check"]).expect(0);
        assert_eq!(results(&p), target.expected);
    }
}

/// Imports a list. Returns the outcome and the peak memory in MiB.
fn import(list: &str) -> (Call, u64) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(dir.path().join("pairs.csv"), list).expect("written");
    let (ended, kib) = watched(dir.path(), &["import", "pairs.csv", "--allow-missing"]);
    (ended, kib >> 10)
}

#[test]
fn long_lists_and_long_lines_need_little_memory_and_give_short_messages() {
    let rows = trials(10) * 2000;
    let lines = (0..rows).map(|i| format!("p{i},{i}.obj,{i}.png\n"));
    let (ended, peak) = import(&format!("id,mesh,print\n{}", lines.collect::<String>()));
    let ended = ended.expect(0);
    assert!(
        ended.err.contains(&format!("{rows} pairs added")),
        "{}",
        ended.err
    );
    assert!(peak < 300, "{peak} MiB");
    let long = "x".repeat(100_000);
    let lines = (0..100).map(|i| format!("p{i},{long}{i}.obj,a.png\n"));
    let (ended, peak) = import(&format!("id,mesh,print\n{}", lines.collect::<String>()));
    assert!([0, 2].contains(&ended.code), "{}", ended.err);
    assert!(
        ended.err.len() < 200_000,
        "{} bytes of messages",
        ended.err.len()
    );
    assert!(peak < 300, "{peak} MiB");
}

/// Sends answers like a tab of the browser. Repeats an answer until it is acknowledged. Returns the acknowledged events.
fn review_tab(site: &Site, queue: &[Value], tab: usize, answers: usize) -> Vec<String> {
    let mut events = Vec::new();
    for i in 0..answers {
        let event = format!("t{tab}-{i}");
        let verdict = ["pass", "unsure"][i % 2];
        let body = answer(&event, &queue[(tab + i) % queue.len()], verdict);
        for tries in 0.. {
            assert!(tries < 50, "{event} is not acknowledged");
            let reply = site.post("/api/answer", &body);
            if reply.is_ok_and(|reply| reply.status == 200) {
                break;
            }
        }
        events.push(event);
    }
    events
}

#[test]
fn many_tabs_on_several_servers_store_every_answer_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    // Two servers of the same reviewer, and one of another reviewer.
    let pages = ["lan", "lan", "minh"].map(|name| Page::open(&project, name, &NO_CHECKS));
    let queues = pages.each_ref().map(|page| page.queue());
    let answers = trials(2);
    let acknowledged: Vec<String> = std::thread::scope(|scope| {
        let tab = |tab: usize| {
            let (page, queue) = (&pages[tab % 3], &queues[tab % 3]);
            scope.spawn(move || review_tab(page, queue, tab, answers))
        };
        let tabs: Vec<_> = (0..50).map(tab).collect();
        let ends = tabs.into_iter().flat_map(|tab| tab.join().expect("a tab"));
        ends.collect()
    });
    drop(pages);
    let log = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let mut stored: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for line in log.out.lines() {
        let event: Value = serde_json::from_str(line).expect("JSON");
        let name = event["event"].as_str().expect("an event").to_owned();
        stored
            .entry(name)
            .or_default()
            .push(json!([event["pair"], event["metric"]]));
    }
    assert_eq!(stored.len(), acknowledged.len());
    for event in acknowledged {
        let mut rows: Vec<String> = stored[&event].iter().map(Value::to_string).collect();
        let all = rows.len();
        rows.sort();
        rows.dedup();
        assert!(rows.len() == all && all > 0, "{event}: {rows:?}");
    }
    mocban(project.dir(), &["check"]).expect(0);
}
