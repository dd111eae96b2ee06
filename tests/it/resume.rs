//! The real binary, killed and run again: nothing is computed twice, nothing is lost, the results are the same.

use std::path::Path;
use std::process::{Command, Stdio};

use mocban::catalog::{Catalog, Fingerprints, PairDetail};
use mocban::domain::{JobStatus, Stage};
use mocban::store::Project;

use crate::cli::{binary, call, mocban};

/// Small depth maps: what is tested is not the alignment.
const FAST: [&str; 2] = ["--set", "depth.longest_px=96"];

/// Every named point between claim, artifact, row and commit, in an order in which six pairs come by, and the last stage
/// of a run that goes to its end before. What is done together is stored together: where a stage is to be claimed by
/// itself, all before it are done first. A file that is there is not written again, so the points that need one come
/// early, the second depth map before any other.
const POINTS: [(&str, Option<&str>); 14] = [
    ("fit:claiming", None),
    ("fit:claimed", None),
    ("fit:computed", None),
    ("depth:written:2", None),
    ("register:written", None),
    ("fit:synced:2", None),
    ("depth:recorded", None),
    ("depth:committed", None),
    ("normalize:claiming", Some("depth")),
    ("normalize:computed", None),
    ("normalize:committed", None),
    ("register:claimed", Some("normalize")),
    ("register:recorded", None),
    ("register:committed", None),
];

/// Makes a demo project of some pairs that have not run.
pub(crate) fn project(dir: &Path, name: &str, pairs: &str) -> Project {
    mocban(dir, &["demo", name, "--pairs", pairs, "--no-run"]).expect(0);
    Project::open(&dir.join(name)).expect("a project")
}

/// The same project again in another folder.
pub(crate) fn copy(project: &Project, to: &Path) -> Project {
    copy_folder(project.dir(), to);
    Project::open(to).expect("a project")
}

/// A folder again with all below it.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    let mut open = vec![(from.to_owned(), to.to_owned())];
    while let Some((from, to)) = open.pop() {
        std::fs::create_dir_all(&to).expect("a folder");
        for entry in std::fs::read_dir(from).expect("a folder") {
            let from = entry.expect("an entry").path();
            let to = to.join(from.file_name().expect("a name"));
            if from.is_dir() {
                open.push((from, to));
            } else {
                std::fs::copy(from, to).expect("copied");
            }
        }
    }
}

/// `run` with some arguments, ready to be called.
pub(crate) fn run(project: &Project, args: &[&str]) -> Command {
    run_telling(project, "none", args)
}

/// The same with progress in some form on stderr.
pub(crate) fn run_telling(project: &Project, progress: &str, args: &[&str]) -> Command {
    let mut command = binary();
    command.arg("-C").arg(project.dir());
    command
        .args(["--progress", progress, "run"])
        .args(FAST)
        .args(args);
    command
}

/// Every pair as stored.
pub(crate) fn pairs(project: &Project) -> Vec<PairDetail> {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let path = project.catalog_path();
        let catalog = Catalog::open_read_only(&path).await.expect("a catalog");
        let mut found = Vec::new();
        for name in catalog.pair_names().await.expect("names") {
            let detail = catalog.pair(&name).await.expect("a read");
            found.push(detail.expect("the pair"));
        }
        let kept = catalog.counters().await.expect("counters");
        assert_eq!(kept, catalog.recount().await.expect("a recount"));
        catalog.close().await;
        found
    })
}

/// All that a result is, without times: numbers, files, hashes.
pub(crate) fn results(project: &Project) -> Vec<String> {
    let mut lines = Vec::new();
    for pair in pairs(project) {
        let results = pair.results;
        assert_eq!(results.status, JobStatus::Done, "{:?}", results.failure);
        for stage in &results.stages {
            for artifact in stage.files.values() {
                project
                    .read_artifact(artifact)
                    .expect("the artifact is whole");
            }
            let (outcome, hash) = (&stage.outcome, stage.result_hash);
            let files = &stage.files;
            lines.push(format!(
                "{} {} {hash:?} {outcome} {files:?}",
                results.attributes.name, stage.stage
            ));
        }
        for metric in &results.metrics {
            lines.push(format!(
                "{} {:?}",
                results.attributes.name, metric.result_hash
            ));
        }
    }
    lines
}

