//! The demo of a whole block.

use std::collections::BTreeSet;
use std::path::Path;

use crate::cli::{empty, mocban};

#[test]
fn block_is_created_once_with_page_labels_and_truth() {
    let dir = empty();
    let args = [
        "demo",
        "d",
        "--block=small",
        "--seed",
        "7",
        "--spacing",
        "2",
        "--no-run",
    ];
    let created = mocban(dir.path(), &args).expect(0);
    assert!(
        created.err.contains("created a small block of "),
        "{}",
        created.err
    );
    let data = dir.path().join("d/data");
    let truth = std::fs::read(data.join("truth.json")).expect("the truth");
    let truth: serde_json::Value = serde_json::from_slice(&truth).expect("JSON");
    let characters = truth["characters"].as_array().expect("characters");
    assert!(characters.len() > 20, "{}", characters.len());
    let page = truth["page"].as_str().expect("a name");
    let mesh = std::fs::read(data.join("block.ply")).expect("the mesh");
    let faces = format!("element face {}\n", truth["triangles"]);
    assert!(String::from_utf8_lossy(&mesh[..400]).contains(&faces));
    let labels = std::fs::read_to_string(data.join("labels.json")).expect("the labels");
    let bytes = std::fs::metadata(data.join(page)).expect("the page").len();
    assert!(labels.contains(&format!("\"{page}{bytes}\"")));
    let written = std::fs::metadata(data.join("block.ply")).expect("the mesh");
    let again = mocban(dir.path(), &args).expect(0);
    assert!(
        again.err.contains("found a small block of "),
        "{}",
        again.err
    );
    let found = std::fs::metadata(data.join("block.ply")).expect("the mesh");
    assert_eq!(written.modified().ok(), found.modified().ok());
    let left: BTreeSet<_> = std::fs::read_dir(&data)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("UTF-8")
        })
        .collect();
    let names = [
        "README.txt",
        "block.json",
        "block.ply",
        "labels.json",
        page,
        "truth.json",
    ];
    assert_eq!(left, names.map(ToOwned::to_owned).into());
}

#[test]
fn the_report_has_the_accuracy_of_found_boxes() {
    let dir = empty();
    let args = [
        "demo",
        "d",
        "--block=small",
        "--seed",
        "4",
        "--spacing",
        "0.5",
        "--no-labels",
        "--json",
    ];
    mocban(dir.path(), &[&args[..], &["--no-run"]].concat()).expect(0);
    let truth = hide_part(dir.path());
    let report = mocban(dir.path(), &args).expect(0).json();
    let characters = truth["characters"].as_array().expect("characters").iter();
    let whole = characters.filter(|one| one["on_page"] == true).count();
    let block = &report["blocks"][0];
    assert_eq!(block["block"], "block");
    assert_eq!(block["characters"], whole);
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let [found, right, tight] = ["found", "right", "tight"].map(|name| number(&block[name]));
    assert!(tight <= right && right <= found, "{block}");
    assert!(right >= 0.95 * whole as f64, "{block}");
    let boxes = &block["boxes"];
    let at = |iou: &str| [&boxes[iou]["precision"], &boxes[iou]["recall"]].map(number);
    let ([p50, r50], [p70, r70]) = (at("iou_50"), at("iou_70"));
    assert!(p50.min(r50) > 0.9 && p70 <= p50 && r70 <= r50, "{block}");
    let matched = number(&boxes["iou_50"]["matched"]);
    assert_eq!(r50, matched / whole as f64);
    let text = mocban(dir.path(), &["-C", "d", "report"]).expect(0).out;
    assert!(text.contains("Block  true  found  right %"), "{text}");
    let page = truth["page"].as_str().expect("a name");
    check_round_trip(dir.path(), page);
    check_wider_boxes(dir.path(), page, right);
}

