//! `check` and `check --repair` through the real binary. Damage is found and repaired, and the results are the same.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mocban::domain::Stage;
use mocban::store::{Project, RunLock};
use serde_json::Value;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions as _, Connection as _};

use crate::cli::{Call, mocban};
use crate::made_once::copy_of;
use crate::resume::pairs;

/// Copies a demo project of two small pairs, run and judged.
pub(crate) fn done(dir: &Path) -> Project {
    copy_of("a demo that was run and judged", dir, |dir| {
        let demo = ["demo", "p", "--pairs", "2", "--no-run"];
        let small = ["--set", "depth.longest_px=96"];
        mocban(dir, &[&demo[..], &small].concat()).expect(0);
        let project = Project::open(&dir.join("p")).expect("a project");
        at(&project, &["run"]).expect(0);
        let set = [
            "verdict",
            "set",
            "upright-0000",
            "pass",
            "--reviewer",
            "lan",
        ];
        at(&project, &set).expect(0);
    });
    Project::open(&dir.join("p")).expect("a project")
}

/// Calls the binary on a project.
pub(crate) fn at(project: &Project, args: &[&str]) -> Call {
    let dir = project.dir().to_str().expect("UTF-8");
    let quiet = ["-C", dir, "--progress", "none"];
    mocban(project.dir(), &[&quiet[..], args].concat())
}

/// Changes the catalog directly, without the program.
pub(crate) fn sql(project: &Project, statements: &str) {
    let options = SqliteConnectOptions::new().filename(project.catalog_path());
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let mut conn = options
            .foreign_keys(false)
            .connect()
            .await
            .expect("a connection");
        sqlx::raw_sql(sqlx::AssertSqlSafe(statements.to_owned()))
            .execute(&mut conn)
            .await
            .expect("run");
        conn.close().await.expect("closed");
    });
}

/// Exports and returns every file with its bytes.
pub(crate) fn exported(project: &Project, name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let root = project.dir().with_file_name(name);
    at(project, &["export", "-o", root.to_str().expect("UTF-8")]).expect(0);
    below(&root)
}

/// Returns every file below a directory with its bytes.
pub(crate) fn below(root: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let (mut open, mut files) = (vec![root.to_owned()], Vec::new());
    while let Some(dir) = open.pop() {
        for entry in std::fs::read_dir(dir).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let below = path.strip_prefix(root).expect("below").to_owned();
                files.push((below, std::fs::read(path).expect("read")));
            }
        }
    }
    files.sort();
    assert!(files.len() > 10);
    files
}

/// Counts how often each stage of a pair was finished.
fn finished(project: &Project, pair: usize) -> [usize; 4] {
    let found = &pairs(project)[pair];
    Stage::ALL.map(|stage| {
        let done = found.attempts.iter();
        done.filter(|attempt| attempt.stage == stage && attempt.failure.is_none())
            .count()
    })
}

/// Returns the path of a pair's artifact.
pub(crate) fn artifact(project: &Project, pair: usize, stage: Stage, role: &str) -> PathBuf {
    let found = &pairs(project)[pair].results;
    let record = found.stage(stage).expect("a result");
    project.artifact_path(&record.files[role])
}

/// Returns the kinds of damage in a report.
pub(crate) fn kinds(report: &Value) -> BTreeSet<String> {
    let damage = report["damage"].as_object().expect("an object");
    damage.keys().cloned().collect()
}

fn verdicts(project: &Project) -> String {
    at(project, &["verdict", "log", "--json"]).expect(0).out
}

#[test]
fn missing_and_changed_files_are_found_and_their_stages_run_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let (before, said) = (exported(&project, "before"), verdicts(&project));
    let sound = at(&project, &["check"]).expect(0);
    assert!(sound.out.contains("no problems found"), "{}", sound.out);

    let missing = artifact(&project, 0, Stage::Depth, "depth.png");
    let changed = artifact(&project, 1, Stage::Register, "canvas_print_mask.png");
    std::fs::remove_file(&missing).expect("removed");
    let mut bytes = std::fs::read(&changed).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&changed, bytes).expect("written");

    // Checking changes nothing, however often.
    for _ in 0..2 {
        let found = at(&project, &["check"]).expect(12);
        for path in [&missing, &changed] {
            let path = path.to_str().expect("UTF-8");
            assert!(found.out.contains(path), "{path}: {}", found.out);
        }
        assert!(found.next()[0].ends_with("check --repair"));
    }
    // A change that keeps the length is found only by reading every byte.
    let quick = at(&project, &["check", "--quick", "--json"])
        .expect(12)
        .json();
    assert_eq!(kinds(&quick), ["file_missing".to_owned()].into());

    let repaired = at(&project, &["check", "--repair", "--json"])
        .expect(0)
        .json();
    assert_eq!(repaired["repaired"]["requeued"], 2);
    at(&project, &["check"]).expect(0);
    at(&project, &["run"]).expect(0);
    assert_eq!(finished(&project, 0), [1, 2, 2, 2]);
    assert_eq!(finished(&project, 1), [1, 1, 1, 2]);
    assert!(exported(&project, "after") == before, "another export");
    assert_eq!(verdicts(&project), said);
    at(&project, &["check"]).expect(0);
}

