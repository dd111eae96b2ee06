//! `retire` and `import --replace`: pairs that are in no count, and come back with all they had.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::cli::mocban;
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
