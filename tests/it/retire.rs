//! `retire` and `import --replace`: pairs that are in no count, and come back with all they had.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::block_view::finished_block;
use crate::check::done;
use crate::cli::{call, mocban};
use crate::made_once::copy_of;
use crate::processes::Running;
use crate::resume::{project, results, run};
use crate::small_block::few_labels_with;
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

/// Copies a demo project `p` whose three pairs have results.
fn three_pairs(dir: &Path) {
    copy_of("three pairs with results", dir, |dir| {
        mocban(dir, &["demo", "p", "--pairs", "3"]).expect(0);
    });
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
fn commands_on_a_project_whose_pairs_are_all_retired_say_so() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    done(dir.path());
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["retire", "upright-0000", "upright-0001"]).expect(0);
    let clause = "all 2 pairs of the project are retired";
    for (args, code) in [
        (&["report"][..], 0),
        (&["report", "--require-complete"], 21),
        (&["run"], 0),
        (&["run", "--dry-run"], 0),
        (&["plan"], 0),
        (&["export", "-o", "out"], 0),
        (&["export", "-o", "out", "--only", "confident"], 4),
        (&["contact-sheet"], 4),
        (&["review", "--reviewer", "lan", "--no-open"], 4),
    ] {
        let call = at(args).expect(code);
        let text = [call.out, call.err].concat().replace('\n', " ");
        assert!(text.contains(clause), "{args:?}: {text}");
        assert!(!text.contains("import"), "{args:?}: {text}");
    }
    for command in ["run", "status"] {
        let text = at(&[command]).expect(0).err;
        assert!(text.contains(" -C p status --retired\n"), "{text}");
    }
    let agreement = at(&["agreement"]).expect(0).out;
    assert!(
        agreement.starts_with("Nobody has judged a result of a pair that counts;"),
        "{agreement}"
    );
    let report = at(&["report", "--format", "json"]).expect(0).json();
    assert_eq!(report["retired"], 2);
}

#[test]
fn retired_pairs_are_in_no_count_and_come_back() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    three_pairs(dir.path());
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
    let listed = at(&["status", "--retired"]).expect(0).out;
    let line = listed.lines().last().expect("a line");
    assert!(
        line.starts_with(PAIRS[1]) && line.contains("by a person"),
        "{listed}"
    );
    let listed = at(&["status", "--retired", "--json"]).expect(0).json();
    let listed = &listed["retired_list"];
    assert_eq!(listed[0]["id"], PAIRS[1]);
    assert_eq!(listed[0]["cause"], "person");
    assert_eq!(listed.as_array().map(Vec::len), Some(1));
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
fn the_newest_import_is_undone_and_done_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    three_pairs(dir.path());
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    let pairs = || at(&["status", "--json"]).expect(0).json()["pairs"].clone();
    let list = fs::read_to_string(dir.path().join("p/data/manifest.csv")).expect("a list");
    let again = list
        .replace("upright-", "again-")
        .replace("/again-", "/upright-");
    fs::write(dir.path().join("p/data/again.csv"), again).expect("written");
    at(&["import", "p/data/again.csv"]).expect(0);
    assert_eq!(pairs(), 6);
    let undone = at(&["retire", "--last-import", "--json"]).expect(0).json();
    assert_eq!((&undone["retired"], &pairs()), (&json!(3), &json!(3)));
    at(&["show", PAIRS[0]]).expect(0);
    // A second call does not undo the import before.
    let twice = at(&["retire", "--last-import", "--json"]).expect(0);
    let text = "the import that added these pairs was on ";
    assert!(twice.err.contains(text), "{}", twice.err);
    let twice = twice.json();
    assert_eq!((&twice["unchanged"], &pairs()), (&json!(3), &json!(3)));
    at(&["retire", "--undo", "--last-import"]).expect(0);
    assert_eq!(pairs(), 6);
    at(&["retire", "--last-import", PAIRS[0]]).expect(2);
}