#[test]
fn rows_and_counters_that_disagree_are_found_and_repaired() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let (before, said) = (exported(&project, "before"), verdicts(&project));
    let cases = [
        (
            "counter",
            "UPDATE counter SET n = n + 1 WHERE stage = 0 AND status = 0",
        ),
        ("counter", "DELETE FROM counter WHERE n = 0"),
        // Counters by fingerprint, fingerprints of jobs and dirty marks.
        (
            "counter",
            "UPDATE counter SET n = n + 1 WHERE stage = 4 AND status = 3",
        ),
        ("counter", "DELETE FROM counter WHERE fingerprint <> 0"),
        (
            "counter",
            "UPDATE job SET fingerprint = (SELECT min(id) FROM fingerprint) WHERE pair = 1",
        ),
        (
            "counter",
            "UPDATE pair SET mesh_hash = zeroblob(32) WHERE id = 1; UPDATE job SET dirty = 0",
        ),
        (
            "result_missing",
            "DELETE FROM stage_result WHERE pair = 1 AND stage = 1",
        ),
        (
            "result_changed",
            "UPDATE stage_result SET outcome = replace(outcome, '1', '2') WHERE pair = 2 AND stage = 2",
        ),
        (
            "metrics",
            "DELETE FROM metric_result WHERE pair = 2 AND metric = 'ensemble'",
        ),
        (
            "metrics",
            "UPDATE metric_result SET result_hash = zeroblob(32) WHERE pair = 1 AND metric = 'relief'",
        ),
        ("schema", "DROP TRIGGER verdict_no_delete"),
        ("schema", "DROP INDEX job_ready"),
        // A pair without a job, and one that failed without a reason.
        (
            "job_missing",
            "DELETE FROM job WHERE pair = 1;
            UPDATE counter SET n = 1 WHERE stage = 4 AND status = 3",
        ),
        (
            "reason_missing",
            "UPDATE job SET stage = 3, status = 4, fingerprint = (SELECT fingerprint FROM stage_result WHERE pair = 2 AND stage = 2)
            WHERE pair = 2;
            UPDATE counter SET n = 1 WHERE (stage, status) IN ((4, 3), (3, 4))",
        ),
    ];
    for (kind, statements) in cases {
        sql(&project, statements);
        let found = at(&project, &["check", "--json"]).expect(12).json();
        assert_eq!(kinds(&found), [kind.to_owned()].into(), "{statements}");
        let repaired = at(&project, &["check", "--repair", "--json"])
            .expect(0)
            .json();
        assert_eq!(repaired["damage"][kind]["left"], 0, "{statements}");
        at(&project, &["check"]).expect(0);
        at(&project, &["run"]).expect(0);
    }
    assert!(exported(&project, "after") == before, "another export");
    assert_eq!(verdicts(&project), said);
}

#[test]
fn indexes_that_disagree_with_their_tables_are_rebuilt() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    // Changes the condition of the index of ready jobs, makes all jobs ready, and restores the condition. The index
    // then lacks these jobs.
    let redefine = |from: &str, to: &str| {
        format!(
            "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'status = {from}', 'status = {to}')
            WHERE name = 'job_ready'"
        )
    };
    sql(&project, &redefine("0", "5"));
    sql(
        &project,
        "UPDATE job SET stage = 0, status = 0, fingerprint = NULL; UPDATE counter SET n = 2 WHERE stage = 0 AND status = 0;
        UPDATE counter SET n = 0 WHERE stage = 4 AND status = 3",
    );
    sql(&project, &redefine("5", "0"));
    let found = at(&project, &["check", "--json"]).expect(12).json();
    assert_eq!(kinds(&found), ["database".to_owned()].into());
    let repaired = at(&project, &["check", "--repair", "--json"])
        .expect(0)
        .json();
    assert_eq!(repaired["repaired"]["indexes"], true);
    at(&project, &["run"]).expect(0);
    assert_eq!(finished(&project, 0), [2; 4]);
}

#[test]
fn damaged_database_is_not_written_to() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    sql(
        &project,
        "PRAGMA ignore_check_constraints = ON; UPDATE job SET crashes = -1 WHERE pair = 1;
        UPDATE counter SET n = n + 1 WHERE stage = 0 AND status = 0",
    );
    let before = std::fs::read(project.catalog_path()).expect("read");
    let found = at(&project, &["check", "--repair", "--json"])
        .expect(12)
        .json();
    let wanted = ["counter", "database"].map(ToOwned::to_owned);
    assert_eq!(kinds(&found), wanted.into());
    let after = std::fs::read(project.catalog_path()).expect("read");
    assert!(after == before, "the repair wrote to it");
}

