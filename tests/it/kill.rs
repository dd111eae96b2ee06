//! The real binary under random `kill -9` until its run is done: nothing lost, nothing doubled, the same bytes.
//! `MOCBAN_KILLS` says how often, `MOCBAN_KILLED_PAIRS` over how many pairs: 300 over 200 is a look of some minutes.

use std::process::Stdio;
use std::time::{Duration, Instant};

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::resume::{copy, project, run};
use crate::test_size::size_from_env;
use crate::unbroken::{Wanted, files};

/// Deaths with no pair in hand that come before the shots.
const OPENING: u32 = 12;

/// Lets runs die while they claim, so that nothing is in hand: from these deaths the catalog knows that they come from
/// outside. Without them a pair that is alone in hand at the first three shots is rightly taken for what kills.
fn opening(project: &Project) {
    for _ in 0..OPENING {
        let died = run(project, &[])
            .env("MOCBAN_BREAK_AT", "fit:claiming")
            .output()
            .expect("the binary starts");
        assert_eq!(died.status.code(), None, "{died:?}");
    }
}

/// How long shots are held off. A machine that has much else to do gets nowhere in half a second, and then a pair is
/// rightly taken for what kills; so each three shots in a row without a new file of results double the time.
struct Mercy {
    files: usize,
    in_vain: u32,
}

impl Mercy {
    /// How many times as long as usual the next shot may come, by what lies in the folder of results.
    fn next(&mut self, project: &Project) -> u64 {
        let folder = project.artifacts_dir();
        let found = if folder.exists() {
            files(&folder).len()
        } else {
            0
        };
        self.in_vain = if found > self.files {
            0
        } else {
            self.in_vain + 1
        };
        self.files = self.files.max(found);
        1 << (self.in_vain / 3).min(8)
    }
}

/// Starts the run again and again and kills it after 50 to 500 ms, longer where nothing comes of it, until one ends
/// by itself; says how often it was killed.
fn run_under_fire(project: &Project, dice: &mut ChaCha8Rng) -> usize {
    let mut mercy = Mercy {
        files: 0,
        in_vain: 0,
    };
    for kills in 0.. {
        let jobs = if dice.random_bool(0.5) { "1" } else { "2" };
        let longest = 500 * mercy.next(project);
        let mut child = run(project, &["-j", jobs])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary starts");
        let shot = Instant::now() + Duration::from_millis(dice.random_range(50..=longest));
        while Instant::now() < shot {
            if let Some(ended) = child.try_wait().expect("a child that can be asked") {
                assert!(ended.success(), "{ended:?}");
                return kills;
            }
            // The moment of the shot is what is tested: there is no event to wait for.
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().expect("killed");
        child.wait().expect("dead");
    }
    unreachable!("the loop has no end of its own")
}

/// Kills runs of copies of a project until there were enough kills.
#[test]
fn twenty_kills_lose_nothing_and_double_nothing() {
    let count = size_from_env("MOCBAN_KILLED_PAIRS", 8);
    let kills = size_from_env("MOCBAN_KILLS", 20);
    let dir = tempfile::tempdir().expect("a temporary directory");
    let fresh = project(dir.path(), "fresh", &count.to_string());
    let wanted = Wanted::of(&fresh, &dir.path().join("unbroken"));
    let mut dice = ChaCha8Rng::seed_from_u64(4);
    let (mut done, mut copies) = (0, 0);
    while done < kills {
        let parent = dir.path().join(format!("broken-{copies}"));
        let broken = copy(&fresh, &parent.join("p"));
        opening(&broken);
        done += run_under_fire(&broken, &mut dice);
        copies += 1;
        wanted.is_met_by(&broken);
        std::fs::remove_dir_all(parent).expect("removed");
    }
    eprintln!("{done} kills over {count} pairs, run to the end {copies} times");
}