#[test]
fn an_import_without_new_pairs_is_not_undone_as_the_one_before() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    let list = |name: &str, ids: &[&str]| {
        let rows = ids.iter().map(|id| format!("{id},{id}.stl,{id}.png"));
        let rows: Vec<String> = rows.collect();
        let text = format!("id,mesh,print\n{}\n", rows.join("\n"));
        fs::write(dir.path().join(name), text).expect("written");
    };
    list("a.csv", &["a1", "a2"]);
    list("b.csv", &["b1", "b2", "b3"]);
    fs::write(
        dir.path().join("blocks.csv"),
        "block,mesh,page\nv1,v.stl,v.png\n",
    )
    .expect("written");
    let import = |name: &str| at(&["import", name, "--allow-missing"]).expect(0);
    for name in ["a.csv", "b.csv"] {
        import(name);
    }
    for empty in ["a.csv", "blocks.csv"] {
        import(empty);
        for undo in [&["--last-import"][..], &["--undo", "--last-import"]] {
            let refused = at(&[&["retire"], undo].concat()).expect(2);
            for text in [
                "the newest import, on ",
                ", added no pair; the newest one that did was on ",
                " and added 3 pairs, first b1: give --import 1 in place of --last-import",
                "; `retire BLOCK` takes out the pairs of a block",
            ] {
                assert!(refused.err.contains(text), "{text}: {}", refused.err);
            }
        }
        assert_eq!(pairs_and_retired(dir.path()), [5, 0]);
    }
    let undo = at(&["retire", "--import", "2"]).expect(0).next();
    assert!(undo[0].ends_with("retire --undo --import 2"), "{undo:?}");
    assert_eq!(pairs_and_retired(dir.path()), [3, 2]);
    at(&["retire", "--import", "1"]).expect(0);
    assert_eq!(pairs_and_retired(dir.path()), [0, 5]);
    at(&["retire", "--undo", "--import", "2"]).expect(0);
    assert_eq!(pairs_and_retired(dir.path()), [2, 3]);
    let none = at(&["retire", "--import", "3"]).expect(4);
    let reason = "fewer than 3 imports have added pairs";
    assert!(none.err.contains(reason), "{}", none.err);
    // An import that adds pairs is the newest one again.
    list("c.csv", &["c1"]);
    import("c.csv");
    at(&["retire", "--last-import"]).expect(0);
    assert_eq!(pairs_and_retired(dir.path()), [2, 4]);
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
    three_pairs(dir.path());
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

/// Returns the numbers of pairs in and out of the counts.
fn pairs_and_retired(dir: &Path) -> [u64; 2] {
    let status = mocban(dir, &["-C", "p", "status", "--json"]).expect(0);
    let status = status.json();
    ["pairs", "retired"].map(|key| number(&status[key]))
}

#[test]
fn the_block_of_a_list_stands_for_its_pairs() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let list =
        "id,mesh,print,block\na,a.stl,a.png,Ván 01\nb,b.stl,b.png,Ván 02\nc,c.stl,c.png,Ván 01\n";
    fs::write(dir.path().join("pairs.csv"), list).expect("written");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["import", "pairs.csv", "--allow-missing"]).expect(0);
    at(&["retire", "a"]).expect(0);
    let retired = at(&["retire", "Ván 01"]).expect(0);
    for text in ["1 pair out of every count", "1 pair retired already"] {
        assert!(retired.err.contains(text), "{}", retired.err);
    }
    assert_eq!(pairs_and_retired(dir.path()), [1, 2]);
    // Undo of the block would also bring back `a`, which was retired before.
    assert_eq!(retired.next(), [""; 0]);
    // A list does not bring back what a person retired.
    at(&["import", "pairs.csv", "--allow-missing"]).expect(0);
    assert_eq!(pairs_and_retired(dir.path()), [1, 2]);
    at(&["retire", "--undo", "Ván 01", "c"]).expect(0);
    assert_eq!(pairs_and_retired(dir.path()), [3, 0]);
    let unknown = at(&["retire", "Ván 09"]).expect(4);
    let reason = "there is no pair or block Ván 09";
    assert!(unknown.err.contains(reason), "{}", unknown.err);
}

#[test]
fn a_cut_block_stands_for_its_pairs_and_a_later_run_leaves_them_retired() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    let block = || {
        let block = at(&["show", "b1", "--json"]).expect(0).json();
        ["characters", "retired"].map(|key| number(&block[key]))
    };
    assert_eq!((pairs_and_retired(dir.path()), block()), ([6, 0], [6, 0]));
    let undo = at(&["retire", "b1"]).expect(0).next();
    assert!(undo[0].ends_with("retire --undo b1"), "{undo:?}");
    let is_out = || {
        assert_eq!((pairs_and_retired(dir.path()), block()), ([0, 6], [0, 6]));
        let status = at(&["status", "--json"]).expect(0).json();
        // The block is done and stays in the project: a person retired its pairs, not its files.
        let blocks = &status["blocks"];
        assert_eq!(
            (&blocks["total"], &blocks["jobs"]["done"]),
            (&1.into(), &1.into())
        );
    };
    is_out();
    // The block is cut again, from labels of which one box is moved.
    few_labels_with(dir.path(), &dir.path().join("few.json"), |few| {
        let x = &mut few[0]["shape_attributes"]["x"];
        *x = (x.as_i64().expect("pixels") + 4).into();
    });
    at(&["run"]).expect(0);
    is_out();
    at(&["retire", "--undo", "b1"]).expect(0);
    at(&["run"]).expect(0);
    assert_eq!((pairs_and_retired(dir.path()), block()), ([6, 0], [6, 0]));
    at(&["check"]).expect(0);
    let again = [
        "import",
        "--block",
        "d/data/block.ply",
        "--page",
        "d/data/page.jpg",
        "--name",
        "b2",
    ];
    at(&again).expect(0);
    let uncut = at(&["retire", "b2"]).expect(0);
    let removed = "block b2 is removed, because it has no pairs; an import brings it back";
    assert!(uncut.err.contains(removed), "{}", uncut.err);
}
