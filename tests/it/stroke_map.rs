//! Exported stroke maps agree with the exported masks and numbers, and the review page shows them.

use std::path::Path;

use mocban::raster::{Grid, decode_grey8};
use mocban::store::Project;
use serde_json::Value;

use crate::cli::mocban;
use crate::page::{NO_CHECKS, Page};

/// Values of a stroke map, with the mask on which they lie, and the field that holds their share of its area.
const KINDS: [(u8, &str, &str); 2] = [
    (128, "canvas_depth_mask", "missing_ink"),
    (255, "canvas_print_mask", "missing_wood"),
];

fn grey8(export: &Path, line: &Value, role: &str) -> Grid<u8> {
    let path = export.join(line["files"][role].as_str().expect(role));
    decode_grey8(&std::fs::read(path).expect(role)).expect(role)
}

/// Compares the map of a result with its masks and numbers. The map has half the resolution of the masks.
fn map_lies_on_the_masks(export: &Path, line: &Value) {
    let map = grey8(export, line, "stroke_map");
    let mut pixels = 0;
    for (value, role, field) in KINDS {
        let mask = grey8(export, line, role);
        assert_eq!([map.width(), map.height()], [mask.width(), mask.height()]);
        let set: Vec<usize> = (0..map.data().len())
            .filter(|at| map.data()[*at] == value)
            .collect();
        for at in &set {
            let [x, y] = [at % map.width(), at / map.width()].map(|at| at as i64);
            let mut around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (x + dx, y + dy)));
            assert!(
                around.any(|(x, y)| mask.get(x, y) == Some(255)),
                "{value} at {x}, {y}"
            );
        }
        let share = set.len() as f64 / mask.map(|value| *value > 0).count() as f64;
        let found = line[field].as_f64().expect("a share");
        assert!((found - share).abs() < 0.02, "{field}: {found}, {share}");
        pixels += set.len();
    }
    assert_eq!(pixels, map.map(|value| *value > 0).count());
    assert_eq!(line["disagreements"] == 0, pixels == 0);
}

#[test]
fn lost_strokes_are_exported_and_shown() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let demo = ["demo", "p", "--tier", "hard", "--pairs", "2", "--seed", "5"];
    mocban(dir.path(), &demo).expect(0);
    mocban(dir.path(), &["-C", "p", "export", "-o", "aligned"]).expect(0);
    let export = dir.path().join("aligned");
    let lines = std::fs::read_to_string(export.join("pairs.jsonl")).expect("the lines");
    let mut missing = Vec::new();
    for line in lines.lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        map_lies_on_the_masks(&export, &line);
        // Both blocks have lost strokes.
        assert!(line["disagreements"].as_u64() > Some(0), "{line}");
        let share = line["missing_wood"].as_f64().expect("a share");
        assert!(share > 0.01, "{line}");
        missing.push(share);
    }
    let project = Project::open(&dir.path().join("p")).expect("the project");
    let page = Page::open(&project, "lan", &NO_CHECKS);
    for item in page.queue() {
        let id = item["id"].as_str().expect("an id");
        let [map, ink] = ["stroke-map", "print-mask"].map(|layer| {
            let reply = page.get(&format!("/image/{id}/{layer}"));
            let image = decode_grey8(&reply.body).expect("a PNG image");
            image.map(|value| *value == 255)
        });
        let under_ink = map.zip_map(&ink, |map, ink| map && ink).count();
        // The map has half the resolution of the ink, so its edges differ.
        assert!(under_ink * 10 > map.count() * 9, "{under_ink}");
        let share = map.count() as f64 / ink.count() as f64;
        let is_near = |missing: &f64| (missing - share).abs() < 0.02;
        assert!(missing.iter().any(is_near), "{share} of {missing:?}");
    }
}
