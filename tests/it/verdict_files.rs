//! Verdicts from files: what a file may have, and which of its verdicts count.

use mocban::project::location::now;
use mocban_system::time_text::day;

use crate::check::{at, done};

#[test]
fn of_two_verdicts_of_a_reviewer_the_later_one_counts() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let import = |text: &str| {
        std::fs::write(project.dir().join("v.csv"), text).expect("written");
        at(&project, &["verdict", "import", "v.csv", "--json"]).expect(0)
    };
    let later = "pair,verdict,reviewer,at\nupright-0001,pass,hoa,2024-01-02\n\
        upright-0001,fail,hoa,2024-01-01\n";
    let taken = import(later);
    let counts =
        |taken: &serde_json::Value| ["recorded", "older", "known"].map(|key| taken[key].as_u64());
    assert_eq!(counts(&taken.json()), [Some(1), Some(1), Some(0)]);
    let says =
        "1 verdict left out where the reviewer judged the same result later, first on line 3";
    assert!(taken.err.contains(says), "{}", taken.err);
    let again = import("pair,verdict,reviewer,at\nupright-0001,fail,hoa,2024-01-01\n");
    assert_eq!(counts(&again.json()), [Some(0), Some(1), Some(0)]);
    let status = at(&project, &["status", "--json"]).expect(0).json();
    assert_eq!(status["verdicts"]["fail"], 0);
}

#[test]
fn a_list_of_today_that_is_imported_again_replaces_no_correction() {
    let import_twice = |today: &str| {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = done(dir.path());
        let list = format!("pair,verdict,reviewer,at\nupright-0001,pass,hoa,{today}\n");
        std::fs::write(project.dir().join("v.csv"), list).expect("written");
        let import = || {
            let taken = at(&project, &["verdict", "import", "v.csv", "--json"]).expect(0);
            let taken = taken.json();
            ["recorded", "older", "known"].map(|key| taken[key].as_u64())
        };
        let first = import();
        let set = ["verdict", "set", "upright-0001", "fail", "--reviewer"];
        at(&project, &[&set[..], &["hoa"]].concat()).expect(0);
        let second = import();
        let status = at(&project, &["status", "--json"]).expect(0).json();
        (first, second, status["verdicts"]["fail"].as_u64())
    };
    let found = loop {
        let today = day(now());
        let found = import_twice(&today);
        // The day may end between two commands.
        if day(now()) == today {
            break found;
        }
    };
    let (first, second) = ([1, 0, 0].map(Some), [0, 0, 1].map(Some));
    assert_eq!(found, (first, second, Some(4)));
}

#[test]
fn fields_that_are_not_read_are_named() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let line = r#"{"pair":"upright-0001","verdict":"fail","reviewer":"hoa","angle":5}"#;
    std::fs::write(project.dir().join("v.jsonl"), line).expect("written");
    let taken = at(&project, &["verdict", "import", "v.jsonl"]).expect(0);
    let says = "v.jsonl: fields that no verdict has are not read: angle (line 1)";
    assert!(taken.err.contains(says), "{}", taken.err);
}

#[test]
fn metrics_are_named_in_any_case() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let set = [
        "verdict",
        "set",
        "upright-0001",
        "pass",
        "--reviewer",
        "hoa",
    ];
    let set = at(&project, &[&set[..], &["--metric", "Relief"]].concat()).expect(0);
    assert!(
        set.err.contains("upright-0001, relief: pass"),
        "{}",
        set.err
    );
    let place = |name: &str| dir.path().join(name).display().to_string();
    for (command, output) in [
        ("contact-sheet", place("sheet.png")),
        ("export", place("out")),
    ] {
        at(&project, &[command, "--metric", "RELIEF", "-o", &output]).expect(0);
    }
}

#[test]
fn the_rows_of_a_list_are_undone_together() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let list =
        "pair,verdict,reviewer,at\nupright-0000,fail,hoa,21/11/2024\nupright-0001,fail,hoa,\n,,,\n";
    std::fs::write(project.dir().join("v.csv"), list).expect("written");
    let taken = at(&project, &["verdict", "import", "v.csv"]).expect(0);
    for says in [
        "v.csv: dates such as the one on line 2 are read with the day first",
        "2 verdicts recorded; `verdict undo --reviewer NAME --last N` takes back",
    ] {
        assert!(taken.err.contains(says), "{}", taken.err);
    }
    let undo = ["verdict", "undo", "--json", "--reviewer", "hoa", "--last"];
    let undo = |last: &str| at(&project, &[&undo[..], &[last]].concat());
    let undone = undo("3").expect(0).json()["undone"].clone();
    // On four metrics each.
    assert_eq!(undone.as_array().map(Vec::len), Some(8));
    let status = at(&project, &["status", "--json"]).expect(0).json();
    assert_eq!(status["verdicts"]["fail"], 0);
    assert!(undo("1").code != 0);
}

#[test]
fn lines_of_an_export_on_retired_pairs_are_known_or_refused() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let lines = at(&project, &["verdict", "log", "--json"]).expect(0).out;
    std::fs::write(project.dir().join("v.jsonl"), &lines).expect("written");
    at(&project, &["retire", "upright-0000"]).expect(0);
    let import = || at(&project, &["verdict", "import", "v.jsonl", "--json"]);
    let taken = import().expect(0);
    let counts = ["recorded", "left_out", "known"].map(|key| taken.json()[key].as_u64());
    assert_eq!(counts, [Some(0), Some(0), Some(4)]);
    // By another reviewer, on the same results.
    let other = lines.replace("\"lan\"", "\"hoa\"");
    std::fs::write(project.dir().join("v.jsonl"), lines + &other).expect("written");
    let refused = import().expect(2);
    assert!(
        refused
            .err
            .contains("line 5: pair upright-0000 was retired on"),
        "{}",
        refused.err
    );
    at(&project, &["retire", "--undo", "upright-0000"]).expect(0);
    assert_eq!(import().expect(0).json()["recorded"], 4);
}
