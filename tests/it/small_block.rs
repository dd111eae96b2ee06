//! Generated blocks that several tests use.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::cli::mocban;
use crate::made_once::copy_of;

/// Number of characters that [`few_labels`] names.
pub(crate) const CHARACTERS: usize = 6;

/// Creates the folder `d/data` with the files of a small block, at a spacing of 0.5 mm. All tests copy the same files.
pub(crate) fn demo_block(dir: &Path) {
    copy_of("a small block", dir, |dir| make(dir, "--block=small", "4"));
}

/// Like [`demo_block`], with a block of a whole page, whose run takes two to three times the CPU time.
pub(crate) fn demo_page(dir: &Path) {
    copy_of("a block of a page", dir, |dir| {
        make(dir, "--block=plain", "3");
    });
}

/// Makes the files of a block without a project, because tests make projects of their own from the files.
fn make(dir: &Path, kind: &str, seed: &str) {
    let demo = ["demo", "d", kind, "--seed", seed, "--spacing", "0.5"];
    mocban(dir, &[&demo[..], &["--no-run"]].concat()).expect(0);
    fs::remove_file(dir.join("d/catalog.sqlite")).expect("removed");
}

/// Writes labels of a few characters of the block that [`demo_block`] or [`demo_page`] has created, from all over its page.
pub(crate) fn few_labels(dir: &Path, file: &Path) {
    few_labels_with(dir, file, |_| ());
}

/// Like [`few_labels`], with changed regions.
pub(crate) fn few_labels_with(dir: &Path, file: &Path, change: impl FnOnce(&mut [Value])) {
    let labels = fs::read_to_string(dir.join("d/data/labels.json")).expect("the labels");
    let mut labels: Value = serde_json::from_str(&labels).expect("JSON");
    let files = labels["_via_img_metadata"].as_object_mut().expect("files");
    let of_page = files.values_mut().next().expect("a file");
    let regions = of_page["regions"].as_array().expect("regions");
    let few = regions.iter().step_by(regions.len() / (CHARACTERS + 1));
    let few = few.take(CHARACTERS);
    let mut few: Vec<Value> = few.cloned().collect();
    assert_eq!(few.len(), CHARACTERS);
    change(&mut few);
    of_page["regions"] = json!(few);
    fs::write(file, labels.to_string()).expect("written");
}

/// Returns what the project `p` stores of the block `b1`.
pub(crate) fn stored_block(dir: &Path) -> Value {
    let shown = mocban(dir, &["-C", "p", "--json", "show", "b1"]).expect(0);
    shown.json()
}
