//! Labels that do not quite fit their page, and the warnings.

use super::samples::{COCO, LABELME, PAGE, VIA_2, expected};
use crate::labels::model::{LabelBox, Labels, PageFile};
use crate::labels::read;

fn boxes_file(boxes: &[[f64; 4]]) -> String {
    let one = |[x0, y0, x1, y1]: &[f64; 4]| {
        format!("{{\"x_min\":{x0},\"y_min\":{y0},\"x_max\":{x1},\"y_max\":{y1}}}")
    };
    let boxes = boxes.iter().map(one).collect::<Vec<_>>().join(",");
    format!("{{\"bboxes\":[{boxes}]}}")
}

fn read_boxes(boxes: &[[f64; 4]]) -> Labels {
    read(boxes_file(boxes).as_bytes(), "b.json", &PAGE).expect("valid labels")
}

fn bounds(labels: &Labels) -> Vec<[f64; 4]> {
    labels.boxes.iter().map(LabelBox::bounds).collect()
}

#[test]
fn labels_of_a_reduced_image_are_scaled() {
    let page = PageFile {
        width: 3200,
        height: 2001,
        ..PAGE
    };
    for text in [COCO, LABELME] {
        let labels = read(text.as_bytes(), "l.json", &page).expect("the same shape");
        assert_eq!(
            labels.warnings,
            [
                "l.json: the labels are for an image of 1600 x 1000 px, the page is 3200 x 2001 px; the boxes were scaled"
            ]
        );
        let [x0, y0, x1, y1] = labels.boxes[0].bounds();
        assert_eq!([x0, x1], [2799.5, 2999.5]);
        assert!((y0 - (200.1 - 0.5)).abs() < 1e-9 && (y1 - (440.22 - 0.5)).abs() < 1e-9);
    }
}

#[test]
fn another_page_file_is_noticed() {
    let page = PageFile {
        name: "other.png",
        bytes: 512_346,
        ..PAGE
    };
    let single = VIA_2.replace(
        "\"page-04.jpg498000\":{\"filename\":\"page-04.jpg\",\"size\":498000,\"regions\":[",
        "\"x\":{\"regions\":[],\"y\":[",
    );
    let labels = read(single.as_bytes(), "via.json", &page).expect("the only page with boxes");
    assert_eq!(labels.boxes, expected());
    assert_eq!(
        labels.warnings,
        [
            "via.json: the labels are of \"page-03.jpg\", the page is \"other.png\"",
            "via.json: the labels were made for a file of 512345 bytes, the page has 512346",
        ]
    );
    let copied = PageFile {
        bytes: 512_345,
        ..page
    };
    let labels = read(single.as_bytes(), "via.json", &copied).expect("a copy of the page");
    assert_eq!(labels.warnings, [""; 0]);
}

#[test]
fn boxes_outside_are_left_out_and_named() {
    let labels = read_boxes(&[
        [10.0, 10.0, 60.0, 60.0],
        [1700.0, 10.0, 1760.0, 60.0],
        [-20.0, 100.0, 30.0, 140.0],
        [-30.0, 200.0, 20.0, 240.0],
        [100.0, 980.0, 150.0, 1010.0],
    ]);
    assert_eq!(
        bounds(&labels),
        [
            [9.5, 9.5, 59.5, 59.5],
            [-0.5, 99.5, 29.5, 139.5],
            [99.5, 979.5, 149.5, 999.5]
        ]
    );
    let expected = [
        "b.json: 2 of 5 boxes lie outside the page and were left out: box 2, box 4",
        "b.json: 2 boxes reach over an edge of the page and were cut there: box 3, box 5",
    ];
    assert_eq!(labels.warnings, expected);
}

#[test]
fn repeated_boxes_are_kept_once() {
    let labels = read_boxes(&[
        [10.0, 10.0, 60.0, 60.0],
        [100.0, 10.0, 160.0, 60.0],
        [60.0, 60.0, 10.001, 10.0],
    ]);
    assert_eq!(
        bounds(&labels),
        [[9.5, 9.5, 59.5, 59.5], [99.5, 9.5, 159.5, 59.5]]
    );
    assert_eq!(
        labels.warnings,
        ["b.json: 1 box repeats another and was left out: box 3 as box 1"]
    );
    let file = "{\"bboxes\":[{\"x_min\":1,\"y_min\":1,\"x_max\":9,\"y_max\":9,\"id\":\"a\"},\
        {\"x_min\":1,\"y_min\":1,\"x_max\":9,\"y_max\":9,\"id\":\"a\",\"char\":\"\u{5929}\"}]}";
    let labels = read(file.as_bytes(), "b.json", &PAGE).expect("the same box twice");
    assert_eq!(labels.boxes.len(), 1);
    assert_eq!(labels.boxes[0].text.as_deref(), Some("\u{5929}"));
}

