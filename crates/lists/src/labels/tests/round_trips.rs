//! What is written is read again.

use proptest::prelude::*;
use serde_json::Value;

use super::samples::{PAGE, expected};
use crate::labels::model::{LabelBox, LabelFormat, PageFile, bounds, rectangle};
use crate::labels::{ReplacedLabels, read, replaced_labels, write_coco, write_edited, write_via};
use mocban_core::domain::rounded_edge;

/// Returns boxes with edges in thousandths of a pixel, all different, some of them polygons.
fn any_boxes() -> impl Strategy<Value = Vec<LabelBox>> {
    let edge = |most: i32| (0..most).prop_map(|thousandths| f64::from(thousandths) / 1000.0);
    let text = proptest::option::of("[\u{4e00}-\u{9fff}a-z\"\\\\]{1,3}");
    let one = (
        edge(1_500_000),
        edge(900_000),
        edge(90_000),
        edge(90_000),
        text,
        any::<bool>(),
    );
    proptest::collection::vec(one, 1..40).prop_map(|all| {
        let label =
            |(k, (x, y, w, h, text, is_polygon)): (usize, (f64, f64, f64, f64, _, bool))| {
                let (x, y) = (x - 0.5, y - 0.5);
                let mut outline = rectangle([x, y, x + 2.0 + w, y + 2.0 + h]);
                if is_polygon {
                    outline[2] = [x + 1.0 + w, y + 1.5 + h];
                }
                let outline = outline.into_iter();
                let outline = outline.map(|corner| corner.map(rounded_edge)).collect();
                LabelBox {
                    name: Some(format!("box {k}")),
                    text,
                    outline,
                }
            };
        let mut boxes: Vec<LabelBox> = all.into_iter().enumerate().map(label).collect();
        boxes.sort_by(|a, b| a.bounds().partial_cmp(&b.bounds()).expect("finite edges"));
        boxes.dedup_by_key(|label| label.bounds().map(|edge| (edge * 100.0).round() as i64));
        boxes
    })
}

proptest! {
    #[test]
    fn via_is_read_as_written(boxes in any_boxes()) {
        let labels = read(&write_via(&boxes, &PAGE), "via.json", &PAGE).expect("a valid file");
        prop_assert_eq!((labels.format, labels.warnings), (LabelFormat::Via2, vec![]));
        prop_assert_eq!(labels.boxes, boxes);
    }

    #[test]
    fn coco_is_read_as_written(boxes in any_boxes()) {
        let labels = read(&write_coco(&boxes, &PAGE), "coco.json", &PAGE).expect("a valid file");
        prop_assert_eq!((labels.format, labels.warnings), (LabelFormat::Coco, vec![]));
        prop_assert_eq!(labels.boxes, boxes);
    }
}

#[test]
fn edited_labels_are_read_as_others_and_name_what_they_replace() {
    for path in [None, Some("more/labels.json".to_owned())] {
        let replaced = ReplacedLabels { path };
        let bytes = write_edited(&expected(), &PAGE, &replaced);
        let labels = read(&bytes, "b1-1.json", &PAGE).expect("a valid file");
        assert_eq!((labels.boxes, labels.warnings), (expected(), vec![]));
        assert_eq!(replaced_labels(&bytes), Some(replaced));
    }
    assert_eq!(replaced_labels(&write_via(&expected(), &PAGE)), None);
    assert_eq!(replaced_labels(b"no labels"), None);
}

#[test]
fn boxes_of_the_samples_stay_the_same() {
    for bytes in [
        write_via(&expected(), &PAGE),
        write_coco(&expected(), &PAGE),
    ] {
        let labels = read(&bytes, "labels.json", &PAGE).expect("a valid file");
        assert_eq!(labels.boxes, expected());
    }
}

#[test]
fn boxes_in_fractions_of_the_page_keep_their_edges_when_they_are_written() {
    let lines = "0 0.1234567 0.2345678 0.0311111 0.0422222\n0 0.5 0.37 0.0333333 0.05\n";
    let first = read(lines.as_bytes(), "page.txt", &PAGE).expect("YOLO");
    for bytes in [
        write_via(&first.boxes, &PAGE),
        write_coco(&first.boxes, &PAGE),
    ] {
        let again = read(&bytes, "labels.json", &PAGE).expect("a valid file");
        assert_eq!(again.boxes, first.boxes);
    }
}

#[test]
fn the_project_has_what_via_asks_for() {
    let bytes = write_via(&expected(), &PAGE);
    let project: Value = serde_json::from_slice(&bytes).expect("JSON");
    // VIA opens a file as a project if it has these three.
    for key in ["_via_settings", "_via_img_metadata", "_via_attributes"] {
        assert!(project[key].is_object(), "{key}");
    }
    assert_eq!(project["_via_image_id_list"][0], "page-03.jpg512345");
    let image = &project["_via_img_metadata"]["page-03.jpg512345"];
    assert_eq!(image["filename"], "page-03.jpg");
    let shape =
        serde_json::json!({"name": "rect", "x": 1400, "y": 100, "width": 100, "height": 120});
    assert_eq!(image["regions"][0]["shape_attributes"], shape);
    assert_eq!(
        image["regions"][0]["region_attributes"]["character"],
        "\u{5929}"
    );
    assert_eq!(
        image["regions"][2]["shape_attributes"]["all_points_y"][2],
        225
    );
}

#[test]
fn coco_has_boxes_polygons_and_areas() {
    let bytes = write_coco(&expected(), &PAGE);
    let file: Value = serde_json::from_slice(&bytes).expect("JSON");
    let annotations = file["annotations"].as_array().expect("a list");
    assert_eq!(
        annotations[0]["bbox"],
        serde_json::json!([1400, 100, 100, 120])
    );
    assert_eq!(annotations[0]["area"], 12_000);
    let triangle = serde_json::json!([[1250, 100, 1350, 150, 1280, 225]]);
    assert_eq!(annotations[2]["segmentation"], triangle);
    assert_eq!(annotations[2]["area"], 5500);
    assert_eq!(file["images"][0]["file_name"], "page-03.jpg");
    assert_eq!(file["categories"][1]["name"], "\u{20027}");
}

#[test]
fn a_box_around_the_first_pixel_is_written_from_its_corner() {
    let page = PageFile {
        name: "p.png",
        ..PAGE
    };
    let label = LabelBox::rectangle([-0.5, -0.5, 0.5, 0.5]);
    let file: Value =
        serde_json::from_slice(&write_coco(std::slice::from_ref(&label), &page)).expect("JSON");
    assert_eq!(
        file["annotations"][0]["bbox"],
        serde_json::json!([0, 0, 1, 1])
    );
    let labels = read(&write_via(&[label], &page), "via.json", &page).expect("valid");
    assert_eq!(bounds(&labels.boxes[0].outline), [-0.5, -0.5, 0.5, 0.5]);
}
