//! Each format gives the same boxes.

use super::samples::{
    BBOXES, COCO, LABELME, PAGE, PAGE_XML, SAMPLES, VIA_1, VIA_2, VIA_CSV, expected,
};
use crate::labels::model::{LabelBox, LabelFormat, Labels};
use crate::labels::read;

fn read_sample(text: &str) -> Labels {
    read(text.as_bytes(), "labels", &PAGE).expect("a valid sample")
}

#[test]
fn all_formats_give_the_same_boxes() {
    for (k, (format, has_names, has_texts, text)) in SAMPLES.into_iter().enumerate() {
        let labels = read_sample(text);
        assert_eq!(labels.format, format, "sample {k}");
        assert_eq!(labels.warnings, [""; 0], "sample {k}");
        let expected = expected().into_iter().map(|label| LabelBox {
            name: label.name.clone().filter(|_| has_names),
            text: label.text.clone().filter(|_| has_texts),
            outline: match format {
                LabelFormat::Bboxes => LabelBox::rectangle(label.bounds()).outline,
                _ => label.outline,
            },
        });
        let expected: Vec<LabelBox> = expected.collect();
        // Fractions of YOLO are rounded.
        for (found, wanted) in labels.boxes.iter().zip(&expected) {
            let pairs = found
                .outline
                .iter()
                .flatten()
                .zip(wanted.outline.iter().flatten());
            let close = pairs.clone().all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(
                close && pairs.count() == 2 * wanted.outline.len(),
                "sample {k}: {found:?}"
            );
        }
        let without_outline = |label: &LabelBox| (label.name.clone(), label.text.clone());
        let found: Vec<_> = labels.boxes.iter().map(without_outline).collect();
        let wanted: Vec<_> = expected.iter().map(without_outline).collect();
        assert_eq!(found, wanted, "sample {k}");
    }
}

#[test]
fn a_byte_order_mark_and_white_space_are_skipped() {
    for (format, _, _, text) in SAMPLES {
        let labels = read_sample(&format!("\u{feff}\r\n {text}\n\n"));
        assert_eq!((labels.format, labels.boxes.len()), (format, 3));
    }
}

#[test]
fn csv_may_have_passed_through_a_spreadsheet() {
    let mut rows = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(VIA_CSV.as_bytes());
    let mut writer = csv::WriterBuilder::new()
        .delimiter(b';')
        .terminator(csv::Terminator::CRLF)
        .from_writer(Vec::new());
    for row in rows.records() {
        writer
            .write_record(&row.expect("a valid row"))
            .expect("memory takes any row");
    }
    let text = String::from_utf8(writer.into_inner().expect("memory")).expect("text");
    assert!(text.contains(";512345;"), "{text}");
    assert_eq!(read_sample(&text).boxes, expected());
}

#[test]
fn the_list_of_boxes_may_stand_alone() {
    let list = BBOXES
        .trim_start_matches("{\"bboxes\":")
        .trim_end_matches('}');
    assert_eq!(read_sample(list), read_sample(BBOXES));
}

#[test]
fn of_page_xml_the_smallest_elements_are_taken() {
    let words = PAGE_XML.replace("Glyph", "OtherGlyph");
    let names = |text: &str| -> Vec<Option<String>> {
        read_sample(text)
            .boxes
            .into_iter()
            .map(|label| label.name)
            .collect()
    };
    let some = |names: [&str; 2]| names.map(|name| Some(name.to_owned()));
    assert_eq!(names(&words), some(["w1", "w2"]));
    let lines = words.replace("Word", "OtherWord");
    assert_eq!(names(&lines), some(["l1", "l2"]));
    assert_eq!(
        read_sample(&lines).boxes[0].text.as_deref(),
        Some("\u{5929}\u{20027}")
    );
    assert_eq!(
        names(&lines.replace("TextLine", "OtherLine")),
        [Some("r1".to_owned())]
    );
    let prefixed = PAGE_XML.replace("</", "</pc:").replace('<', "<pc:");
    let prefixed = prefixed
        .replace("<pc:/", "</")
        .replace("<pc:?", "<?")
        .replace("<pc:!", "<!");
    assert_eq!(read_sample(&prefixed).boxes, expected());
}

#[test]
fn classes_that_are_no_characters_are_not_texts() {
    for text in [
        COCO.replace('\u{5929}', "Character"),
        LABELME.replace('\u{5929}', "char"),
    ] {
        let boxes = read_sample(&text).boxes;
        assert_eq!(boxes[0].text, None);
        assert_eq!(boxes[2].text.as_deref(), Some("\u{5730}"));
    }
}

