//! Pairs that kill their process, hang, or need too much memory, and runs in which too many pairs fail.

use std::process::Stdio;

use mocban::domain::{FailureClass, JobStatus};
use mocban::mesh::write::MeshFormat;
use mocban::mesh::{self, MeshLimits};
use mocban::store::Project;

use crate::cli::{call, mocban, shell};
use crate::crowd::watched;
use crate::resume::{attempts, pairs, project, run};
use crate::small_block::{demo_block, few_labels};

fn status(project: &Project) -> Vec<JobStatus> {
    let all = pairs(project);
    all.iter().map(|pair| pair.results.status).collect()
}

/// Starts up to 10 runs, until one ends by itself. Returns the number of runs that died, and the exit code of the one
/// that ended, or `None` if all died.
fn deaths(project: &Project, jobs: &str, point: &str) -> (u32, Option<i32>) {
    for deaths in 0..10 {
        let mut command = run(project, &["-j", jobs]);
        let ended = command
            .env("MOCBAN_BREAK_AT", point)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if let Some(code) = ended.expect("the binary starts").code() {
            return (deaths, Some(code));
        }
    }
    (10, None)
}

#[test]
fn a_pair_that_kills_its_process_three_times_is_quarantined_and_the_others_finish() {
    for jobs in ["1", "2"] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = project(dir.path(), "p", "3");
        let (deaths, code) = deaths(&project, jobs, "fit:computed@upright-0001");
        // The first death may count against two pairs, because another pair was running or was not stored yet.
        assert!((3..=4).contains(&deaths), "{deaths} deaths");
        assert_eq!(code, Some(3));
        let all = pairs(&project);
        let statuses: Vec<_> = all.iter().map(|pair| pair.results.status).collect();
        assert_eq!(
            statuses,
            [JobStatus::Done, JobStatus::Quarantined, JobStatus::Done]
        );
        let failure = all[1].results.failure.as_ref().expect("a failure");
        assert_eq!(failure.failure.class, FailureClass::Resource);
        assert_eq!(
            failure.failure.message,
            "3 workers died or hung over it at fit"
        );

        // The pair stays quarantined until a retry or a change of its mesh.
        call(&mut run(&project, &[])).expect(3);
        let mesh = project.input_path(&all[1].results.attributes.mesh_path);
        let mut bytes = std::fs::read(&mesh).expect("a mesh");
        bytes.push(b'\n');
        std::fs::write(&mesh, bytes).expect("written");
        call(&mut run(&project, &[])).expect(0);
        assert_eq!(attempts(&project), [1; 12]);
    }
}

#[test]
fn a_stage_that_times_out_is_retried_exclusively_then_quarantined() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "2");
    let file = dir.path().join("held");
    // The limit is longer than the stages of the other pair take on a busy machine.
    let mut command = run(&project, &["-j", "2", "--set", "run.stage_timeout_s=20"]);
    command
        .env("MOCBAN_HOLD_AT", "fit:computed:0@upright-0000")
        .env("MOCBAN_HOLD_FILE", &file);
    call(&mut command).expect(3);
    assert_eq!(status(&project), [JobStatus::Quarantined, JobStatus::Done]);
    let failure = pairs(&project)[0]
        .results
        .failure
        .clone()
        .expect("a failure");
    assert_eq!(failure.failure.class, FailureClass::Resource);
    assert_eq!(failure.failure.message, "fit took longer than 20 s");
    let attempts = &pairs(&project)[0].attempts;
    assert_eq!(attempts.len(), 2);
}

#[test]
fn too_many_failures_end_the_run_and_show_in_the_exit_code() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "4");
    for pair in &pairs(&project)[..3] {
        let print = project.input_path(&pair.results.attributes.print_path);
        std::fs::write(print, b"no picture").expect("written");
    }
    let args = ["-j", "1", "--json", "--max-failures", "2"];
    let ended = call(&mut run(&project, &args)).expect(3);
    let summary = ended.json();
    assert_eq!(
        (&summary["too_many_failures"], &summary["failed"]),
        (&true.into(), &2.into())
    );
    let bad = JobStatus::Quarantined;
    assert_eq!(
        status(&project),
        [bad, bad, JobStatus::Ready, JobStatus::Ready]
    );
    // A bad pair does not stop the others, but shows in the exit code.
    let ended = call(&mut run(&project, &["--json"])).expect(3).json();
    assert_eq!(
        (&ended["done"], &ended["failed_in_all"]),
        (&1.into(), &3.into())
    );
}

