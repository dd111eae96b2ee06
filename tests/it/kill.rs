//! The real binary under random `kill -9` until its run is done: nothing lost, nothing doubled, the same bytes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use mocban::domain::JobStatus;
use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::cli::{call, mocban};
use crate::resume::{copy, finished, pairs, project, results, run};

/// A project's parent, its bytes to come and what an unbroken run of it gave.
struct Wanted {
    project: Project,
    results: Vec<String>,
    told: BTreeMap<PathBuf, Vec<u8>>,
    artifacts: Vec<PathBuf>,
}

/// Every file below a folder, by its path in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(at) = open.pop() {
        for entry in std::fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let inside = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(inside, std::fs::read(path).expect("a file"));
            }
        }
    }
    found
}

/// The report and the export of the project `p` in a folder, as bytes.
fn told(parent: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    mocban(parent, &["-C", "p", "export", "-o", "out"]).expect(0);
    let mut told = files(&parent.join("out"));
    for form in ["csv", "json", "text"] {
        let report = mocban(parent, &["-C", "p", "report", "-f", form]).expect(0);
        told.insert(PathBuf::from(form), report.out.into_bytes());
    }
    told
}

fn artifacts(project: &Project) -> Vec<PathBuf> {
    files(&project.artifacts_dir()).into_keys().collect()
}

impl Wanted {
    /// Runs a copy of the project without a break.
    fn of(fresh: &Project, parent: &Path) -> Self {
        let project = copy(fresh, &parent.join("p"));
        call(&mut run(&project, &[])).expect(0);
        Self {
            results: results(&project),
            told: told(parent),
            artifacts: artifacts(&project),
            project,
        }
    }

    /// Holds a broken run's project, done at last, against the unbroken one's.
    fn is_met_by(&self, broken: &Project) {
        for pair in pairs(broken) {
            assert_eq!(pair.results.status, JobStatus::Done);
        }
        assert_eq!(results(broken), self.results);
        assert_eq!(finished(broken), finished(&self.project));
        assert!(finished(broken).iter().all(|times| *times == 1));
        assert_eq!(artifacts(broken), self.artifacts);
        let told = told(broken.dir().parent().expect("a folder"));
        let names = |told: &BTreeMap<PathBuf, Vec<u8>>| told.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&told), names(&self.told));
        for (path, bytes) in &told {
            assert!(*bytes == self.told[path], "{} differs", path.display());
        }
    }
}

/// Starts the run again and again and kills it after 50 to 500 ms, until one ends by itself; says how often it was
/// killed.
fn run_under_fire(project: &Project, dice: &mut ChaCha8Rng) -> u32 {
    for kills in 0.. {
        let jobs = if dice.random_bool(0.5) { "1" } else { "2" };
        let mut child = run(project, &["-j", jobs])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary starts");
        let shot = Instant::now() + Duration::from_millis(dice.random_range(50..=500));
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

/// Kills runs of copies of a project of so many pairs until there were so many kills.
#[expect(clippy::print_stderr, reason = "the figures of the long test")]
fn survives(count: &str, kills: u32) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let fresh = project(dir.path(), "fresh", count);
    let wanted = Wanted::of(&fresh, &dir.path().join("unbroken"));
    let mut dice = ChaCha8Rng::seed_from_u64(4);
    let (mut done, mut copies) = (0, 0);
    while done < kills {
        let parent = dir.path().join(format!("broken-{copies}"));
        let broken = copy(&fresh, &parent.join("p"));
        done += run_under_fire(&broken, &mut dice);
        copies += 1;
        wanted.is_met_by(&broken);
        std::fs::remove_dir_all(parent).expect("removed");
    }
    eprintln!("{done} kills over {count} pairs, run to the end {copies} times");
}

#[test]
fn twenty_kills_lose_nothing_and_double_nothing() {
    survives("8", 20);
}

#[test]
#[ignore = "takes minutes: cargo test --test it hundreds_of_kills -- --ignored --nocapture"]
fn hundreds_of_kills_lose_nothing_and_double_nothing() {
    survives("200", 300);
}
