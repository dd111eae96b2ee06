//! Workbooks as spreadsheet programs write them, and damaged ones.

use proptest::prelude::{ProptestConfig, any, proptest};
use proptest::sample::Index;

use super::test_helpers::{archive, text_rows, workbook};
use super::{WorkbookError, is_workbook, read_sheet};
use crate::manifest::{parse_csv, read_csv};

const STRINGS: &str = "<sst count=\"9\"><si><t>id</t></si><si><t xml:space=\"preserve\">mesh </t></si>\
    <si><r><t>pr</t></r><r><rPr><b/></rPr><t>int</t></r><rPh sb=\"0\"><t>reading</t></rPh></si>\
    <si><t>stl/1, \"a\" &amp; b.stl</t></si><si><t>x&#10;y</t></si><si/></sst>";

const STYLES: &str = "<styleSheet><numFmts><numFmt numFmtId=\"164\" formatCode=\"0000\"/></numFmts>\
    <cellStyleXfs><xf numFmtId=\"14\"/></cellStyleXfs>\
    <cellXfs><xf numFmtId=\"0\"/><xf numFmtId=\"164\"/><xf numFmtId=\"14\"/></cellXfs></styleSheet>";

/// A sheet with all kinds of cells, a gap of rows, and a value and an empty string beside the table.
const ROWS: &str = "<row r=\"2\"><c r=\"A2\" t=\"s\"><v>0</v></c><c r=\"B2\" t=\"s\"><v>1</v></c><c r=\"C2\" t=\"s\"><v>2</v></c>\
    <c r=\"D2\" t=\"str\"><f>A1</f><v>made</v></c><c r=\"E2\" t=\"inlineStr\"><is><t>seen</t></is></c>\
    <c r=\"F2\" t=\"str\"><v>note</v></c></row>\
    <row r=\"3\"/>\
    <row r=\"5\"><c r=\"A5\" s=\"1\"><v>117</v></c><c r=\"B5\" t=\"s\"><v>3</v></c><c r=\"C5\" t=\"str\"><v>p.png&#10;</v></c>\
    <c r=\"D5\" s=\"2\"><v>46347</v></c><c r=\"E5\" t=\"b\"><v>1</v></c><c r=\"F5\" t=\"s\"><v>4</v></c><c r=\"XFD5\"><v>9</v></c></row>\
    <row r=\"6\"><c r=\"A6\"><v>12</v></c><c r=\"C6\" t=\"s\"><v>5</v></c><c r=\"D6\"><v>0.25</v></c>\
    <c r=\"G6\" t=\"s\"><v>5</v></c></row>";

fn csv(bytes: &[u8]) -> String {
    let table = read_sheet(bytes, None).expect("a sheet");
    String::from_utf8(table.csv).expect("UTF-8")
}

fn refusal(bytes: &[u8]) -> String {
    read_sheet(bytes, None).expect_err("refused").to_string()
}

#[test]
fn a_sheet_becomes_lines_with_the_numbers_of_its_rows() {
    let bytes = workbook(&[("Sheet1", ROWS)], STRINGS, STYLES);
    assert!(is_workbook(&bytes));
    assert_eq!(
        csv(&bytes),
        "\n\"id\",\"mesh \",\"print\",\"made\",\"seen\",\"note\"\n\n\n\
         \"0117\",\"stl/1, \"\"a\"\" & b.stl\",\"p.png \",\"2026-11-21\",\"true\",\"x y\"\n\"12\",,,\"0.25\",,\n"
    );
    let warning = read_sheet(&bytes, None).expect("a sheet").warning;
    assert_eq!(
        warning.as_deref(),
        Some(
            "a value in a column without a name is left out, on line 5; name the column to keep it"
        )
    );
    let rows = parse_csv(csv(&bytes).as_bytes()).expect_err("a row without files");
    assert_eq!(
        rows.to_string(),
        "line 6: mesh is empty\nline 6: print is empty"
    );
}

#[test]
fn cells_without_places_follow_each_other_also_after_empty_ones() {
    let rows = "<row><c t=\"s\"><v>0</v></c><c t=\"s\"><v>1</v></c><c t=\"s\"><v>2</v></c></row>\
        <row><c><v>7</v></c><c/><c><v>9</v></c></row>";
    let bytes = workbook(&[("a", rows)], STRINGS, "");
    assert_eq!(csv(&bytes), "\"id\",\"mesh \",\"print\"\n\"7\",,\"9\"\n");
}

