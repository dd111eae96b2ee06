//! Tests of CSV lists.

use super::{ManifestError, ManifestRow};
use mocban_core::domain::LengthUnit;

fn parse(text: &str) -> Result<Vec<ManifestRow>, ManifestError> {
    super::parse_csv(text.as_bytes())
}

fn refusal(text: &str) -> String {
    parse(text).expect_err(text).to_string()
}

/// Asserts that lists have the same rows.
#[track_caller]
fn assert_same_rows(first: &str, others: &[&str]) {
    let rows = parse(first).expect(first);
    for text in others {
        assert_eq!(parse(text).expect(text), rows, "{text:?}");
    }
}

#[test]
fn known_columns_are_parsed_and_others_stored() {
    let rows = parse(
        "id,mesh,print,character,block,unit,scanned_face_down,folio\n\
         b1_0001,m/1.stl,p/1.png,天,b1,mm,yes,12r\nb1_0002,m/2.stl,p/2.png,,,,,\n",
    )
    .expect("parses");
    assert_eq!(rows[0].name.as_str(), "b1_0001");
    assert_eq!(rows[0].mesh.to_str(), Some("m/1.stl"));
    assert_eq!(rows[0].character.as_deref(), Some("天"));
    assert_eq!(rows[0].unit, Some(LengthUnit::Mm));
    assert_eq!(rows[0].scanned_face_down, Some(true));
    assert_eq!(rows[0].meta["folio"], "12r");
    assert_eq!(
        (rows[1].line, rows[1].unit, &rows[1].block),
        (3, None, &None)
    );
    assert!(rows[1].meta.is_empty());
}

#[test]
fn order_case_spaces_bom_and_separators_do_not_matter() {
    let others = [
        "\u{feff}id,mesh,print\r\na,b,c\r\n",
        " Mesh ; ID ; PRINT\nb;a;c",
        "print\tid\tmesh\nc\ta\tb\n",
        "id,mesh,print\na,\"b\",c\n,,\n",
        "\"id \",mesh,print\n a,\" b\t\",c \n , \t,\"  \"\n",
    ];
    assert_same_rows("id,mesh,print\na,b,c\n", &others);
}

#[test]
fn lines_are_counted_through_blank_lines_and_long_cells() {
    let rows = parse("\n\nid,mesh,print,note\n\na,b,c,\"two\nlines\"\r\n\r\n\nd,e,f,\ng,h,i,\n")
        .expect("parses");
    let lines: Vec<_> = rows.iter().map(|row| row.line).collect();
    assert_eq!(lines, [5, 9, 10]);
}

#[test]
fn every_problem_is_reported_with_its_line() {
    let text = "id,mesh,print,unit,scanned_face_down\n\
        a,m,p,,\n\
        a/b,m,p,,\n\
        ,m,p,,\n\
        a,m,p,,\n\
        c,,,furlong,maybe\n\
        d,m\n";
    assert_eq!(
        refusal(text).lines().collect::<Vec<_>>(),
        [
            "line 3: id \"a/b\" holds '/'; an id has no slashes, control or invisible characters",
            "line 4: the id is empty",
            "line 5: id \"a\" is already on line 2",
            "line 6: mesh is empty",
            "line 6: print is empty",
            "line 6: \"furlong\" is not a unit (mm, cm, m, in)",
            "line 6: scanned_face_down is \"maybe\", not true, false, yes, no, 1 or 0",
            "line 7: the row has 2 cells, the header has 5",
        ]
    );
}

#[test]
fn empty_cells_behind_the_last_column_and_missing_ones_without_a_name_are_ignored() {
    let others = [
        "id,mesh,print,note\na,m,p,x,\n",
        "id;mesh;print;note\na;m;p;x;; ;\u{a0}\n",
        "id,mesh,print,note,,\na,m,p,x\n",
        "id,mesh,print,note,,\na,m,p,x,\n",
    ];
    assert_same_rows("id,mesh,print,note\na,m,p,x\n", &others);
    for (text, cells, columns) in [
        ("id,mesh,print,note\na,m,p,x,,y\n", 6, 4),
        ("id,mesh,print,note\na,m,p\n", 3, 4),
        ("id,mesh,print,,note\na,m,p\n", 3, 5),
    ] {
        assert_eq!(
            refusal(text),
            format!("line 2: the row has {cells} cells, the header has {columns}")
        );
    }
}

