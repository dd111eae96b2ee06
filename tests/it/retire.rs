//! `retire` and `import --replace`: pairs that are in no count, and come back with all they had.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::cli::{call, mocban};
use crate::processes::Running;
use crate::resume::{project, results, run};
use crate::snapshots::assert_call;

const PAIRS: [&str; 3] = ["upright-0000", "upright-0001", "upright-0002"];

/// Numbers of pairs, verdicts and lines in all that counts pairs.
#[derive(Debug, PartialEq, Eq)]
struct ProjectCounts {
    status: [u64; 3],
    report: [u64; 4],
    names: usize,
    exported: usize,
}

fn number(value: &Value) -> u64 {
    value.as_u64().expect("a number")
}

fn counts(dir: &Path) -> ProjectCounts {
    let at = |args: &[&str]| mocban(dir, &[&["-C", "p"], args].concat()).expect(0);
    let status = at(&["status", "--json"]).json();
    let report = at(&["report", "--format", "json"]).json();
    let row = &report["rows"][2];
    at(&["export", "-o", "out"]);
    let lines = fs::read_to_string(dir.join("out/pairs.jsonl")).expect("an export");
    let names = at(&["show", "--json"]).json();
    at(&["check"]);
    ProjectCounts {
        status: [
            number(&status["pairs"]),
            number(&status["jobs"]["done"]),
            number(&status["verdicts"]["pass"]),
        ],
        report: [
            number(&report["pairs"]),
            number(&row["n"]),
            number(&row["judged"]),
            number(&row["truth"]["n"]),
        ],
        names: names["pairs"].as_array().expect("names").len(),
        exported: lines.lines().count(),
    }
}

#[test]
fn retired_pairs_are_in_no_count_and_come_back() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    mocban(dir.path(), &["demo", "p", "--pairs", "3"]).expect(0);
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    let shown = |name: &str, args: &[&str]| {
        assert_call(name, dir.path(), &[&["-C", "p"], args].concat());
    };
    for pair in PAIRS {
        at(&["verdict", "set", pair, "pass", "--reviewer", "lan"]).expect(0);
    }
    let before = counts(dir.path());
    assert_eq!((before.status, before.report), ([3, 3, 12], [3, 3, 3, 3]));
    shown("retire", &["retire", PAIRS[1]]);
    let again = at(&["retire", PAIRS[1]]).expect(0);
    assert!(
        again.err.starts_with("1 pair retired already\n"),
        "{}",
        again.err
    );
    at(&["retire", "--undo", PAIRS[0]]).expect(4);
    let without = counts(dir.path());
    assert_eq!((without.status, without.report), ([2, 2, 8], [2, 2, 2, 2]));
    assert_eq!(
        (without.names, without.exported * 3),
        (2, before.exported * 2)
    );
    assert_eq!(at(&["status", "--json"]).expect(0).json()["retired"], 1);
    let log = at(&["verdict", "log", PAIRS[1], "--json"]).expect(0);
    assert_eq!(log.out.lines().count(), 4);
    for command in ["show", "run", "retry", "contact-sheet"] {
        at(&[command, PAIRS[1]]).expect(4);
    }
    // The demo's own list has the pair, and a run finds nothing to do.
    at(&["import", "p/data/manifest.csv"]).expect(0);
    at(&["run"]).expect(0);
    assert_eq!(counts(dir.path()), without);
    shown("retire_undo", &["retire", "--undo", PAIRS[1]]);
    at(&["run"]).expect(0);
    assert_eq!(counts(dir.path()), before);
    // A shorter list, and the whole one.
    let list = fs::read_to_string(dir.path().join("p/data/manifest.csv")).expect("a list");
    let shorter: Vec<&str> = list
        .lines()
        .filter(|line| !line.contains(PAIRS[1]))
        .collect();
    fs::write(dir.path().join("p/data/shorter.csv"), shorter.join("\n")).expect("written");
    shown(
        "import_replace",
        &["import", "p/data/shorter.csv", "--replace"],
    );
    assert_eq!(counts(dir.path()), without);
    let back = at(&["import", "p/data/manifest.csv", "--json"])
        .expect(0)
        .json();
    assert_eq!(
        (&back["restored"], &back["retired"]),
        (&1.into(), &0.into())
    );
    assert_eq!(counts(dir.path()), before);
}

#[test]
fn pairs_that_are_retired_during_a_run_come_back_whole_also_after_a_kill() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let expected = project(dir.path(), "expected", "3");
    call(&mut run(&expected, &[])).expect(0);
    let retire = |project: &str, undo: &[&str]| {
        mocban(
            dir.path(),
            &[&["-C", project, "retire"], undo, &PAIRS].concat(),
        )
    };
    for (name, is_killed) in [("released", false), ("killed", true)] {
        let p = project(dir.path(), name, "3");
        let hold = dir.path().join(format!("{name}.hold"));
        let mut command = run(&p, &["-j", "1"]);
        command.env("MOCBAN_HOLD_AT", "depth:synced");
        command.env("MOCBAN_HOLD_FILE", &hold);
        let mut running = Running::start(&mut command);
        running.wait_until("it is held", || hold.exists());
        retire(name, &[]).expect(0);
        if is_killed {
            drop(running);
        } else {
            fs::remove_file(&hold).expect("released");
            let (code, _, err) = running.end();
            assert_eq!(code, Some(0), "{err}");
        }
        let status = mocban(dir.path(), &["-C", name, "status", "--json"]).expect(0);
        let status = status.json();
        assert_eq!(
            (&status["pairs"], &status["retired"]),
            (&0.into(), &3.into())
        );
        assert_eq!(status["jobs"]["leased"], 0);
        mocban(dir.path(), &["-C", name, "check"]).expect(0);
        retire(name, &["--undo"]).expect(0);
        call(&mut run(&p, &[])).expect(0);
        assert_eq!(results(&p), results(&expected), "{name}");
        mocban(dir.path(), &["-C", name, "check"]).expect(0);
    }
}

#[test]
fn copies_backups_and_verdict_files_keep_retired_pairs_apart() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    mocban(dir.path(), &["demo", "p", "--pairs", "3"]).expect(0);
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["verdict", "set", PAIRS[1], "pass", "--reviewer", "lan"]).expect(0);
    at(&["retire", PAIRS[1]]).expect(0);
    at(&["backup", "b.sqlite"]).expect(0);
    mocban(dir.path(), &["restore", "b.sqlite", "q"]).expect(0);
    let status = mocban(dir.path(), &["-C", "q", "status", "--json"]).expect(0);
    let status = status.json();
    assert_eq!(
        (&status["pairs"], &status["retired"]),
        (&2.into(), &1.into())
    );
    // A verdict on a retired pair is refused with the way out, and the log of an export can be imported again.
    fs::write(
        dir.path().join("v.csv"),
        format!("pair,verdict,reviewer\n{},Pass,minh\n", PAIRS[1]),
    )
    .expect("written");
    assert_call(
        "error_verdict_of_retired_pair",
        dir.path(),
        &["-C", "p", "verdict", "import", "v.csv"],
    );
    at(&["export", "-o", "out"]).expect(0);
    let log = fs::read_to_string(dir.path().join("out/verdicts.jsonl")).expect("a log");
    assert_eq!(log.lines().count(), 4);
    at(&["verdict", "import", "out/verdicts.jsonl"]).expect(0);
}