#[test]
fn ids_and_paths_are_on_one_line() {
    for (header, is_refused) in [
        ("Mã số", true),
        ("bản\nquét", true),
        ("page", true),
        ("pair", true),
        ("block", true),
        ("Ảnh trang", true),
        ("Nhãn", true),
        ("character", false),
        ("note", false),
    ] {
        let rows = format!(
            "<row r=\"1\"><c t=\"str\"><v>unit</v></c><c t=\"str\"><v>{header}</v></c></row>\
             <row r=\"2\"><c t=\"str\"><v>mm</v></c><c t=\"str\"><v>a&#10;b</v></c></row>"
        );
        let bytes = workbook(&[("a", &rows)], STRINGS, "");
        if is_refused {
            let shown = header.replace('\n', " ");
            let expected =
                format!("cell B2 of column \"{shown}\" has a line break; write it on one line");
            assert_eq!(refusal(&bytes), expected);
        } else {
            assert!(csv(&bytes).ends_with("\"mm\",\"a b\"\n"), "{header}");
        }
    }
}

#[test]
fn the_header_below_a_title_is_named() {
    let title: &[&str] = &["Danh sách của ván 4", "2026"];
    let row = text_rows(&[title, &["id", "mesh", "print"], &["1", "a.stl", "a.png"]]);
    let bytes = workbook(&[("a", &row)], "", "");
    assert_eq!(
        csv(&bytes),
        "\"Danh sách của ván 4\",\"2026\"\n\"id\",\"mesh\",\"print\"\n\"1\",\"a.stl\",\"a.png\"\n"
    );
    let refused = parse_csv(csv(&bytes).as_bytes()).expect_err("a title");
    let sentence = "line 2 has these columns; remove the lines above it";
    assert!(refused.to_string().ends_with(sentence), "{refused}");
}

#[test]
fn ids_that_became_dates_or_powers_of_ten_are_refused_and_other_columns_are_not() {
    let styles = "<styleSheet><cellXfs><xf numFmtId=\"0\"/><xf numFmtId=\"16\"/><xf numFmtId=\"11\"/>\
        <xf numFmtId=\"2\"/></cellXfs></styleSheet>";
    let sheet = |header: &str, style: u32| {
        let cell = format!("<c t=\"inlineStr\"><is><t>{header}</t></is></c>");
        let rows = format!("<row>{cell}</row><row><c s=\"{style}\"><v>46115</v></c></row>");
        workbook(&[("a", &rows)], "", styles)
    };
    for header in ["id", "Mã số", "Pair", "khối", "mesh"] {
        for (style, kind) in [(1, "a date, 2026-04-03; "), (2, "a power of ten, 46115; ")] {
            let refused = refusal(&sheet(header, style));
            let start = format!("cell A2 of column \"{header}\" is {kind}the spreadsheet");
            assert!(refused.starts_with(&start), "{refused}");
        }
        assert_eq!(
            csv(&sheet(header, 3)),
            format!("\"{header}\"\n\"46115.00\"\n")
        );
    }
    let cell = "<row><c s=\"1\"><v>46115</v></c></row>";
    let header = "<row><c t=\"inlineStr\"><is><t>id</t></is></c></row>";
    let rows = |number: usize| {
        workbook(
            &[("a", &(header.to_owned() + &cell.repeat(number)))],
            "",
            styles,
        )
    };
    let two = refusal(&rows(2));
    let lines: Vec<&str> = two.lines().collect();
    assert_eq!((lines.len(), lines[0]), (3, "2 cells cannot be read:"));
    assert!(
        lines[1].starts_with("cell A2 ") && lines[2].starts_with("cell A3 "),
        "{two}"
    );
    let many = refusal(&rows(12));
    assert!(
        many.starts_with("12 cells cannot be read:\ncell A2 "),
        "{many}"
    );
    assert!(many.ends_with("\nand 2 more"), "{many}");
    assert_eq!(csv(&sheet("at", 1)), "\"at\"\n\"2026-04-03\"\n");
    assert_eq!(csv(&sheet("weight", 2)), "\"weight\"\n\"46115\"\n");
}

/// Returns a workbook of a table with an id, files and a block in each row, and of these merged cells.
fn with_merged(rows: &[&[&str]], areas: &[&str]) -> Vec<u8> {
    let areas = areas.join("\"/><mergeCell ref=\"");
    let rows = text_rows(rows);
    // The helper writes the rows into the element that ends here.
    let sheet = format!(
        "{rows}</sheetData><mergeCells><mergeCell ref=\"{areas}\"/></mergeCells><sheetData>"
    );
    workbook(&[("a", &sheet)], "", "")
}