/// How many files of results are written and have not got their names.
fn half_placed(project: &Project) -> usize {
    let temporary = project.artifacts_dir().join("tmp");
    std::fs::read_dir(temporary).map_or(0, Iterator::count)
}

/// How often each stage of each pair was finished.
pub(crate) fn finished(project: &Project) -> Vec<usize> {
    let mut counts = Vec::new();
    for pair in pairs(project) {
        for stage in Stage::ALL {
            let done = pair.attempts.iter();
            let done = done.filter(|attempt| attempt.stage == stage && attempt.failure.is_none());
            counts.push(done.count());
        }
    }
    counts
}

/// Stages that are done, all pairs together, by a reader beside the run.
pub(crate) fn stages_done(project: &Project) -> u64 {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let path = project.catalog_path();
        let catalog = Catalog::open_read_only(&path).await.expect("a catalog");
        let fingerprints = Fingerprints::new(|_| serde_json::Value::Null);
        let status = catalog.status(&fingerprints).await.expect("a status");
        status.stages.values().map(|stage| stage.done).sum()
    })
}

#[test]
fn a_run_that_dies_anywhere_and_goes_on_gives_what_an_unbroken_one_gives() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let unbroken = project(dir.path(), "unbroken", "6");
    let broken = copy(&unbroken, &dir.path().join("broken"));
    let killed = copy(&unbroken, &dir.path().join("killed"));
    call(&mut run(&unbroken, &[])).expect(0);
    let wanted = results(&unbroken);

    for (point, until) in POINTS {
        if let Some(until) = until {
            call(&mut run(&broken, &["--stage", until])).expect(0);
        }
        let died = run(&broken, &["-j", "1"])
            .env("MOCBAN_BREAK_AT", point)
            .output();
        let died = died.expect("the binary starts");
        assert_eq!(died.status.code(), None, "{point} was not reached");
        // A file of each pair may have been on its way to the disk meanwhile.
        let least = usize::from(point.contains(":written"));
        assert!((least..=6).contains(&half_placed(&broken)), "{point}");
    }
    call(&mut run(&broken, &[])).expect(0);
    assert_eq!(half_placed(&broken), 0);
    assert_eq!(results(&broken), wanted);
    assert_eq!(finished(&broken), [1; 24]);

    let mut child = run(&killed, &[])
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    while stages_done(&killed) < 2 {
        let ended = child.try_wait().expect("a child that can be asked");
        assert!(
            ended.is_none(),
            "the run ended before it was killed: {ended:?}"
        );
        std::thread::yield_now();
    }
    child.kill().expect("killed");
    child.wait().expect("dead");
    call(&mut run(&killed, &["-j", "1"])).expect(0);
    assert_eq!(results(&killed), wanted);
    assert_eq!(finished(&killed), [1; 24]);
}

#[test]
fn stages_are_computed_while_files_of_those_before_are_on_their_way() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let broken = project(dir.path(), "broken", "1");
    // It would wait for ever for the depth map's file if the stages after it did.
    let died = run(&broken, &["-j", "1"])
        .env("MOCBAN_HOLD_AT", "depth:written")
        .env("MOCBAN_HOLD_FILE", dir.path().join("held"))
        .env("MOCBAN_BREAK_AT", "register:computed")
        .output()
        .expect("the binary starts");
    assert_eq!(died.status.code(), None);
    assert!(stages_done(&broken) <= 1, "a row names what is not on disk");
    call(&mut run(&broken, &[])).expect(0);
    assert_eq!(finished(&broken), [1; 4]);
}
