//! Flips single bits of the catalog. For each flip, a check finds the damage, or no output changes. `MOCBAN_TRIALS`
//! sets the number of flips.

use std::collections::BTreeMap;
use std::path::PathBuf;

use mocban::store::Project;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::check::{at, below, done, sql};
use crate::page::{Page, answer};
use crate::resume::copy;
use crate::test_size::trials;

/// Judges the pairs of a project: verdicts, undone verdicts, answers to attention checks and a manual alignment.
fn judge(project: &Project) {
    for (pair, verdict) in [("upright-0000", "pass"), ("upright-0001", "unsure")] {
        let set = ["verdict", "set", pair, verdict, "--reviewer", "hà"];
        at(project, &set).expect(0);
    }
    at(project, &["verdict", "undo", "--reviewer", "hà"]).expect(0);
    let page = Page::open(project, "lan", &["--attention-checks", "1"]);
    let queue = page.queue();
    for (k, item) in queue.iter().enumerate() {
        let body = answer(&format!("e{k}"), item, "pass");
        assert_eq!(
            page.post("/api/answer", &body).expect("a reply").status,
            200
        );
    }
    let undo = json!({ "event": "e0" });
    assert_eq!(page.post("/api/undo", &undo).expect("a reply").status, 200);
    let id = queue[0]["id"].as_str().expect("an id");
    let start = page.get(&format!("/api/alignment/{id}")).json();
    let map = &start["view_from_depth"];
    let align = json!({ "event": "a1", "item": id, "view_from_depth": map, "note": null });
    assert_eq!(
        page.post("/api/align", &align).expect("a reply").status,
        200
    );
}

/// What users see of a project.
#[derive(Debug, PartialEq)]
struct Outputs {
    texts: Vec<String>,
    export: BTreeMap<PathBuf, Vec<u8>>,
}

/// Returns the outputs, or the exit codes of the commands if one of them fails.
fn outputs(project: &Project) -> Result<Outputs, Vec<i32>> {
    let export = project.dir().with_file_name("export");
    let _ = std::fs::remove_dir_all(&export);
    let path = export.to_str().expect("UTF-8");
    let commands = [
        &["report", "-f", "json"][..],
        &["verdict", "log", "--json"],
        &["status", "--json"],
        &["export", "-o", path],
    ];
    let calls: Vec<_> = commands.iter().map(|args| at(project, args)).collect();
    if calls.iter().any(|call| call.code != 0) {
        return Err(calls.iter().map(|call| call.code).collect());
    }
    Ok(Outputs {
        texts: calls[..3].iter().map(|call| call.out.clone()).collect(),
        export: below(&export).into_iter().collect(),
    })
}

/// Runs and checks a repaired project. Returns whether both succeed, and the export equals the expected one or the report
/// states what was left out.
fn is_healed(project: &Project, expected: &Outputs) -> bool {
    let run = at(project, &["run"]);
    let check = at(project, &["check"]);
    let is_right = |found: Outputs| {
        found.export == expected.export || found.texts[0].contains("\"set_apart\"")
    };
    run.code == 0 && check.code == 0 && outputs(project).is_ok_and(is_right)
}

