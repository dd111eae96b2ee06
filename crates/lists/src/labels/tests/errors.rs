//! The sentences of all errors.

use super::samples::{BBOXES, COCO, LABELME, PAGE, PAGE_XML, VIA_1, VIA_2, VIA_CSV, YOLO};
use crate::labels::model::PageFile;
use crate::labels::read;

/// Returns the messages of files that are refused, one per line.
fn messages(files: &[(&str, Vec<u8>)], page: &PageFile<'_>) -> String {
    let message = |(what, bytes): &(&str, Vec<u8>)| {
        let error = read(bytes, "labels.json", page).expect_err(what);
        format!("{what}:\n    {error}")
    };
    files.iter().map(message).collect::<Vec<_>>().join("\n")
}

fn text(text: impl Into<String>) -> Vec<u8> {
    text.into().into_bytes()
}

#[test]
fn content_of_no_known_format() {
    let files = [
        ("no bytes", vec![]),
        ("white space", text(" \n\t")),
        ("a picture", b"\x89PNG\r\n\x1a\n\0\0\0\xff".to_vec()),
        (
            "a pointer of Git LFS",
            text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"),
        ),
        ("UTF-16", b"\xff\xfe{\0}\0".to_vec()),
        ("Latin-1", b"filename,caf\xe9".to_vec()),
        ("other text", text("hello,\u{202e} world\n1 2 3")),
        ("two numbers per line", text("1 2\n3 4\n")),
        ("other keys", text(r#"{"boxes": [], "image": "a"}"#)),
        (
            "many keys",
            text(r#"{"a":1,"b":2,"c":3,"d":4,"e":5,"f":6,"g":7,"h":8,"i":9,"j":10}"#),
        ),
        ("a list of numbers", text("[1, 2]")),
        (
            "VIA 3",
            text(r#"{"project":{},"config":{},"attribute":{},"file":{},"metadata":{},"view":{}}"#),
        ),
        (
            "ALTO",
            text("<?xml version=\"1.0\"?><alto><Layout/></alto>"),
        ),
        ("HTML", text("<!DOCTYPE html><html></html>")),
        ("large", vec![b' '; (64 << 20) + 1]),
    ];
    insta::assert_snapshot!(messages(&files, &PAGE));
}

#[test]
fn damaged_files() {
    let half = |text: &str| {
        text.chars()
            .take(text.chars().count() / 2)
            .collect::<String>()
    };
    let files = [
        ("truncated JSON", text(half(VIA_2))),
        ("truncated XML", text(half(PAGE_XML))),
        (
            "truncated CSV",
            text(VIA_CSV.split_at(VIA_CSV.len() - 20).0),
        ),
        (
            "a row cut short",
            text(format!(
                "{}page-03.jpg,512345,\"{{}}\",3",
                VIA_CSV.replace('\n', "\r\n")
            )),
        ),
        ("NaN", text(BBOXES.replace("350.0", "NaN"))),
        (
            "negative infinity",
            text(BBOXES.replace("350.0", "-Infinity")),
        ),
        ("a comma at the end", text(BBOXES.replace("}]}", "},]}"))),
        (
            "a key twice",
            text(VIA_2.replace("page-04.jpg498000", "page-03.jpg512345")),
        ),
        (
            "crossed elements",
            text(PAGE_XML.replacen("</Word>", "</Glyph>", 1)),
        ),
        (
            "an unknown entity",
            text(PAGE_XML.replace("&#131111;", "&nom;")),
        ),
        ("XML without a page", text("<PcGts><Metadata/></PcGts>")),
        ("two pages in XML", text("<PcGts><Page/><Page/></PcGts>")),
        (
            "CSV without sizes",
            text(VIA_CSV.replace("file_size", "size")),
        ),
        (
            "YOLO with four numbers",
            text(format!("{YOLO}0 0.1 0.2 0.3\n")),
        ),
        ("YOLO with a word", text(format!("{YOLO}0 0.1 x 0.3 0.4\n"))),
        ("YOLO in pixels", text("0 417 220 30 40\n")),
        ("YOLO with nan", text("0 nan 0.5 0.1 0.1\n")),
    ];
    insta::assert_snapshot!(messages(&files, &PAGE));
}

#[test]
fn damaged_boxes() {
    let files = [
        ("no width", text(VIA_2.replace("\"width\":96,", ""))),
        (
            "null",
            text(VIA_2.replace("\"width\":96,", "\"width\":null,")),
        ),
        (
            "a number in quotes",
            text(VIA_2.replace("\"width\":96,", "\"width\":\"96\",")),
        ),
        (
            "too large",
            text(VIA_2.replace("\"width\":96,", "\"width\":1e300,")),
        ),
        ("unknown shape", text(VIA_2.replace("\"rect\"", "\"cube\""))),
        ("no shape", text(VIA_2.replace("shape_attributes", "shape"))),
        (
            "regions are a text",
            text(
                VIA_1
                    .replace("\"regions\":{", "\"regions\":\"\",\"r\":{")
                    .replace("{\"page-03", "{\"_via_img_metadata\":{\"page-03")
                    + "}",
            ),
        ),
        (
            "points that do not match",
            text(VIA_2.replace("[1250,1350,1280]", "[1250,1350]")),
        ),
        (
            "CSV cell",
            text(VIA_CSV.replacen("\"\"x\"\":1400", "\"\"x\"\":", 1)),
        ),
        ("no edge", text(BBOXES.replace("\"y_max\": 220, ", ""))),
        ("a box that is a list", text("{\"bboxes\": [[1, 2, 3, 4]]}")),
        (
            "COCO without a box",
            text(COCO.replacen("\"bbox\"", "\"box\"", 1)),
        ),
        (
            "COCO with three numbers",
            text(COCO.replace("[1400,100,100,120]", "[1400,100,100]")),
        ),
        (
            "COCO without an image",
            text(COCO.replace("\"image_id\":8,", "")),
        ),
        (
            "COCO with an id twice",
            text(COCO.replace("{\"id\":8", "{\"id\":\"7\"")),
        ),
        ("an odd polygon", text(COCO.replace("[[1250,", "[["))),
        (
            "labelme shape",
            text(LABELME.replace("\"polygon\"", "\"sphere\"")),
        ),
        (
            "labelme point",
            text(LABELME.replace("[1250.0,100.0]", "[1250.0]")),
        ),
        (
            "XML point",
            text(PAGE_XML.replace("1400,240 ", "1400;240 ")),
        ),
        (
            "a name with a slash",
            text(VIA_2.replace("c01-r02", "c01/r02")),
        ),
        ("a name twice", text(VIA_2.replace("c01-r02", "c01-r01"))),
        (
            "a name in other case",
            text(VIA_2.replace("c01-r02", "C01-r01")),
        ),
        (
            "a name in another form",
            text(
                VIA_2
                    .replace("c01-r01", "ch\u{1eef}")
                    .replace("c01-r02", "chu\u{31b}\u{303}"),
            ),
        ),
    ];
    insta::assert_snapshot!(messages(&files, &PAGE));
}

#[test]
fn labels_of_something_else() {
    let page = PageFile {
        name: "page-05.jpg",
        bytes: 1,
        ..PAGE
    };
    let files = [
        ("other pages", text(VIA_2)),
        ("other pages of COCO", text(COCO)),
        ("no images", text("{\"_via_img_metadata\": {}}")),
        ("an empty object", text("{}")),
        ("an empty list", text("[]")),
        ("no boxes", text("{\"bboxes\": []}")),
        (
            "XML without boxes",
            text("<PcGts><Page imageFilename=\"page-05.jpg\"/></PcGts>"),
        ),
        (
            "only points",
            text("{\"bboxes\": [{\"x_min\":1,\"y_min\":1,\"x_max\":1,\"y_max\":1}]}"),
        ),
        (
            "another shape",
            text(LABELME.replace("\"imageWidth\":1600", "\"imageWidth\":1800")),
        ),
        (
            "turned",
            text(
                LABELME
                    .replace(":1600", ":1")
                    .replace(":1000", ":1600")
                    .replace(":1}", ":1000}"),
            ),
        ),
        (
            "another shape in XML",
            text(PAGE_XML.replace("imageHeight=\"1000\"", "imageHeight=\"1011\"")),
        ),
        (
            "outside",
            text(
                "{\"bboxes\": [{\"x_min\":1,\"y_min\":1,\"x_max\":9,\"y_max\":9},\
            {\"x_min\":1700,\"y_min\":1,\"x_max\":1710,\"y_max\":9},{\"x_min\":1,\"y_min\":1001,\"x_max\":9,\"y_max\":1030}]}",
            ),
        ),
        (
            "one box outside",
            text("{\"bboxes\": [{\"x_min\":1700,\"y_min\":1,\"x_max\":1710,\"y_max\":9}]}"),
        ),
    ];
    let shown = messages(&files, &page);
    let named = PageFile {
        name: "page-03.jpg",
        ..page
    };
    let twice = VIA_2.replace(
        "\"filename\":\"page-04.jpg\"",
        "\"filename\":\"PAGE-03.jpg\"",
    );
    let empty = VIA_2.replace("\"regions\":[", "\"regions\":[],\"old\":[");
    let more = messages(
        &[
            ("a page twice", text(twice)),
            ("a page without boxes", text(empty)),
        ],
        &named,
    );
    insta::assert_snapshot!(format!("{shown}\n{more}"));
}
