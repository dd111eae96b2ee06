//! YOLO text with more columns than a box or an outline.

use super::samples::PAGE;
use crate::labels::model::Labels;
use crate::labels::read;

/// Returns labels of eight boxes in two columns of a page; each line ends with what `more` adds to its number.
fn boxes(more: impl Fn(usize) -> String) -> String {
    let line = |k: usize| {
        let (x, y) = (0.8 - 0.1 * (k / 4) as f64, 0.2 + 0.15 * (k % 4) as f64);
        format!("0 {x} {y} 0.06 0.1{}\n", more(k))
    };
    (0..8).map(line).collect()
}

fn labels(text: &str) -> Labels {
    read(text.as_bytes(), "b.txt", &PAGE).expect(text)
}

fn refusal(text: &str) -> String {
    let error = read(text.as_bytes(), "b.txt", &PAGE).expect_err(text);
    error.to_string()
}

/// Returns the boxes around the outlines in whole pixels.
fn bounds(labels: &Labels) -> Vec<[i64; 4]> {
    let boxes = labels.boxes.iter();
    boxes
        .map(|label| label.bounds().map(|edge| edge.round() as i64))
        .collect()
}

#[test]
fn a_confidence_and_the_id_of_a_track_do_not_change_boxes() {
    let plain = labels(&boxes(|_| String::new()));
    assert_eq!(plain.boxes.len(), 8);
    for text in [
        boxes(|k| format!(" 0.9{k}")),
        boxes(|k| format!(" {}", k + 1)),
        boxes(|k| format!(" 0.9{k} {}", k + 1)),
        boxes(|_| " 1 1".to_owned()),
        boxes(|k| format!(" {} {}", k % 2, k % 2)),
        boxes(|k| {
            if k % 2 == 0 {
                String::new()
            } else {
                " 0.5".to_owned()
            }
        }),
    ] {
        assert_eq!(bounds(&labels(&text)), bounds(&plain), "{text}");
    }
}

#[test]
fn outlines_keep_their_corners_beside_confidences_and_ids() {
    let triangle = |x: f64| format!("0 {x} 0.2 {} 0.2 {x} 0.31", x + 0.05);
    let square = |x: f64| format!("0 {x} 0.2 {} 0.2 {} 0.3 {x} 0.3", x + 0.05, x + 0.05);
    let file = |more: [&str; 2]| {
        let [a, b] = more;
        format!("{}{a}\n{}{b}\n", triangle(0.5), square(0.7))
    };
    let plain = labels(&file(["", ""]));
    assert_eq!(plain.boxes[0].outline.len(), 3);
    for more in [
        [" 0.5", " 0.75"],
        [" 17", " 18"],
        [" 0.5 1", " 0.5 2"],
        [" 0 1", " 0 0"],
    ] {
        assert_eq!(labels(&file(more)).boxes, plain.boxes, "{more:?}");
    }
    // A box is one beside outlines, too.
    let mixed = format!("{}0 0.5 0.5 0.1 0.1\n", file(["", ""]));
    assert_eq!(labels(&mixed).boxes.len(), 3);
    // The last corner is the corner of the page.
    let corner = "0 0.9 1 0.9 0.9 1 1\n";
    assert_eq!(bounds(&labels(corner)), [[1440, 900, 1600, 1000]]);
}

#[test]
fn lines_that_are_neither_boxes_nor_outlines_are_refused() {
    let text = boxes(|_| String::new());
    let with = |line: &str| refusal(&format!("{text}{line}\n"));
    let sentences = [
        with("0 .5 .2 .6 .2 .6 .3 .5 .3\n0 .5 .2 .6 .2 .6 .3 .5"),
        with("0 .5 .2 .6 .2 .6\n0 .5 .2 .6 .2 .6 .3"),
        with("0 .5 .2 .6 .2 -.6"),
        with("0 .5 .2 .6 .2 .6 .3 1.25"),
        with("0.5 .2 .6 .2 .9"),
        with("0 .5 .5 .4 .4 1 1"),
        refusal(&boxes(|_| " 0.1 0.1".to_owned())),
        refusal(&boxes(|_| " 0.5 3 0.1".to_owned())),
        refusal(&boxes(|k| format!(" 0.5 0.5 2 0.{k} 0.5 2 0.5 0.6 1"))),
        refusal(&boxes(|k| format!(" 0.5 0.5 0.{k} 0.6"))),
    ];
    insta::assert_snapshot!(sentences.join("\n"));
}

#[test]
fn lines_that_end_with_a_carriage_return_alone_are_lines() {
    let plain = boxes(|_| String::new());
    for text in [plain.replace('\n', "\r"), plain.replacen('\n', "\r", 3)] {
        assert_eq!(bounds(&labels(&text)), bounds(&labels(&plain)));
    }
    let damaged = plain.replacen('\n', "\r0 0.5 x 0.1 0.1\r", 2);
    assert!(refusal(&damaged).contains("line 2: \"x\" is not a number"));
}

#[test]
fn points_of_a_pose_are_no_outline_though_a_box_is_near_the_corner() {
    let near = "0 0.01 0.01 0.02 0.02";
    for points in [
        " 0.5 0.4",
        " 0.5 0.4 0.52 0.41",
        " 0.5 0.4 0.52 0.41 0.53 0.44 0.5 0.46",
    ] {
        let near_points = points.replace("0.5", "0.01").replace("0.4", "0.01");
        let text = format!("{}{near}{near_points}\n", boxes(|_| points.to_owned()));
        let columns = 5 + points.split_whitespace().count();
        let reason = format!("the first 5 of {columns} columns are a box");
        let refused = refusal(&text);
        assert!(refused.contains(&reason), "{points}: {refused}");
    }
}
