//! Random `kill -9` until a run succeeds: no work is lost or stored twice, and the results are the same bytes.
//! `MOCBAN_KILLS` sets the number of kills and `MOCBAN_KILLED_PAIRS` the number of pairs. With 300 kills and 200 pairs
//! the test takes some minutes.

use std::process::Stdio;
use std::time::{Duration, Instant};

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::resume::{copy, project, run};
use crate::test_size::size_from_env;
use crate::uninterrupted::{Expected, files};

/// Deaths during a claim, before the random kills.
const DEATHS_WHILE_CLAIMING: u32 = 12;

/// Kills runs while no pair is leased. After deaths without a lease, a pair is quarantined only after more crashes, so
/// the random kills later do not quarantine a pair that happens to be the only leased one three times.
fn die_while_claiming(project: &Project) {
    for _ in 0..DEATHS_WHILE_CLAIMING {
        let died = run(project, &[])
            .env("MOCBAN_BREAK_AT", "fit:claiming")
            .output()
            .expect("the binary starts");
        assert_eq!(died.status.code(), None, "{died:?}");
    }
}

/// Decides how long a run may take before it is killed. On a busy machine, half a second may be too short for any
/// progress, and a pair would be quarantined. The time therefore doubles after every three runs without a new artifact.
struct Patience {
    files: usize,
    runs_without_progress: u32,
}

impl Patience {
    /// Counts the artifacts. Returns the factor by which the next run may take longer.
    fn next(&mut self, project: &Project) -> u64 {
        let folder = project.artifacts_dir();
        let found = if folder.exists() {
            files(&folder).len()
        } else {
            0
        };
        self.runs_without_progress = if found > self.files {
            0
        } else {
            self.runs_without_progress + 1
        };
        self.files = self.files.max(found);
        1 << (self.runs_without_progress / 3).min(8)
    }
}

/// Starts runs until one ends by itself. Kills each run after 50 to 500 ms, or later if recent runs made no progress.
/// Returns the number of kills.
fn run_with_kills(project: &Project, dice: &mut ChaCha8Rng) -> usize {
    let mut patience = Patience {
        files: 0,
        runs_without_progress: 0,
    };
    for kills in 0.. {
        let jobs = if dice.random_bool(0.5) { "1" } else { "2" };
        let longest = 500 * patience.next(project);
        let mut child = run(project, &["-j", jobs])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary starts");
        let kill_at = Instant::now() + Duration::from_millis(dice.random_range(50..=longest));
        while Instant::now() < kill_at {
            if let Some(ended) = child.try_wait().expect("the child's state") {
                assert!(ended.success(), "{ended:?}");
                return kills;
            }
            // The kill must come at a random moment, so the test waits for a time and not for an event.
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().expect("killed");
        child.wait().expect("dead");
    }
    unreachable!("the loop ends with a return")
}

/// Kills runs of copies of a project until there were enough kills.
#[test]
fn random_kills_lose_nothing_and_repeat_nothing() {
    let count = size_from_env("MOCBAN_KILLED_PAIRS", 8);
    let kills = size_from_env("MOCBAN_KILLS", 20);
    let dir = tempfile::tempdir().expect("a temporary directory");
    let fresh = project(dir.path(), "fresh", &count.to_string());
    let expected = Expected::of(&fresh, &dir.path().join("uninterrupted"));
    let mut dice = ChaCha8Rng::seed_from_u64(4);
    let (mut done, mut copies) = (0, 0);
    while done < kills {
        let parent = dir.path().join(format!("broken-{copies}"));
        let broken = copy(&fresh, &parent.join("p"));
        die_while_claiming(&broken);
        done += run_with_kills(&broken, &mut dice);
        copies += 1;
        expected.assert_met_by(&broken);
        std::fs::remove_dir_all(parent).expect("removed");
    }
    eprintln!("{done} kills over {count} pairs, run to the end {copies} times");
}
