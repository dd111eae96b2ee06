//! The binary is killed at every failpoint and run again. No stage is stored twice or lost, and the results are the
//! same. Other modules use the helpers of this file to run projects and to read results.

use std::path::Path;
use std::process::{Command, Stdio};

use mocban::catalog::{Catalog, Fingerprints, PairDetail};
use mocban::domain::{JobStatus, Stage};
use mocban::store::Project;

use crate::cli::{binary, call, mocban};
use crate::made_once::{copy_folder, copy_of};

/// Small depth maps, because these tests are not about the alignment.
const SMALL_DEPTH: [&str; 2] = ["--set", "depth.longest_px=96"];
/// A run with small depth maps. Other settings would compute all pairs of a project that ran with these again.
pub(crate) const RUN_SMALL: [&str; 4] = ["run", "-q", SMALL_DEPTH[0], SMALL_DEPTH[1]];

/// Every failpoint from the claim to the commit, ordered so that work on six pairs reaches each one. If a stage is
/// given, it is completed first, so that the next stage is claimed and stored by itself. Failpoints at file writes come
/// early, because existing files are not written again.
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

/// Creates a demo project whose pairs have not run. All tests copy the same project of each number of pairs.
pub(crate) fn project(dir: &Path, name: &str, pairs: &str) -> Project {
    let to = dir.join(name);
    copy_of(&format!("{pairs} pairs of the demo"), &to, |made| {
        mocban(made, &["demo", ".", "--pairs", pairs, "--no-run"]).expect(0);
    });
    Project::open(&to).expect("a project")
}

/// Copies a project to another folder.
pub(crate) fn copy(project: &Project, to: &Path) -> Project {
    copy_folder(project.dir(), to);
    Project::open(to).expect("a project")
}

/// Returns the command `run` with these arguments.
pub(crate) fn run(project: &Project, args: &[&str]) -> Command {
    run_with_progress(project, "none", args)
}

/// Like [`run`], with progress in this format on stderr.
pub(crate) fn run_with_progress(project: &Project, progress: &str, args: &[&str]) -> Command {
    let mut command = binary();
    command.arg("-C").arg(project.dir());
    command
        .args(["--progress", progress, "run"])
        .args(SMALL_DEPTH)
        .args(args);
    command
}

/// Returns every pair as stored, after checking the counters.
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
        let counters = catalog.counters().await.expect("counters");
        assert_eq!(counters, catalog.recount().await.expect("a recount"));
        catalog.close().await;
        found
    })
}

/// Returns the results without times as lines of numbers, files and hashes. Checks each artifact against its hash.
pub(crate) fn results(project: &Project) -> Vec<String> {
    let mut lines = Vec::new();
    for pair in pairs(project) {
        let results = pair.results;
        assert_eq!(results.status, JobStatus::Done, "{:?}", results.failure);
        for stage in &results.stages {
            for artifact in stage.files.values() {
                project
                    .read_artifact(artifact)
                    .expect("an unchanged artifact");
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

/// Returns how many artifacts are left under temporary names.
fn temporary_files(project: &Project) -> usize {
    let temporary = project.artifacts_dir().join("tmp");
    std::fs::read_dir(temporary).map_or(0, Iterator::count)
}

/// Returns how many successful attempts each stage of each pair has.
pub(crate) fn attempts(project: &Project) -> Vec<usize> {
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

/// Returns how many stages of all pairs are completed. A run may be in progress.
pub(crate) fn stages_done(project: &Project) -> u64 {
    let done = Stage::ALL.map(|stage| pairs_done(project, stage));
    done.iter().sum()
}

/// Returns how many pairs have completed `stage`. A run may be in progress.
pub(crate) fn pairs_done(project: &Project, stage: Stage) -> u64 {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let path = project.catalog_path();
        let catalog = Catalog::open_read_only(&path).await.expect("a catalog");
        let fingerprints = Fingerprints::new(|_| serde_json::Value::Null);
        let status = catalog.status(&fingerprints).await.expect("a status");
        status.stages[&stage].done
    })
}

#[test]
fn a_run_killed_at_every_failpoint_and_resumed_gives_the_results_of_an_uninterrupted_one() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uninterrupted = project(dir.path(), "uninterrupted", "6");
    let broken = copy(&uninterrupted, &dir.path().join("broken"));
    let killed = copy(&uninterrupted, &dir.path().join("killed"));
    call(&mut run(&uninterrupted, &[])).expect(0);
    let expected = results(&uninterrupted);

    for (point, until) in POINTS {
        if let Some(until) = until {
            call(&mut run(&broken, &["--stage", until])).expect(0);
        }
        let died = run(&broken, &["-j", "1"])
            .env("MOCBAN_BREAK_AT", point)
            .output();
        let died = died.expect("the binary starts");
        assert_eq!(died.status.code(), None, "{point} was not reached");
        // Each of six pairs may have had the files of a stage, at most ten, that were being written together.
        let least = usize::from(point.contains(":written"));
        let left = temporary_files(&broken);
        assert!((least..=60).contains(&left), "{point}: {left}");
    }
    call(&mut run(&broken, &[])).expect(0);
    assert_eq!(temporary_files(&broken), 0);
    assert_eq!(results(&broken), expected);
    assert_eq!(attempts(&broken), [1; 24]);

    let mut child = run(&killed, &[])
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    crate::waiting::until(&mut child, || stages_done(&killed) >= 2);
    child.kill().expect("killed");
    child.wait().expect("dead");
    call(&mut run(&killed, &["-j", "1"])).expect(0);
    assert_eq!(results(&killed), expected);
    assert_eq!(attempts(&killed), [1; 24]);
}

#[test]
fn stages_are_computed_while_files_of_earlier_stages_are_written() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let broken = project(dir.path(), "broken", "1");
    // The file of the depth map is never finished, so `register` is reached only if no stage waits for that file.
    let died = run(&broken, &["-j", "1"])
        .env("MOCBAN_HOLD_AT", "depth:written")
        .env("MOCBAN_HOLD_FILE", dir.path().join("held"))
        .env("MOCBAN_BREAK_AT", "register:computed")
        .output()
        .expect("the binary starts");
    assert_eq!(died.status.code(), None);
    assert!(
        stages_done(&broken) <= 1,
        "a row names a file that is not on the disk"
    );
    call(&mut run(&broken, &[])).expect(0);
    assert_eq!(attempts(&broken), [1; 4]);
}