#[test]
fn ids_that_differ_in_case_or_unicode_form_only_are_refused() {
    assert_eq!(
        refusal("id,mesh,print\nA1,m,p\nb,m,p\na1,m,p\n"),
        "line 4: id \"a1\" differs from that on line 2 only in upper and lower case, so their files would be one on \
         Windows and macOS; rename one of them"
    );
    let [composed, decomposed] = ["chữ", "chu\u{31b}\u{303}"];
    assert_eq!(
        refusal(&format!(
            "id,mesh,print\n{composed},m,p\n{decomposed},m,p\n"
        )),
        format!("line 3: id \"{composed}\" is already on line 2")
    );
    assert!(refusal("id,mesh,print\nĐĩa,m,p\nđĩa,m,p\n").contains("only in upper and lower case"));
    assert!(parse("id,mesh,print\ndia,m,p\nđĩa,m,p\n").is_ok());
}

#[test]
fn missing_and_repeated_columns_are_reported() {
    assert_eq!(
        refusal("id,model,print\na,b,c\n"),
        "line 1: column \"mesh\" is missing; rename \"model\" to \"mesh\" if it is meant; the header has: id, \
         model, print"
    );
    assert_eq!(
        refusal("id,mesh,print,mesh\na,b,c,d\n"),
        "line 1: columns 2 and 4 are both named \"mesh\""
    );
    assert_eq!(refusal(""), "the list is empty");
    assert_eq!(refusal("id,mesh,print\n"), "the list contains no pairs");
}

#[test]
fn a_row_without_closing_quotation_mark_is_refused_with_its_line() {
    let rest = "b,m,p,\n".repeat(1 << 18);
    let text = format!("id,mesh,print,note\n\n\na/b,m,p,\n\nc,m,p,\"open\n{rest}");
    assert_eq!(
        refusal(&text),
        "line 6: a quote is opened here and never closed"
    );
    let long = "x".repeat(1 << 21);
    let text = format!("id,mesh,print,note\na/b,m,p,\nc,m,p,\"{long}\"\n");
    assert_eq!(
        refusal(&text).lines().collect::<Vec<_>>(),
        [
            "line 2: id \"a/b\" holds '/'; an id has no slashes, control or invisible characters",
            "line 3: the row has more than 1048576 bytes; a closing quotation mark may be missing",
        ]
    );
    // The limit applies to each row, not to the list.
    let rows: Vec<_> = (0..300_000).map(|n| format!("{n},m,p")).collect();
    let rows = parse(&format!("id,mesh,print\n{}", rows.join("\n"))).expect("parses");
    assert_eq!(rows.last().map(|row| row.line), Some(300_001));
}

#[test]
fn a_long_column_name_is_refused() {
    let name = "n".repeat(1001);
    assert_eq!(
        refusal(&format!("id,mesh,print,{name}\na,b,c,d\n")),
        "line 1: the name of column 4 has 1001 bytes, over the limit of 1000"
    );
    let text = format!("id,mesh,print,{}\na,b,c,d\n", &name[1..]);
    assert_eq!(parse(&text).expect("parses")[0].meta.len(), 1);
}

#[test]
fn bytes_that_are_not_utf8_are_reported_with_line_and_column() {
    let error = super::parse_csv(b"id,mesh,print\na,b,c\nd,\x01\xff\xfe,f\n").expect_err("bytes");
    assert_eq!(
        error.to_string(),
        "line 3: the cell of column \"mesh\" is not UTF-8"
    );
    // "chữ" in Windows-1258: "ch", "ư" and a combining tilde.
    let error = super::parse_csv(b"id,mesh,print\na,ch\xfd\xde.stl,c\n").expect_err("bytes");
    assert_eq!(
        error.to_string(),
        "line 2: the cell of column \"mesh\" is not UTF-8; it seems to be Windows-1258 (Vietnamese): save the \
         list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")"
    );
}

#[test]
fn the_encoding_is_that_of_all_lines_and_given_once() {
    // Without the second row, the first could be Windows-1252.
    let error =
        super::parse_csv(b"id,mesh,print\na,\xe0.stl,c\nb,ch\xfd\xde.stl,c\n").expect_err("bytes");
    assert_eq!(
        error.to_string(),
        "lines 2, 3: the cell of column \"mesh\" is not UTF-8; it seems to be Windows-1258 (Vietnamese): save the \
         list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")"
    );
    // Only lines that are not UTF-8 decide, and this one is not text.
    let list = ["id,mesh,print\nđá,a,b\ny,".as_bytes(), b"\x01\xff.stl,c\n"].concat();
    let error = super::parse_csv(&list).expect_err("bytes");
    assert_eq!(
        error.to_string(),
        "line 3: the cell of column \"mesh\" is not UTF-8"
    );
}

#[test]
fn swapped_columns_are_named_once() {
    let swapped = "id,mesh,print\n1,p/1.JPG,m/1.ply\n2,p/2.jpg,m/2.ply\n";
    assert_eq!(
        refusal(swapped),
        "lines 2, 3: mesh names an image and print names a mesh; swap the two"
    );
    assert_eq!(
        refusal("id,mesh,print\nm/1.stl,1,p/1.png\nm/2.stl,2,p/2.png\n"),
        "lines 2, 3: id names a file; give each pair an id, or swap the columns if they are mixed up"
    );
    // The content decides, so an unusual extension is no reason to refuse a row.
    assert!(parse("id,mesh,print\n1,scan.tif,print.dat\n").is_ok());
}