#[test]
fn attributes_are_texts_in_order_of_preference() {
    let with = |attributes: &str| {
        let file = format!(
            "{{\"page-03.jpg1\":{{\"filename\":\"page-03.jpg\",\"regions\":[{{\"shape_attributes\":\
             {{\"name\":\"rect\",\"x\":1,\"y\":1,\"width\":9,\"height\":9}},\"region_attributes\":{attributes}}}]}}}}"
        );
        let label = read_sample(&file).boxes.swap_remove(0);
        (label.name, label.text)
    };
    let some = |text: &str| Some(text.to_owned());
    assert_eq!(
        with(r#"{"label": "a", "TEXT": " \u5929 ", "name": "n", "id": ""}"#),
        (some("n"), some("\u{5929}"))
    );
    assert_eq!(
        with(r#"{"label": {"a": true}, "transcription": "b", "id": 12}"#),
        (some("12"), some("b"))
    );
    assert_eq!(with("null"), (None, None));
    assert_eq!(with(r#"{"text": "  "}"#), (None, None));
    // Names are composed, characters are kept as they are.
    assert_eq!(
        with(r#"{"id": "chu\u031b\u0303", "char": "\uf91d"}"#),
        (some("ch\u{1eef}"), some("\u{f91d}"))
    );
}

#[test]
fn whole_numbers_with_decimals_are_names_without() {
    for text in [BBOXES, VIA_2, COCO] {
        let named = |number: &str| text.replacen("\"c01-r01\"", number, 1);
        let labels = read_sample(&named("117.0"));
        assert!(
            labels
                .boxes
                .iter()
                .any(|label| label.name.as_deref() == Some("117"))
        );
        assert_eq!(labels.boxes, read_sample(&named("117")).boxes);
        let large = named("9007199254740993.0");
        let refused = read(large.as_bytes(), "labels", &PAGE).expect_err("refused");
        let reason =
            "box 1: the number 9007199254740992.0 is too large to be exact; correct or remove it";
        assert!(refused.to_string().contains(reason), "{refused}");
    }
}

#[test]
fn coco_boxes_need_no_polygon_and_may_have_several() {
    let two = "[[1250,100,1350,150,1280,225],[1,1,5,5,9,2]]";
    let several = COCO.replace("[[1250,100,1350,150,1280,225]]", two);
    let run_lengths = COCO.replace(
        "[[1250,100,1350,150,1280,225]]",
        "{\"size\":[1000,1600],\"counts\":\"0a\"}",
    );
    for text in [several, run_lengths] {
        let last = read_sample(&text).boxes.swap_remove(2);
        assert!(last.is_rectangle(), "{last:?}");
        assert_eq!(last.bounds(), [1249.5, 99.5, 1349.5, 224.5]);
    }
    let ids = COCO
        .replace("\"id\":7", "\"id\":\"p3\"")
        .replace("\"image_id\":7", "\"image_id\":\"p3\"");
    assert_eq!(read_sample(&ids).boxes, expected());
}

#[test]
fn ids_of_coco_are_equal_as_numbers_and_as_text() {
    for (from, to) in [
        ("\"image_id\":7", "\"image_id\":\"7\""),
        ("\"image_id\":7", "\"image_id\":7.0"),
        ("\"image_id\":7", "\"image_id\":\"pages/page-03.jpg\""),
        ("{\"id\":7", "{\"id\":\"7\""),
        ("\"category_id\":2", "\"category_id\":\"2\""),
        ("{\"id\":2,\"name\"", "{\"id\":\"2\",\"name\""),
    ] {
        assert!(COCO.contains(from), "{from}");
        assert_eq!(
            read_sample(&COCO.replace(from, to)).boxes,
            expected(),
            "{to}"
        );
    }
    let other = read_sample(&COCO.replace("\"image_id\":8", "\"image_id\":9"));
    assert_eq!(other.boxes, expected());
    assert_eq!(
        other.warnings,
        ["labels: 1 box left out, whose image_id is that of no image"]
    );
}

#[test]
fn the_page_is_found_by_its_name_in_versions_of_via() {
    for text in [VIA_1, VIA_2] {
        let renamed = text.replace("\"filename\":\"page-03.jpg\",", "");
        assert_eq!(read_sample(&renamed).boxes, expected());
    }
    let from_address = VIA_2
        .replace("512345", "-1")
        .replace("\"page-03.jpg\"", "\"https://example.org/a/page-03.jpg\"");
    let labels = read_sample(&from_address);
    assert_eq!((labels.boxes, labels.warnings), (expected(), vec![]));
}

#[test]
fn a_line_with_the_separator_and_old_line_ends_do_not_change_csv() {
    let plain = read(VIA_CSV.as_bytes(), "via.csv", &PAGE).expect("labels");
    for text in [
        format!("sep=,\n{VIA_CSV}"),
        format!("\"sep=,\"\n{VIA_CSV}"),
        format!("sep=;\n\nsep=,\n{VIA_CSV}"),
        format!("Sep = ,\r\n{}", VIA_CSV.replace('\n', "\r\n")),
        VIA_CSV.replace('\n', "\r"),
    ] {
        let labels = read(text.as_bytes(), "via.csv", &PAGE).expect("labels");
        assert_eq!(labels.boxes, plain.boxes, "{text}");
    }
}