#[test]
fn a_stage_that_panics_fails_its_pair_and_shows_a_backtrace_only_with_verbose() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "2");
    let panics = |args: &[&str]| {
        let mut command = run(&project, args);
        command.env("MOCBAN_PANIC_AT", "depth:computed:0@upright-0000");
        call(&mut command).expect(3)
    };
    let plain = panics(&[]);
    let verbose = panics(&["--rerun", "failed", "-v"]);
    assert_eq!(status(&project), [JobStatus::Quarantined, JobStatus::Done]);
    let failed = pairs(&project)[0].results.failure.clone();
    let failure = failed.expect("a failure").failure;
    assert_eq!(failure.class, FailureClass::Bug);
    let expected = "the stage panicked (requested by a test): this is a bug, please report it with the output of \
        `run --rerun failed -v`";
    assert_eq!(failure.message, expected);
    for text in ["thread '", "RUST_BACKTRACE", "failpoint.rs"] {
        assert!(!plain.err.contains(text), "{}", plain.err);
    }
    assert!(verbose.err.contains("failpoint.rs"), "{}", verbose.err);
}

#[test]
fn pairs_larger_than_the_memory_limit_run_one_at_a_time() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "2");
    let small = call(&mut run(&project, &["-j", "2", "--memory", "1M"])).expect(0);
    for pair in &pairs(&project) {
        let needs = format!("{} may need ", pair.results.attributes.name);
        let warning = small.err.split_once(&needs).map(|(_, rest)| rest);
        let (mib, rest) = warning
            .and_then(|rest| rest.split_once(" MiB, "))
            .unwrap_or_else(|| panic!("{}", small.err));
        assert!(mib.parse::<u64>().is_ok_and(|mib| mib >= 32), "{mib}");
        let reason = "more than the 1 MiB of --memory: it runs with no other pair beside it\n";
        assert!(rest.starts_with(reason), "{rest}");
    }
    assert_eq!(small.err.matches("of --memory").count(), 2);
    assert_eq!(attempts(&project), [1; 8]);
    assert!(pairs(&project).iter().all(|pair| pair.attempt == 1));
    let refused = call(&mut run(&project, &["--memory", "much"])).expect(2);
    assert!(refused.err.contains("such as 4G"), "{}", refused.err);
}

/// `SQLite` reports only that it cannot open a file.
#[test]
fn a_low_limit_of_open_files_is_named_as_the_reason() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "1");
    let mut failed = 0;
    for limit in [6, 7, 8, 10, 12, 14, 16, 18, 20, 22] {
        let command = run(&project, &["--rerun", "all"]);
        let mut script = shell(&format!("ulimit -n {limit}; exec \"$@\""));
        script.arg("sh").arg(command.get_program());
        let ended = call(script.args(command.get_args()));
        let is_named = ended.err.contains("ulimit -n");
        assert!(ended.code == 0 || is_named, "{limit}: {}", ended.err);
        failed += usize::from(ended.code != 0);
    }
    assert!(failed > 3, "{failed}");
}

#[test]
fn a_vertex_far_away_neither_ends_the_run_of_a_block_nor_takes_its_memory() {
    const LIMIT_MIB: u64 = 1024;
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    demo_block(dir);
    few_labels(dir, &dir.join("few.json"));
    let bytes = std::fs::read(dir.join("d/data/block.ply")).expect("a scan");
    let mut mesh = mesh::read(&bytes, "block.ply", &MeshLimits::SUGGESTED).expect("a mesh");
    let middle = mesh.vertices.len() / 2;
    mesh.vertices.set(middle, [1e8, -1e9, 1e7]);
    let stray = MeshFormat::PlyLittleEndian.encode(&mesh);
    std::fs::write(dir.join("stray.ply"), stray).expect("written");
    let import = "-C p import --block stray.ply --page d/data/page.jpg --labels few.json --name b1";
    mocban(dir, &import.split(' ').collect::<Vec<_>>()).expect(0);
    let (ended, kib) = watched(dir, &["-C", "p", "-q", "run", "--memory", "1G"]);
    ended.expect(0);
    let status = mocban(dir, &["-C", "p", "status", "--json"])
        .expect(0)
        .json();
    assert_eq!(status["blocks"]["jobs"]["done"], 1, "{status}");
    assert!(kib >> 10 < LIMIT_MIB, "{} MiB", kib >> 10);
}