#[test]
fn empty_boxes_and_points_are_left_out() {
    let labels = read_boxes(&[
        [5.0, 5.0, 5.0, 30.0],
        [1.0, 1.0, 9.0, 9.0],
        [7.0, 7.0, 7.9, 9.0],
    ]);
    assert_eq!(bounds(&labels), [[0.5, 0.5, 8.5, 8.5]]);
    let expected = "b.json: 2 boxes are smaller than a pixel, a point or a line and were left out: box 1, box 3";
    assert_eq!(labels.warnings, [expected]);
}

#[test]
fn corners_in_place_of_width_and_height_are_named() {
    let corners = [
        [1400, 850, 1490, 940],
        [1500, 800, 1590, 890],
        [1500, 900, 1590, 990],
    ];
    let annotation = |bbox: &[i32; 4]| serde_json::json!({"image_id": 1, "bbox": bbox});
    let coco = serde_json::json!({
        "images": [{"id": 1, "file_name": PAGE.name, "width": PAGE.width, "height": PAGE.height}],
        "annotations": corners.iter().map(annotation).collect::<Vec<_>>(),
    });
    let line = |[x0, y0, x1, y1]: &[i32; 4]| {
        let x = |x: &i32| f64::from(*x) / f64::from(PAGE.width);
        let y = |y: &i32| f64::from(*y) / f64::from(PAGE.height);
        format!("0 {} {} {} {}\n", x(x0), y(y0), x(x1), y(y1))
    };
    let yolo: String = corners.iter().map(line).collect();
    for text in [coco.to_string(), yolo] {
        let refused = read(text.as_bytes(), "l", &PAGE)
            .expect_err("outside")
            .to_string();
        assert!(
            refused.contains("as two corners, their numbers fit the page"),
            "{refused}"
        );
    }
    let other = boxes_file(&[[5000.0, 100.0, 5100.0, 200.0]]);
    let refused = read(other.as_bytes(), "l", &PAGE)
        .expect_err("outside")
        .to_string();
    assert!(refused.ends_with("labels of another page?"), "{refused}");
}

#[test]
fn boxes_that_are_cut_at_an_edge_are_named() {
    let labels = read_boxes(&[[-9.0, 2.0, 30.0, 30.0], [-0.9, 40.0, 30.0, 70.0]]);
    assert_eq!(bounds(&labels)[0], [-0.5, 1.5, 29.5, 29.5]);
    let expected = "b.json: 1 box reaches over an edge of the page and was cut there: box 1";
    assert_eq!(labels.warnings, [expected]);
}

#[test]
fn many_names_are_counted() {
    let mut boxes = vec![[1700.0, 0.0, 1800.0, 50.0]; 12];
    for (k, edges) in boxes.iter_mut().enumerate() {
        edges[1] = -(k as f64);
    }
    boxes.extend((0..20).map(|k| [0.0, 40.0 * f64::from(k), 30.0, 40.0 * f64::from(k) + 30.0]));
    let warning = read_boxes(&boxes).warnings.swap_remove(0);
    assert!(warning.ends_with("box 7, box 8 and 4 more"), "{warning}");
}

#[test]
fn boxes_in_fractions_are_named() {
    let size = serde_json::json!({"id": 1, "file_name": PAGE.name, "width": PAGE.width, "height": PAGE.height});
    let coco = serde_json::json!({
        "images": [size],
        "annotations": [{"image_id": 1, "bbox": [0.5, 0.1, 0.06, 0.1]}, {"image_id": 1, "bbox": [0.5, 0.3, 0.06, 0.1]}],
    });
    let bboxes = boxes_file(&[[0.5, 0.1, 0.56, 0.2], [0.5, 0.3, 0.56, 0.4]]);
    for text in [coco.to_string(), bboxes] {
        let refused = read(text.as_bytes(), "l", &PAGE)
            .expect_err("fractions")
            .to_string();
        assert!(
            refused.contains("they look like fractions of the page"),
            "{refused}"
        );
    }
    let points = boxes_file(&[[0.5, 0.5, 0.5, 0.5]]);
    let refused = read(points.as_bytes(), "l", &PAGE)
        .expect_err("a point")
        .to_string();
    assert!(refused.contains("the file has no boxes"), "{refused}");
}
