//! The job queue through the real binary: changed files and settings, missing files, and two processes.

use std::io::Write as _;
use std::path::PathBuf;

use mocban::domain::{FailureClass, JobStatus, Stage};
use mocban::store::{Project, RunLock};

use crate::cli::{call, mocban};
use crate::resume::{pairs, project, run};

/// Returns how often each stage of each pair was finished.
fn finished(project: &Project) -> Vec<[usize; 4]> {
    let of = |pair: &mocban::catalog::PairDetail| {
        Stage::ALL.map(|stage| {
            let done = pair.attempts.iter();
            done.filter(|attempt| attempt.stage == stage && attempt.failure.is_none())
                .count()
        })
    };
    pairs(project).iter().map(of).collect()
}

fn mesh(project: &Project, index: usize) -> PathBuf {
    project.input_path(&pairs(project)[index].results.attributes.mesh_path)
}

fn print(project: &Project, index: usize) -> PathBuf {
    project.input_path(&pairs(project)[index].results.attributes.print_path)
}

/// Appends a byte. That changes the file's hash, but not the decoded mesh or image.
fn append_byte(path: &std::path::Path) {
    let mut file = std::fs::OpenOptions::new()
        .append(true)
        .open(path)
        .expect("a file");
    file.write_all(b"\n").expect("written");
}

#[test]
fn only_affected_stages_run_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "2");
    let away = print(&project, 1).with_extension("away");
    std::fs::rename(print(&project, 1), &away).expect("moved");
    call(&mut run(&project, &[])).expect(3);
    let failed = &pairs(&project)[1].results;
    let failure = failed.failure.as_ref().expect("a failure");
    assert_eq!(failure.failure.class, FailureClass::Io);
    assert!(failure.failure.message.ends_with("is not there"));

    // The file was added: the failed pair runs.
    std::fs::rename(&away, print(&project, 1)).expect("moved");
    call(&mut run(&project, &["--rerun", "failed"])).expect(0);
    assert_eq!(finished(&project), [[1; 4]; 2]);
    let before: Vec<_> = pairs(&project)
        .into_iter()
        .map(|pair| pair.results.metrics)
        .collect();

    // A new modification time alone changes nothing.
    let file = std::fs::File::options().write(true).open(mesh(&project, 0));
    let now = std::time::SystemTime::now();
    file.expect("a file").set_modified(now).expect("touched");
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(finished(&project), [[1; 4]; 2]);

    // New content affects that pair only.
    let name = pairs(&project)[0].results.attributes.name.clone();
    let changed = || {
        let shown = mocban(project.dir(), &["show", name.as_str(), "--json"]).expect(0);
        shown.json()["changed_inputs"].clone()
    };
    assert_eq!(changed(), serde_json::json!([]));
    append_byte(&print(&project, 0));
    assert_eq!(changed(), serde_json::json!(["print"]));
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(finished(&project), [[2; 4], [1; 4]]);
    assert_eq!(changed(), serde_json::json!([]));

    // A setting of the last stage affects no other stage.
    let mut changed = run(&project, &[]);
    changed.args(["--set", "register.smoothing_px=1.5"]);
    call(&mut changed).expect(0);
    assert_eq!(finished(&project), [[2, 2, 2, 3], [1, 1, 1, 2]]);
    call(&mut run(&project, &[])).expect(0);
    let after: Vec<_> = pairs(&project)
        .into_iter()
        .map(|pair| pair.results.metrics)
        .collect();
    assert_eq!(before, after);
}

#[test]
fn a_pair_whose_missing_file_is_back_runs_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "2");
    let files = [mesh(&project, 0), print(&project, 1)];
    for file in &files {
        std::fs::rename(file, file.with_extension("away")).expect("moved");
    }
    std::fs::create_dir(&files[1]).expect("a folder in place of a file");
    for _ in 0..2 {
        call(&mut run(&project, &[])).expect(3);
    }
    let attempts = pairs(&project)
        .iter()
        .map(|pair| pair.attempts.len())
        .sum::<usize>();
    assert_eq!(attempts, 2, "what is still missing is not tried again");
    let status = mocban(project.dir(), &["status", "--json"])
        .expect(0)
        .json();
    assert_eq!(status["missing_inputs"], serde_json::Value::Null);
    std::fs::remove_dir(&files[1]).expect("removed");
    for file in &files {
        std::fs::rename(file.with_extension("away"), file).expect("moved back");
    }
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(finished(&project), [[1; 4]; 2]);
}

#[test]
fn done_stages_are_kept_while_a_file_is_missing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "1");
    call(&mut run(&project, &["--stage", "depth"])).expect(0);
    let away = print(&project, 0).with_extension("away");
    std::fs::rename(print(&project, 0), &away).expect("moved");
    std::fs::rename(mesh(&project, 0), mesh(&project, 0).with_extension("away")).expect("moved");
    for is_retried in [false, false, true] {
        if is_retried {
            mocban(project.dir(), &["retry"]).expect(0);
        }
        call(&mut run(&project, &[])).expect(3);
    }
    assert_eq!(finished(&project), [[1, 1, 0, 0]]);
    std::fs::rename(away, print(&project, 0)).expect("moved back");
    std::fs::rename(mesh(&project, 0).with_extension("away"), mesh(&project, 0)).expect("moved");
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(finished(&project), [[1; 4]]);
}

#[test]
fn a_project_in_use_is_refused_with_the_process_id() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "1");
    let lock = RunLock::acquire(&project, false).expect("the lock");
    let refused = call(&mut run(&project, &[])).expect(11);
    let me = format!("pid {}", std::process::id());
    assert!(refused.err.contains(&me), "{}", refused.err);
    assert_eq!(pairs(&project)[0].results.status, JobStatus::Ready);
    drop(lock);
}