#[test]
fn cells_merged_over_rows_all_have_the_value_of_the_first() {
    let rows: [&[&str]; 6] = [
        &["id", "mesh", "print", "block", "folio"],
        &["1", "a", "a", "tale 1", "3a"],
        &["2", "b", "b", "", ""],
        &["", "", "", "", ""],
        &["3", "c", "c"],
        &["4", "d", "d", "", "4"],
    ];
    let bytes = with_merged(&rows, &["D2:D5", "E2:E3", "E6", "A1:A1"]);
    assert_eq!(
        csv(&bytes),
        "\"id\",\"mesh\",\"print\",\"block\",\"folio\"\n\
         \"1\",\"a\",\"a\",\"tale 1\",\"3a\"\n\"2\",\"b\",\"b\",\"tale 1\",\"3a\"\n\n\
         \"3\",\"c\",\"c\",\"tale 1\",\n\"4\",\"d\",\"d\",,\"4\"\n"
    );
}

#[test]
fn values_below_merged_cells_are_left_out_with_a_warning() {
    let rows: [&[&str]; 6] = [
        &["Khối 4", "page", "unit"],
        &["id", "mesh", "print", "block", "folio"],
        &["1", "a", "a", "tale 1", "3a"],
        &["2", "b", "b", "tale 2", "3a"],
        &["", "", "", "tale 3", ""],
        &["3", "c", "c", "tale 1", "x", "y"],
    ];
    let bytes = with_merged(&rows, &["A1:C1", "D3:D6", "E3:E4", "E5:F6"]);
    let table = read_sheet(&bytes, None).expect("a sheet");
    assert_eq!(
        String::from_utf8(table.csv).expect("UTF-8"),
        "\"Khối 4\"\n\"id\",\"mesh\",\"print\",\"block\",\"folio\"\n\
         \"1\",\"a\",\"a\",\"tale 1\",\"3a\"\n\"2\",\"b\",\"b\",\"tale 1\",\"3a\"\n\n\
         \"3\",\"c\",\"c\",\"tale 1\",\n"
    );
    // Equal values are not lost.
    let warning = "6 values are hidden below merged cells and are left out, the first in cell B1; unmerge the cells to see them";
    assert_eq!(table.warning.as_deref(), Some(warning));
    let hidden_error = "<row r=\"1\"><c r=\"A1\"><v>1</v></c></row>\
        <row r=\"2\"><c r=\"A2\" t=\"e\"><v>#REF!</v></c><c r=\"B2\"><v>5</v></c></row></sheetData>\
        <mergeCells><mergeCell ref=\"A1:A2\"/></mergeCells><sheetData>";
    let one = workbook(&[("a", hidden_error)], "", "");
    let table = read_sheet(&one, None).expect("a sheet");
    let warning = table.warning.expect("a hidden value");
    assert!(
        warning.starts_with("the value of cell A2 is hidden below merged cells"),
        "{warning}"
    );
    // Areas may lie over each other.
    let rows: [&[&str]; 5] = [
        &["id", "mesh", "print", "block"],
        &["1", "a", "a", "b1"],
        &["2", "b", "b", "b2"],
        &["3", "c", "c", "b3"],
        &["4", "d", "d", "b4"],
    ];
    let table = read_sheet(&with_merged(&rows, &["D2:D4", "D3:D4"]), None).expect("a sheet");
    let csv = String::from_utf8(table.csv).expect("UTF-8");
    assert!(csv.ends_with("\"4\",\"d\",\"d\",\"b4\"\n"), "{csv}");
    assert!(table.warning.is_some(), "{csv}");
    // Rows without cells may stand in any order.
    let odd = "<row r=\"5\"/><row r=\"3\"><c r=\"A3\"><v>1</v></c></row></sheetData>\
        <mergeCells><mergeCell ref=\"A2:A6\"/></mergeCells><sheetData>";
    read_sheet(&workbook(&[("a", odd)], "", ""), None).expect("a sheet");
}

