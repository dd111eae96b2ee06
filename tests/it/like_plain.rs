//! Compares the exported results of files that show the same in unusual forms with those of a plain file.

use std::path::Path;

use mocban::demo::TruthLine;
use serde_json::Value;

use crate::cli::mocban;
use crate::export_readback::lines;

/// Largest error of a landmark, px.
const LANDMARK_PX: f64 = 3.0;
/// Largest difference between the `IoU` of a form and that of the plain file.
const IOU: f64 = 0.005;

/// Returns the exported results of a metric, one a pair.
fn exported(dir: &Path, metric: &str) -> Vec<Value> {
    let all = lines(&dir.join("out")).into_iter();
    all.filter(|line| line["metric"] == metric).collect()
}

/// Returns where a map with rows of four numbers puts a point, px.
fn place(map: &Value, point: &Value) -> [f64; 2] {
    let number = |value: &Value| value.as_f64().expect("a number");
    [0, 1].map(|axis| {
        let row = &map[axis];
        let terms = (0..3).map(|k| number(&row[k]) * number(&point[k]));
        terms.sum::<f64>() + number(&row[3])
    })
}

/// Returns how far a result puts each landmark from where the truth puts it, px.
pub(crate) fn landmark_errors(result: &Value, truth: &TruthLine) -> Vec<f64> {
    let truth = serde_json::to_value(truth).expect("a truth is JSON");
    let landmarks = truth["landmarks"].as_array().expect("points").iter();
    let errors = landmarks.map(|landmark| {
        let [found, wanted] =
            [result, &truth].map(|source| place(&source["print_from_mesh"], landmark));
        (found[0] - wanted[0]).hypot(found[1] - wanted[1])
    });
    errors.collect()
}

/// Exports the project `p`.
pub(crate) fn export(dir: &Path) {
    mocban(dir, &["-C", "p", "export", "--to", "jsonl", "-o", "out"]).expect(0);
}

/// Asserts that the exported pairs with these ids have landmarks where the truth puts them, and the `IoU` of the first pair, by a
/// metric. `log` is the log of the run.
pub(crate) fn assert_like_first(
    dir: &Path,
    ids: &[&str],
    truth: &TruthLine,
    metric: &str,
    log: &str,
) {
    let results = exported(dir, metric);
    let result = |id: &str| {
        let mut lines = results.iter();
        let found = lines.find(|line| line["id"] == id && line["status"] == "done");
        assert!(found.is_some(), "{id} has no result: {log}");
        found.expect("a result")
    };
    let iou = |id: &str| result(id)["iou"].as_f64().expect("a score");
    let plain = iou(ids[0]);
    assert!(plain > 0.5, "{plain}");
    for id in ids {
        assert!((iou(id) - plain).abs() < IOU, "{id}: {} {plain}", iou(id));
        for error in landmark_errors(result(id), truth) {
            assert!(error < LANDMARK_PX, "{id}: {error} px");
        }
    }
}