#[test]
fn a_misspelt_column_is_named() {
    assert_eq!(
        refusal("id,mech,print\na,b,c\n"),
        "line 1: column \"mesh\" is missing; rename \"mech\" to \"mesh\" if it is meant; the header has: id, \
         mech, print"
    );
    assert_eq!(
        refusal("id,mesh,Ảnh inn\na,b,c\n"),
        "line 1: column \"print\" is missing; rename \"Ảnh inn\" to \"print\" if it is meant; the header has: id, mesh, \
         Ảnh inn"
    );
    // Names that may mean something else are offered, not taken.
    let renamed: Vec<_> = refusal("ảnh,mesh,tên\na,b,c\n")
        .lines()
        .map(|line| line.split("; ").nth(1).map(str::to_owned))
        .collect();
    assert_eq!(
        renamed,
        [
            Some("rename \"tên\" to \"id\" if it is meant".to_owned()),
            Some("rename \"ảnh\" to \"print\" if it is meant".to_owned())
        ]
    );
}

#[test]
fn headers_may_be_vietnamese_in_any_case_and_with_blanks() {
    let plain =
        parse("id,mesh,print,character,block,unit,scanned_face_down,note\na,b,c,d,e,mm,yes,f\n")
            .expect("parses");
    for header in [
        "Mã số,Bản quét,Bản in,Tên chữ,Khối,Đơn vị,Quét úp,note",
        "MA SO,BAN QUET,BAN IN,CHU,SO HIEU VAN,DON VI,QUET UP,note",
        "Mã,Tệp quét,Ảnh bản in,Chữ,Ván,Đơn vị của bản quét,Quét úp,note",
        "Mã cặp,Tệp bản quét,Tệp bản in,Chữ,Ván số,Đơn vị đo,Quét úp,note",
        "Mã hiện vật,Bản quét,Bản in,Chữ,Mã ván,Đơn vị,Quét úp mặt,note",
        "ID,Mesh ,print\u{a0},ký tự,số hiệu ván,unit,Scanned Face-Down,note",
    ] {
        let rows = parse(&format!("{header}\na,b,c,d,e,mm,Có,f\n")).expect(header);
        assert_eq!(rows, plain, "{header}");
    }
    let read = super::read_csv(
        "id,mesh,print,Khối,ván\na,b,c,d,e\n".as_bytes(),
        &mut |row| {
            assert_eq!((row.block.as_deref(), row.meta.len()), (Some("e"), 1));
        },
    );
    let renamed = read.expect("parses").renamed;
    assert_eq!(
        renamed.into_iter().collect::<Vec<_>>(),
        [("ván".to_owned(), "block")]
    );
}

#[test]
fn lists_of_spreadsheets_and_scripts_are_read() {
    let plain = parse("id,mesh,print\na,b c,d\n").expect("parses");
    for list in [
        "sep=;\r\nid;mesh;print\r\na;b c;d\r\n",
        "id, \"mesh\", \"print\"\na, \"b c\", \"d\"\n",
        "id,mesh,print\n\u{a0}a,b c\u{a0},\u{feff}d\u{200b}\n",
    ] {
        let rows = parse(list).expect(list);
        assert_eq!(rows[0].mesh, plain[0].mesh, "{list}");
        assert_eq!(
            (&rows[0].name, &rows[0].print),
            (&plain[0].name, &plain[0].print)
        );
    }
    let other = parse("sep=,\nid;mesh;print\na;b,c;d\n").expect("parses");
    assert_eq!(other[0].mesh.to_str(), Some("b,c"));
    let shifted = refusal("sep=;\nid;mesh;print\na;;d\n");
    assert_eq!(shifted, "line 3: mesh is empty");
    let spaced = parse("id,mesh,print\nchữ\u{a0}số,b,c\n").expect("parses");
    assert_eq!(spaced[0].name.as_str(), "chữ số");
}

