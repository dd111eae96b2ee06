//! A generated block that several tests use.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::cli::mocban;
use crate::made_once::copy_of;

/// Number of characters that [`few_labels`] names.
pub(crate) const CHARACTERS: usize = 6;

/// Creates the folder `d/data` with the files of `demo --block`, at a spacing of 0.5 mm. All tests copy the same files.
pub(crate) fn demo_block(dir: &Path) {
    copy_of("a block", dir, |dir| {
        let demo = [
            "demo",
            "d",
            "--block=plain",
            "--seed",
            "3",
            "--spacing",
            "0.5",
            "--no-run",
        ];
        mocban(dir, &demo).expect(0);
        // Tests make projects of their own from the files.
        fs::remove_file(dir.join("d/catalog.sqlite")).expect("removed");
    });
}

/// Writes labels of a few characters of the block that [`demo_block`] has created.
pub(crate) fn few_labels(dir: &Path, file: &Path) {
    few_labels_with(dir, file, |_| ());
}

/// Like [`few_labels`], with changed regions.
pub(crate) fn few_labels_with(dir: &Path, file: &Path, change: impl FnOnce(&mut [Value])) {
    let labels = fs::read_to_string(dir.join("d/data/labels.json")).expect("the labels");
    let mut labels: Value = serde_json::from_str(&labels).expect("JSON");
    let files = labels["_via_img_metadata"].as_object_mut().expect("files");
    let of_page = files.values_mut().next().expect("a file");
    let regions = of_page["regions"].as_array().expect("regions").iter();
    let mut few: Vec<Value> = regions.step_by(30).take(CHARACTERS).cloned().collect();
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