#[test]
fn cells_merged_over_columns_are_refused_below_the_header() {
    let rows: [&[&str]; 4] = [
        &["Khối 4"],
        &["id", "mesh", "print", "block"],
        &["1", "a", "a", "tale 1", "beside the table"],
        &["2", "b", "", "tale 2"],
    ];
    let beside = with_merged(&rows, &["A1:D1", "D3:E3", "E3:F4"]);
    assert!(csv(&beside).ends_with("\n\"2\",\"b\",,\"tale 2\"\n"));
    assert_eq!(
        refusal(&with_merged(&rows, &["A1:D1", "B4:C4"])),
        "cells B4:C4 are merged over several columns; unmerge them, and write each value into its own cell"
    );
    let damaged = refusal(&with_merged(&rows, &["B4:4"]));
    assert!(damaged.contains("there are no cells B4:4"), "{damaged}");
    let areas: Vec<String> = (1..=1001).map(|row| format!("A{row}:B{row}")).collect();
    let areas: Vec<&str> = areas.iter().map(String::as_str).collect();
    let many = refusal(&with_merged(&rows, &areas));
    assert!(
        many.contains("more than 1000 areas of merged cells"),
        "{many}"
    );
}

#[test]
fn the_first_visible_sheet_is_read_or_the_one_that_is_named() {
    let rows = |id: &str| text_rows(&[&["id", "mesh", "print"], &[id, "m", "p"]]);
    let (a, b) = (rows("a"), rows("b"));
    let bytes = workbook(
        &[
            ("Ghi chú\" state=\"hidden", &a),
            ("Khối 4", &b),
            ("Khối 5", &a),
        ],
        "",
        "",
    );
    let table = read_sheet(&bytes, None).expect("the second sheet");
    assert_eq!(parse_csv(&table.csv).expect("rows")[0].name.as_str(), "b");
    assert_eq!(
        table.warning.as_deref(),
        Some("only the sheet \"Khối 4\" is read; name another one with --sheet: \"Khối 5\"")
    );
    let table = read_sheet(&bytes, Some("Khối 5")).expect("the third sheet");
    assert_eq!(
        (
            parse_csv(&table.csv).expect("rows")[0].name.as_str(),
            table.warning
        ),
        ("a", None)
    );
    assert_eq!(
        read_sheet(&bytes, Some("khối 6"))
            .expect_err("no such sheet")
            .to_string(),
        "there is no sheet \"khối 6\"; the workbook has: \"Ghi chú\", \"Khối 4\", \"Khối 5\""
    );
}

#[test]
fn errors_of_formulas_are_those_of_a_list_in_csv() {
    let cell = |text: &str| {
        let kind = if text.starts_with('#') { "e" } else { "str" };
        format!("<c t=\"{kind}\"><v>{text}</v></c>")
    };
    let row = |cells: [&str; 5]| format!("<row>{}</row>", cells.map(cell).concat());
    let table = |rows: [[&str; 5]; 2]| {
        let header = row(["id", "mesh", "print", "block", "year"]);
        let rows = header + &rows.map(row).concat();
        workbook(&[("a", &rows)], "", "")
    };
    let other = table([["a", "m", "p", "b", "#N/A"], ["b", "m", "p", "b", "1872"]]);
    let mut rows = Vec::new();
    let read = read_csv(csv(&other).as_bytes(), &mut |row| rows.push(row)).expect("a list");
    let metadata: Vec<usize> = rows.iter().map(|row| row.meta.len()).collect();
    assert_eq!(metadata, [0, 1]);
    let warning = read.formula_errors.warning().expect("an error");
    assert!(
        warning.contains("#N/A in column \"year\" on line 2"),
        "{warning}"
    );
    let known = table([
        ["a", "#REF!", "#N/A", "#DIV/0!", "#N/A"],
        ["#NAME?", "m", "p", "b", ""],
    ]);
    let refused = parse_csv(csv(&known).as_bytes())
        .expect_err("errors")
        .to_string();
    let lines: Vec<&str> = refused.lines().collect();
    assert_eq!(lines.len(), 4, "{refused}");
    for (line, start) in lines.iter().zip([
        "line 2: column block has the error #DIV/0! of a formula",
        "line 2: column mesh has the error #REF! of a formula",
        "line 2: column print has the error #N/A of a formula",
        "line 3: the id #NAME? is the error of a formula",
    ]) {
        assert!(line.starts_with(start), "{refused}");
    }
    let others = [
        ["a&#10;b", "m", "p", "b", "#N/A"],
        ["b", "#REF!", "p", "b", ""],
    ];
    assert_eq!(
        refusal(&table(others)),
        "2 cells cannot be read:\ncell A2 of column \"id\" has a line break; write it on one line\n\
         cell B3 has the error #REF!; correct it, or clear the cell"
    );
}