#[test]
fn a_header_below_a_title_and_other_separators_are_named() {
    let title = refusal("# my list, of mine,,\n\nid,mesh,print,note\n1,a.stl,a.png,x\n");
    assert!(
        title.ends_with("\nline 3 has these columns; remove the lines above it"),
        "{title}"
    );
    let blocks = refusal("Ván 4,,\nblock,mesh,page\n4,a.stl,a.png\n");
    assert!(
        blocks.ends_with("\nline 2 has the columns of a list of blocks; remove the lines above it"),
        "{blocks}"
    );
    let title = refusal("Block 4\nid;mesh;print\n1;a.stl;a.png\n");
    assert_eq!(
        title,
        "line 1: this is no header\nline 2 has these columns; remove the lines above it"
    );
    // The refused line itself is no advice, even if another separator would give it the columns.
    let tied = refusal("id;mesh;print;a,b,c,d\n1;a.stl;a.png;x\n");
    assert!(!tied.contains("has these columns"), "{tied}");
    let pipes = refusal("id|mesh|print\n1|a.stl|a.png\n");
    assert_eq!(
        pipes.lines().next(),
        Some(
            "line 1: column \"id\" is missing; the header has one column only, id|mesh|print; put a comma, semicolon or tab \
             between columns"
        )
    );
    assert!(!pipes.contains("remove the lines"), "{pipes}");
}

#[test]
fn names_of_columns_with_file_or_number_are_suggested() {
    let found = refusal("No.,mesh file,print file\n1,a.stl,a.png\n");
    for (written, name) in [
        ("No.", "id"),
        ("mesh file", "mesh"),
        ("print file", "print"),
    ] {
        let hint = format!("rename {written:?} to {name:?} if it is meant");
        assert!(found.contains(&hint), "{found}");
    }
}

#[test]
fn names_of_columns_that_are_not_utf8_are_one_problem() {
    let list = b"m\xe3,mesh,print,ch\xfd\xde,kh\xf4i\n1,a.stl,a.png,x,y\n";
    let refused = super::parse_csv(list)
        .expect_err("Windows-1258")
        .to_string();
    assert!(
        refused.starts_with(
            "line 1: the names of columns 1, 4, 5 are not UTF-8; it seems to be Windows-1258"
        ),
        "{refused}"
    );
    assert_eq!(refused.lines().count(), 1, "{refused}");
}

#[test]
fn ids_and_blocks_on_several_lines_are_refused_with_their_row() {
    for (id, block, expected) in [
        (
            "a\nb",
            "1",
            "id \"a b\" has a line break; write it on one line",
        ),
        (
            "a\r\nb",
            "1",
            "id \"a  b\" has a line break; write it on one line",
        ),
        ("a\tb", "1", "id \"a b\" has a tab; remove it"),
        (
            "a",
            "b\n1",
            "block \"b 1\" has a line break; write it on one line",
        ),
    ] {
        let csv = format!("id,mesh,print,block\n0,m,p,\n\"{id}\",m,p,\"{block}\"\n");
        assert_eq!(refusal(&csv), format!("line 3: {expected}"));
        let [first, second] = [("0", ""), (id, block)].map(
            |(id, block)| serde_json::json!({"id": id, "mesh": "m", "print": "p", "block": block}),
        );
        for list in [
            format!("{first}\n{second}"),
            format!("[{first},\n{second}]"),
        ] {
            let refused = super::super::parse_jsonl(list.as_bytes()).expect_err("two lines");
            assert_eq!(refused.to_string(), format!("line 2: {expected}"));
        }
    }
    for list in [
        "id,mesh,print,block\n\"\na\t\",m,p,\"b\r\n\"\n",
        "{\"id\":\"\\na\\t\",\"mesh\":\"m\",\"print\":\"p\",\"block\":\"b\\r\\n\"}",
    ] {
        let parse = if list.starts_with('{') {
            super::super::parse_jsonl
        } else {
            super::parse_csv
        };
        let rows = parse(list.as_bytes()).expect("blanks only at the ends");
        assert_eq!(
            (rows[0].name.as_str(), rows[0].block.as_deref()),
            ("a", Some("b"))
        );
    }
}

#[test]
fn headings_and_cells_of_macos_are_shown_as_they_are_read() {
    // Decomposed, as macOS and some Vietnamese keyboards write them.
    let (print, block) = ("ba\u{309}n in", "Kho\u{302}\u{301}i");
    for (list, expected) in [
        (
            format!("id,mesh,{print},Bản in\n"),
            "line 1: columns 3 and 4, \"bản in\" and \"Bản in\", have the same name (upper and lower case, accents and blanks do not count); rename one of them",
        ),
        (
            format!("id,mesh,print,{block} x,{block} x\n"),
            "line 1: columns 4 and 5 are both named \"Khối x\"",
        ),
        (
            format!("id,mesh,print,scanned_face_down\na,m,p,{block}\n"),
            "line 2: scanned_face_down is \"Khối\", not true, false, yes, no, 1 or 0",
        ),
        (
            format!("id,mesh,print,unit\na,m,p,{block}\n"),
            "line 2: \"Khối\" is not a unit (mm, cm, m, in)",
        ),
        (
            format!("id,mesh,{block}\n"),
            "line 1: column \"print\" is missing; the header has: id, mesh, Khối",
        ),
    ] {
        assert_eq!(refusal(&list), expected);
    }
}