/// Says in the truth that the page shows only a part of a character, whose box then counts for nothing. Returns the truth.
fn hide_part(dir: &Path) -> serde_json::Value {
    let file = dir.join("d/data/truth.json");
    let truth = std::fs::read(&file).expect("the truth");
    let mut truth: serde_json::Value = serde_json::from_slice(&truth).expect("JSON");
    truth["characters"][0]["on_page"] = false.into();
    std::fs::write(&file, truth.to_string()).expect("written");
    truth
}

fn import_boxes(dir: &Path, page: &str) {
    let page = format!("d/data/{page}");
    let import = [
        "-C",
        "d",
        "import",
        "--block",
        "d/data/block.ply",
        "--page",
        &page,
        "--labels",
        "boxes/pages/block.json",
        "--name",
        "block",
    ];
    mocban(dir, &import).expect(0);
}

/// Checks that results of wider boxes are measured against the truth of their new crops.
fn check_wider_boxes(dir: &Path, page: &str, right: f64) {
    let file = dir.join("boxes/pages/block.json");
    let labels = std::fs::read(&file).expect("the labels");
    let mut labels: serde_json::Value = serde_json::from_slice(&labels).expect("JSON");
    let files = labels["_via_img_metadata"].as_object_mut().expect("files");
    let of_page = files.values_mut().next().expect("a file");
    let regions = of_page["regions"].as_array_mut().expect("regions");
    let wide = regions.iter_mut().filter_map(|region| {
        let shape = &mut region["shape_attributes"];
        let is_inside = shape["x"].as_f64()? > 100.0;
        is_inside.then_some(shape)
    });
    // Each crop begins 15 px farther left, which is more than 5 % of a character.
    for shape in wide.take(3) {
        let [x, width] = ["x", "width"].map(|side| shape[side].as_f64().expect("a number"));
        shape["x"] = (x - 15.0).into();
        shape["width"] = (width + 15.0).into();
    }
    std::fs::write(&file, labels.to_string()).expect("written");
    import_boxes(dir, page);
    let run = mocban(dir, &["-C", "d", "run"]).err;
    assert!(run.contains("block block: 0 pairs added, "), "{run}");
    let report = mocban(dir, &["-C", "d", "report", "--json"])
        .expect(0)
        .json();
    let block = &report["blocks"][0];
    // All three would be wrong by the truth of the narrower boxes.
    let now = block["right"].as_f64().expect("a number");
    assert!(now > right - 3.0, "{right}, {block}");
    assert!(report["unusable_truth"].is_null(), "{report}");
}

/// Checks that found boxes that are exported, and imported as labels without a change, leave all pairs as they are.
fn check_round_trip(dir: &Path, page: &str) {
    let export = ["-C", "d", "export", "--to", "annotations", "-o", "boxes"];
    mocban(dir, &export).expect(0);
    import_boxes(dir, page);
    let run = mocban(dir, &["-C", "d", "run"]).expect(0).err;
    let unchanged = "block block: 0 pairs added, 0 changed, 0 retired";
    assert!(run.contains(unchanged), "{run}");
}

#[test]
fn directory_of_a_demo_takes_no_other_demo() {
    let dir = empty();
    mocban(dir.path(), &["demo", "d", "--pairs", "1", "--no-run"]).expect(0);
    let refused = mocban(dir.path(), &["demo", "d", "--block"]).expect(2);
    assert!(
        refused
            .err
            .contains("holds the demo of tier upright and seed 1"),
        "{}",
        refused.err
    );
}

#[test]
fn options_of_pairs_and_blocks_exclude_each_other() {
    let dir = empty();
    for args in [
        &["demo", "--block", "--pairs", "3"][..],
        &["demo", "--block", "--tier", "hard"],
        &["demo", "--no-labels"],
        &["demo", "--spacing", "0.3"],
        &["demo", "--block=round"],
        &["demo", "--block", "--spacing", "0.01"],
    ] {
        mocban(dir.path(), args).expect(2);
    }
    let left = std::fs::read_dir(dir.path()).expect("readable").count();
    assert_eq!(left, 0, "nothing is created");
}