#[test]
fn what_is_no_workbook_is_named() {
    let plain = [("a.txt", "x")];
    let sheet = |rows: &str| workbook(&[("a", rows)], "", "");
    let error = "<row r=\"7\"><c r=\"AB7\" t=\"e\"><v>#REF!</v></c></row>";
    let missing = "<row><c t=\"s\"><v>3</v></c></row>";
    let whole = workbook(&[("Sheet1", ROWS)], STRINGS, STYLES);
    let mut changed = archive(&[("xl/workbook.xml", "<workbook/>")], false);
    changed[45] ^= 1;
    let sentences = [
        refusal(&archive(&plain, true)),
        refusal(&archive(&[("content.xml", "x")], false)),
        refusal(&archive(&[("xl/workbook.bin", "x")], false)),
        refusal(&archive(&[("xl/workbook.xml", "<workbook>")], true)),
        refusal(&archive(&[("xl/workbook.xml", "<workbook/>")], true)),
        refusal(b"PK\x03\x04"),
        refusal(&whole[..whole.len() / 2]),
        refusal(&changed),
        refusal(&sheet(error)),
        refusal(&sheet(missing)),
        refusal(&sheet("<row><c><f>B1&amp;C1</f><v></v></c></row>")),
        refusal(&sheet("<row r=\"2\"><c><v>1</v></c></row><row r=\"2\"/>")),
        refusal(&sheet("<row r=\"1048577\"/>")),
        refusal(&sheet("<row><c r=\"ZZZZ1\"><v>1</v></c></row>")),
        refusal(&sheet(&"<row>".repeat(100))),
    ];
    insta::assert_snapshot!(sentences.join("\n"));
}

#[test]
fn a_small_archive_cannot_become_a_huge_table() {
    let blanks = " ".repeat((4 << 20) + 1);
    let bytes = archive(&[("xl/workbook.xml", &blanks)], true);
    assert!(bytes.len() < 100_000);
    let refused = read_sheet(&bytes, None).expect_err("too large");
    assert!(
        matches!(refused, WorkbookError::TooLarge { .. }),
        "{refused}"
    );
    let text = "x".repeat(32_000);
    let strings = format!("<sst><si><t>{text}</t></si></sst>");
    let row = "<row><c t=\"s\"><v>0</v></c></row>".repeat(200);
    let refused = read_sheet(&workbook(&[("a", &row)], &strings, ""), None).expect_err("too large");
    assert_eq!(
        refused.to_string(),
        "the table of the workbook has more than 4 MiB; save the sheet alone"
    );
    let shared = "<c t=\"s\"><v>0</v></c>".repeat(200);
    let row = format!("<row>{shared}</row>");
    let refused = read_sheet(&workbook(&[("a", &row)], &strings, ""), None).expect_err("too large");
    assert!(
        matches!(refused, WorkbookError::TooLarge { .. }),
        "{refused}"
    );
    let text = "x".repeat(1 << 20);
    let strings = format!("<sst><si><t>{text}</t></si></sst>");
    assert_eq!(
        refusal(&workbook(
            &[("a", "<row><c t=\"s\"><v>0</v></c></row>")],
            &strings,
            ""
        )),
        "cell A1 has more than 98301 bytes of text; shorten it"
    );
    let columns = format!("<row>{}</row>", "<c/>".repeat(16_385));
    assert_eq!(
        refusal(&workbook(&[("a", &columns)], "", "")),
        "the workbook is damaged: a row has more than 16384 cells; save it again"
    );
    let many = "<si/>".repeat(1001);
    let refused = refusal(&workbook(&[("a", ROWS)], &format!("<sst>{many}</sst>"), ""));
    assert!(
        refused.contains("more than 1000 shared strings"),
        "{refused}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn damaged_workbooks_are_read_or_refused(
        changes in proptest::collection::vec((any::<Index>(), any::<u8>()), 0..6),
        end in proptest::option::of(any::<Index>()),
        is_deflated in any::<bool>(),
    ) {
        let files = [
            ("xl/workbook.xml", "<workbook><sheets><sheet name=\"a\" r:id=\"1\"/></sheets></workbook>"),
            ("xl/_rels/workbook.xml.rels", "<R><Relationship Id=\"1\" Target=\"s.xml\"/></R>"),
            ("xl/s.xml", ROWS),
        ];
        let mut bytes = archive(&files, is_deflated);
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(end) = end {
            bytes.truncate(end.index(bytes.len()));
        }
        let _ = read_sheet(&bytes, None);
    }
}