#[test]
fn rows_that_cannot_be_read_are_damage_and_left_out() {
    let cases = [
        "UPDATE pair SET character = CAST(x'ff' AS TEXT) WHERE id = 2",
        "UPDATE pair SET meta = json_array(1) WHERE id = 2",
        "DROP TRIGGER verdict_no_update; UPDATE verdict SET note = CAST(x'ff' AS TEXT)",
    ];
    for statements in cases {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = done(dir.path());
        sql(&project, statements);
        let found = at(&project, &["check"]).expect(12);
        assert!(
            found.out.contains("differs from its checksum"),
            "{statements}: {}",
            found.out
        );
        let unread = at(&project, &["export", "-o", "export"]).expect(0);
        let says = "set apart and not counted, first: row ";
        assert!(unread.err.contains(says), "{}", unread.err);
        if statements.contains("id = 2") {
            for text in [&found.out, &unread.err] {
                assert!(
                    text.contains("row 2 of the table pair (pair upright-0001)"),
                    "{text}"
                );
            }
        }
    }
}

#[test]
fn damaged_schema_is_damage_not_an_error() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let rename = "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'json_valid', 'json_vanid')";
    sql(&project, rename);
    at(&project, &["check"]).expect(12);
}

#[test]
fn unreferenced_files_are_reported_and_removed_but_no_others() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let artifacts = project.artifacts_dir();
    let orphan = "ab".repeat(32);
    std::fs::create_dir_all(artifacts.join("ab")).expect("a folder");
    std::fs::create_dir_all(artifacts.join("tmp")).expect("a folder");
    let ours = [
        artifacts.join("ab").join(format!("{orphan}.png")),
        artifacts.join("tmp/4711-0"),
    ];
    let theirs = artifacts.join("notes.txt");
    for path in ours.iter().chain([&theirs]) {
        std::fs::write(path, "spare").expect("written");
    }
    let told = at(&project, &["check", "--json"]).expect(0).json();
    assert_eq!(told["unreferenced"]["files"], 2);
    assert_eq!(told["unreferenced"]["bytes"], 10);
    assert_eq!(told["unreferenced"]["unknown"], 1);
    assert!(ours.iter().all(|path| path.exists()));
    let repaired = at(&project, &["check", "--repair", "--json"])
        .expect(0)
        .json();
    assert_eq!(repaired["unreferenced"]["removed"], 2);
    assert!(!ours.iter().any(|path| path.exists()));
    assert!(theirs.exists());
    at(&project, &["check"]).expect(0);
    exported(&project, "after");
}

#[test]
fn project_is_checked_but_not_repaired_during_a_run() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let missing = artifact(&project, 0, Stage::Depth, "depth.png");
    std::fs::remove_file(missing).expect("removed");
    let spare = project.artifacts_dir().join("tmp/4711-0");
    std::fs::create_dir_all(spare.parent().expect("a folder")).expect("made");
    std::fs::write(&spare, "half").expect("written");
    let before = std::fs::read(project.catalog_path()).expect("read");

    let mut lock = RunLock::acquire(&project, false).expect("the lock");
    lock.downgrade().expect("the lock in common");
    let found = at(&project, &["check", "--json"]).expect(12);
    assert_eq!(found.json()["unreferenced"], Value::Null);
    let refused = at(&project, &["check", "--repair"]).expect(11);
    let owner = format!("in use by pid {}", std::process::id());
    assert!(refused.err.contains(&owner), "{}", refused.err);
    // A process that joined the run still holds the project when the first process has ended.
    let joined = RunLock::acquire(&project, true).expect("joined");
    drop(lock);
    at(&project, &["check", "--repair"]).expect(11);
    drop(joined);
    assert_eq!(std::fs::read(project.catalog_path()).expect("read"), before);
    assert!(spare.exists());

    // Without the lock, both the repair and the run succeed.
    at(&project, &["check", "--repair"]).expect(0);
    assert!(!spare.exists());
    at(&project, &["run"]).expect(0);
}

#[test]
fn missing_or_changed_inputs_are_notes_not_damage() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let found = pairs(&project);
    let mesh = project.input_path(&found[0].results.attributes.mesh_path);
    let print = project.input_path(&found[1].results.attributes.print_path);
    std::fs::remove_file(&mesh).expect("removed");
    std::fs::write(&print, "another").expect("written");
    let told = at(&project, &["check"]).expect(0);
    for (path, what) in [(&mesh, "is missing"), (&print, "changed since")] {
        let line = told.out.lines().find(|line| line.contains(what));
        let line = line.unwrap_or_else(|| panic!("{what}: {}", told.out));
        assert!(line.contains(path.to_str().expect("UTF-8")), "{line}");
    }
}
