//! `show --low`, and commands with the block of a list: which pairs they list, and in what order.

use std::fs;
use std::path::{Path, PathBuf};

use crate::check::done;
use crate::cli::{empty, mocban};

/// Returns the files of a folder, sorted by name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}

#[test]
fn only_pairs_of_low_confidence_are_listed_the_least_confident_first() {
    let dir = empty();
    mocban(dir.path(), &["demo", "d", "--pairs", "3", "--no-run"]).expect(0);
    let [meshes, prints] =
        ["meshes", "prints"].map(|name| files(&dir.path().join("d/data").join(name)));
    let mut list = "id,mesh,print\n".to_owned();
    let ids = ["right", "wrong-0", "wrong-1", "wrong-2"];
    for (id, [mesh, print]) in ids.into_iter().zip([[0, 0], [0, 1], [1, 2], [2, 0]]) {
        let [mesh, print] = [meshes[mesh].display(), prints[print].display()];
        list.extend([format!("{id},{mesh},{print}\n")]);
    }
    fs::write(dir.path().join("pairs.csv"), list).expect("written");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["import", "pairs.csv"]).expect(0);
    // Without a limit, pairs with the print of another character have a result too.
    let set = [
        "--set",
        "depth.longest_px=96",
        "--set",
        "register.min_confidence=0",
    ];
    at(&[&["run"], &set[..]].concat()).expect(0);
    let rows = |args: &[&str]| -> Vec<(String, f64)> {
        let table = at(&[args, &["--json"]].concat()).expect(0).json();
        let rows = table["pairs"].as_array().expect("rows").iter();
        let row = |row: &serde_json::Value| {
            let id = row["id"].as_str().expect("an id");
            (id.to_owned(), row["confidence"].as_f64().expect("a number"))
        };
        rows.map(row).collect()
    };
    let low = rows(&["show", "--low"]);
    assert!(low.is_sorted_by(|a, b| a.1 <= b.1), "{low:?}");
    let mut names: Vec<&str> = low.iter().map(|(id, _)| id.as_str()).collect();
    let text = at(&["show", "--low"]).expect(0);
    let lines: Vec<&str> = text.out.lines().collect();
    for (line, name) in lines[1..].iter().zip(&names) {
        assert!(line.contains(name), "{}", text.out);
    }
    assert!(!text.out.contains("right"), "{}", text.out);
    assert_ne!(names, ids[1..], "the order of the names shows nothing");
    names.sort_unstable();
    assert_eq!(names, ids[1..]);
}

#[test]
fn the_block_of_a_list_stands_for_its_pairs_or_is_explained() {
    let dir = empty();
    done(dir.path());
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    let list = fs::read_to_string(dir.path().join("p/data/manifest.csv")).expect("a list");
    let block = list.lines().last().and_then(|line| line.split(',').nth(4));
    let block = block.expect("a block");
    let shown = at(&["show", block, "--json"]).expect(0).json();
    let pairs = shown["pairs"].as_array().expect("rows");
    let ids: Vec<&str> = pairs.iter().filter_map(|row| row["id"].as_str()).collect();
    assert_eq!(ids, ["upright-0000", "upright-0001"]);
    let text = at(&["show", block]).expect(0);
    assert!(ids.iter().all(|id| text.out.contains(id)), "{}", text.out);
    let sheet = at(&["contact-sheet", block, "-o", "sheet.png"]).expect(0);
    assert!(sheet.err.contains("2 pairs of 2"), "{}", sheet.err);
    let sheet = at(&["contact-sheet", "--block", block]).expect(4);
    assert!(sheet.err.contains("has no page"), "{}", sheet.err);
    let view = at(&["view", "--no-open", block]).expect(4);
    let says = "is a block with 2 pairs, and no pair; give the id of a pair, such as upright-0000";
    assert!(view.err.contains(says), "{}", view.err);
}
