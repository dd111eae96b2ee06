//! Limits that are checked while labels are parsed, before their boxes take memory.

use super::samples::PAGE;
use crate::labels::error::LabelsProblem;
use crate::labels::page_fit::{MAX_BOXES, MAX_CORNERS};
use crate::labels::read;

fn problem(text: &str) -> LabelsProblem {
    let error = read(text.as_bytes(), "labels", &PAGE).expect_err("over a limit");
    error.problem
}

/// Returns one item more than a page may have boxes.
fn too_many(item: &str, separator: &str) -> String {
    vec![item; MAX_BOXES + 1].join(separator)
}

/// None of the items is a valid box, except in formats whose items are read one after another, so a parser that reads
/// boxes before it counts them reports another problem.
#[test]
fn more_boxes_than_a_page_can_have_are_refused_in_every_format_before_they_are_read() {
    let limit = MAX_BOXES;
    let bboxes = format!("[{{\"x_min\":0}},{}]", too_many("{}", ","));
    let in_object = format!("{{\"bboxes\":[{}]}}", too_many("{}", ","));
    let labelme = format!("{{\"shapes\":[{}]}}", too_many("{}", ","));
    let coco = format!(
        "{{\"images\":[{{\"id\":1}}],\"annotations\":[{}]}}",
        too_many(r#"{"image_id":1}"#, ",")
    );
    let via_2 = format!(
        "{{\"a\":{{\"filename\":\"a\",\"regions\":[{}]}}}}",
        too_many("{}", ",")
    );
    let numbered = (0..=MAX_BOXES).map(|k| format!("\"{k}\":{{}}"));
    let via_1 = format!(
        "{{\"a\":{{\"filename\":\"a\",\"regions\":{{{}}}}}}}",
        numbered.collect::<Vec<_>>().join(",")
    );
    let row = r#"a,1,{},1,0,"{""name"":""rect"",""x"":1,""y"":1,""width"":5,""height"":5}",{}"#;
    let csv = format!(
        "filename,file_size,file_attributes,region_count,region_id,region_shape_attributes,region_attributes\n{}",
        too_many(row, "\n")
    );
    let yolo = too_many("0 .5 .5 .1 .1", "\n");
    let xml = format!("<PcGts><Page>{}</Page></PcGts>", too_many("<Glyph/>", ""));
    for text in [
        bboxes, in_object, labelme, coco, via_2, via_1, csv, yolo, xml,
    ] {
        let beginning = text.chars().take(60).collect::<String>();
        assert_eq!(
            problem(&text),
            LabelsProblem::TooManyBoxes { limit },
            "{beginning}"
        );
    }
}

#[test]
fn json_that_would_take_hundreds_of_megabytes_is_refused_before_it_is_built() {
    let numbers = "0,".repeat(9 << 20);
    let refused = problem(&format!("{{\"a\":[{numbers}0]}}"));
    assert!(
        matches!(refused, LabelsProblem::TooManyValues { .. }),
        "{refused}"
    );
    let objects = "{},".repeat(700_000);
    let refused = problem(&format!("{{\"a\":[{objects}{{\"b\":0}}]}}"));
    // Empty objects take little.
    assert!(
        matches!(refused, LabelsProblem::UnknownJson(_)),
        "{refused}"
    );
    let objects = r#"{"b":0},"#.repeat(700_000);
    let refused = problem(&format!("{{\"a\":[{objects}{{\"b\":0}}]}}"));
    assert!(
        matches!(refused, LabelsProblem::TooManyValues { .. }),
        "{refused}"
    );
}

#[test]
fn outlines_with_more_corners_than_a_character_can_have_are_refused() {
    let yolo = format!("0{}", " .1 .2".repeat(MAX_CORNERS + 1));
    let points = "1,2 ".repeat(MAX_CORNERS + 1);
    let coords = format!(
        "<PcGts><Page><Glyph id=\"g\"><Coords points=\"{points}\"/></Glyph></Page></PcGts>"
    );
    let single = "<Point x=\"1\" y=\"2\"/>".repeat(MAX_CORNERS + 1);
    let old =
        format!("<PcGts><Page><Glyph id=\"g\"><Coords>{single}</Coords></Glyph></Page></PcGts>");
    for text in [yolo, coords, old] {
        let refused = problem(&text);
        assert!(
            matches!(refused, LabelsProblem::TooManyCorners { .. }),
            "{refused}"
        );
    }
}

#[test]
fn outlines_with_more_numbers_than_are_kept_at_once_are_refused() {
    let outline = format!("0{}\n", " 0 0".repeat(MAX_CORNERS));
    let refused = problem(&outline.repeat(40)).to_string();
    let expected = "line 32: the file has more than 6400000 numbers up to here";
    assert!(refused.contains(expected), "{refused}");
}

#[test]
fn boxes_that_cover_the_page_again_and_again_are_refused() {
    let boxes: Vec<String> = (0..40)
        .map(|k| {
            let [right, bottom] =
                [PAGE.width, PAGE.height].map(|side| f64::from(side) - 0.1 * f64::from(k));
            format!("{{\"x_min\":0,\"y_min\":0,\"x_max\":{right},\"y_max\":{bottom}}}")
        })
        .collect();
    let refused = problem(&format!("[{}]", boxes.join(",")));
    assert!(
        matches!(refused, LabelsProblem::Overlap { .. }),
        "{refused}"
    );
    let few = format!("[{}]", boxes[..20].join(","));
    assert!(read(few.as_bytes(), "labels", &PAGE).is_ok());
}