#[test]
fn every_flipped_bit_is_found_or_changes_no_output() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let original = done(dir.path());
    judge(&original);
    at(&original, &["check"]).expect(0);
    let expected = outputs(&original).expect("outputs");
    let intact = std::fs::read(original.catalog_path()).expect("read");
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let mut tally: BTreeMap<&str, usize> = BTreeMap::new();
    let mut failed = Vec::new();
    for trial in 0..trials(30) {
        let project = copy(&original, &dir.path().join(format!("p{trial}")));
        let (byte, bit) = (rng.random_range(0..intact.len()), rng.random_range(0..8));
        let mut flipped = intact.clone();
        flipped[byte] ^= 1 << bit;
        std::fs::write(project.catalog_path(), &flipped).expect("written");
        let outcome = match at(&project, &["check"]).code {
            0 if outputs(&project).as_ref() == Ok(&expected) => "harmless",
            12 => match at(&project, &["check", "--repair"]).code {
                0 if is_healed(&project, &expected) => "healed",
                12 => "found",
                _ => "not healed",
            },
            _ => "not found",
        };
        if outcome.starts_with("not") {
            failed.push(format!("byte {byte} bit {bit}: {outcome}"));
        }
        *tally.entry(outcome).or_default() += 1;
        std::fs::remove_dir_all(project.dir()).expect("removed");
    }
    eprintln!("{tally:?}");
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Asserts that commands which leave out a damaged row say so.
#[track_caller]
fn assert_states(project: &Project, says: &str) {
    let log = says.contains("verdict").then_some(&["verdict", "log"][..]);
    let commands = [
        &["report"][..],
        &["report", "-f", "html"],
        &["export", "-o", "x"],
        &["contact-sheet"],
        &["agreement"],
    ];
    for command in log.into_iter().chain(commands) {
        let call = at(project, command).expect(0);
        assert!(call.err.contains(says), "{command:?}: {}", call.err);
    }
    for command in [
        &["report", "-f", "json"][..],
        &["agreement", "--json"],
        &["export", "-o", "x", "--json"],
    ] {
        let stated = at(project, command).expect(0).json();
        assert_eq!(stated["set_apart"]["count"], 1, "{command:?}");
        assert_eq!(stated["set_apart"]["first"][0], says);
    }
    let incomplete = at(project, &["report", "--require-complete"]).expect(21);
    assert!(
        incomplete.err.contains("damaged rows"),
        "{}",
        incomplete.err
    );
}

#[test]
fn changed_added_and_removed_rows_are_named_with_their_pair() {
    let cases = [
        (
            "DROP TRIGGER verdict_no_update; UPDATE verdict SET verdict = 'fail' WHERE id = 1",
            "row 1 of the table verdict (pair upright-0000) differs from its checksum",
        ),
        (
            "DROP TRIGGER verdict_no_delete; DELETE FROM verdict WHERE id = 2;
            DELETE FROM checksum WHERE record = 2 AND row = 2",
            "row 2 of the table verdict is missing",
        ),
        (
            "DROP TRIGGER verdict_no_delete; DELETE FROM verdict WHERE id = 4;
            DELETE FROM checksum WHERE record = 2 AND row = 4",
            "the last rows of the table verdict, up to row 4, are missing",
        ),
        (
            "DELETE FROM truth WHERE pair = 1",
            "row 1 of the table truth is missing",
        ),
        (
            "INSERT INTO verdict_undo (act, reviewer, at) VALUES (1, 'lan', 7)",
            "row 1 of the table verdict_undo (pair upright-0000) has no checksum",
        ),
        (
            "UPDATE pair SET character = 'x' WHERE id = 2",
            "row 2 of the table pair (pair upright-0001) differs from its checksum",
        ),
    ];
    for (statements, says) in cases {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = done(dir.path());
        sql(&project, statements);
        let found = at(&project, &["check"]).expect(12);
        assert!(found.out.contains(says), "{statements}: {}", found.out);
        assert_states(&project, says);
        // The rows of a list are imported again. Rows of a log are set apart, which loses and changes nothing.
        let is_of_list = ["table pair", "table truth"];
        let is_of_list = is_of_list.iter().any(|table| says.contains(table));
        let repaired = at(&project, &["check", "--repair"]);
        let repaired = repaired.expect(if is_of_list { 12 } else { 0 });
        assert!(
            repaired.out.contains(says),
            "{statements}: {}",
            repaired.out
        );
        let again = at(&project, &["check"]).expect(repaired.code);
        assert!(again.out.contains(says), "{statements}: {}", again.out);
        assert_states(&project, says);
    }
}

#[test]
fn an_import_replaces_a_damaged_row() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    for damage in ["CAST(x'ff' AS TEXT)", "'other'"] {
        sql(
            &project,
            &format!("UPDATE pair SET character = {damage} WHERE id = 2"),
        );
        at(&project, &["check"]).expect(12);
        at(&project, &["import", "data/manifest.csv"]).expect(0);
        at(&project, &["check"]).expect(0);
    }
}
