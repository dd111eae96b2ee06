//! Which lists of blocks are read, and why others are refused.

use serde_json::json;

use super::{parse_blocks, read_block_json, read_blocks};
use crate::manifest::ListKind;
use mocban_core::domain::{BlockSide, LengthUnit};

fn is_block_list(bytes: &[u8]) -> bool {
    ListKind::of_csv(bytes).is_of_blocks
}

fn is_block_json(bytes: &[u8]) -> bool {
    ListKind::of_json(bytes).is_of_blocks
}

fn refusal(text: &str) -> String {
    parse_blocks(text.as_bytes()).expect_err(text).to_string()
}

#[test]
fn the_header_tells_a_list_of_blocks_from_one_of_pairs() {
    for text in [
        "block,mesh,page\n",
        "Block;Mesh;Page;labels\n",
        "block,mesh,pages,labels\n",
        "sep=;\nSố hiệu ván;Bản quét;Ảnh trang;Mặt\n",
    ] {
        assert!(is_block_list(text.as_bytes()), "{text}");
    }
    for text in [
        "id,mesh,print,block\n",
        "id,mesh,print\n",
        "",
        "block,mesh\n",
        "id,mesh,print,page\n",
        "mã,bản quét,bản in,trang\n",
    ] {
        assert!(!is_block_list(text.as_bytes()), "{text}");
    }
}

#[test]
fn rows_have_optional_labels_unit_and_side() {
    let text = "block,mesh,page,labels,unit,side\nb1,m/1.stl,p/1.jpg,l/1.json,MM,back\n\nb2,m/2.ply,p/2.png,,,\n";
    let rows = parse_blocks(text.as_bytes()).expect("valid");
    assert_eq!((rows.len(), rows[1].line), (2, 4));
    assert_eq!(rows[0].unit, Some(LengthUnit::Mm));
    assert_eq!(rows[0].side, Some(BlockSide::Back));
    assert_eq!(rows[0].labels.as_deref(), Some("l/1.json".as_ref()));
    assert_eq!((&rows[1].labels, rows[1].side), (&None, None));
}

#[test]
fn a_list_may_be_vietnamese() {
    let text =
        "sep=;\nSố hiệu ván;Bản quét; \"Ảnh trang\";nhãn;Mặt\nb1;m.stl;\u{a0}p.jpg;;Mặt sau\n";
    let rows = parse_blocks(text.as_bytes()).expect("valid");
    assert_eq!((rows[0].name.as_str(), rows[0].line), ("b1", 3));
    assert_eq!(
        (rows[0].page.to_str(), rows[0].side),
        (Some("p.jpg"), Some(BlockSide::Back))
    );
}

#[test]
fn the_headings_of_the_app_are_read() {
    for header in [
        "Ván,Bản quét,Trang in,Nhãn,Đơn vị,Mặt",
        "Mã ván,Tệp quét,Ảnh trang,Tệp nhãn,Đơn vị của bản quét,Mặt",
        "Mã hiện vật,Bản quét 3D,Ảnh trang in,nhãn,đơn vị đo,mặt",
        "Ván số,Tệp bản quét,Tệp trang in,NHÃN,Đơn vị,MẶT",
    ] {
        let list = format!("{header}\nb1,m.stl,p.jpg,l.json,mm,sau\n");
        assert!(is_block_list(list.as_bytes()), "{header}");
        let rows = parse_blocks(list.as_bytes()).expect(header);
        let row = &rows[0];
        assert_eq!(row.name.as_str(), "b1", "{header}");
        assert_eq!(row.page.to_str(), Some("p.jpg"), "{header}");
        assert_eq!(row.labels.as_deref(), Some("l.json".as_ref()), "{header}");
        assert_eq!(
            (row.unit, row.side, row.meta.len()),
            (Some(LengthUnit::Mm), Some(BlockSide::Back), 0),
            "{header}"
        );
    }
    // Without a page, a scan and a print are a pair, although no column has the name of an id.
    for header in ["Nr,Bản quét,Bản in", "Ván,Bản quét,Bản in"] {
        assert!(!is_block_list(header.as_bytes()), "{header}");
    }
}

#[test]
fn of_several_headings_the_one_that_names_the_thing_best_is_taken() {
    let list =
        "Mã hiện vật,Ván số,Ván,Bản quét,Trang,Trang in,Ảnh trang\n9,8,b1,m.stl,12,x,p.jpg\n";
    let rows = parse_blocks(list.as_bytes()).expect("valid");
    assert_eq!(rows[0].name.as_str(), "b1");
    assert_eq!(rows[0].page.to_str(), Some("p.jpg"));
    assert_eq!(rows[0].meta.len(), 4);
    let list = "Ván,Bản quét,Trang,Trang in\nb1,m.stl,12,p.jpg\n";
    let rows = parse_blocks(list.as_bytes()).expect("valid");
    assert_eq!(rows[0].page.to_str(), Some("p.jpg"));
}

#[test]
fn problems_name_line_and_column() {
    for (text, expected) in [
        (
            "block,mesh,pages,labels\nb,m,p,l\n",
            "rename \"pages\" to \"page\" if it is meant",
        ),
        ("block,mesh,page\nb,m\n", "line 2: the row has 2 cells"),
        ("block,mesh,page\nb,,p\n", "line 2: mesh is empty"),
        (
            "block,mesh,page\nb,m,p\nb,m,p\n",
            "line 3: block \"b\" is already on line 2",
        ),
        (
            "block,mesh,page\nB1,m,p\nb1,m,p\n",
            "line 3: block \"b1\" differs from that on line 2 only in upper and lower case",
        ),
        (
            "block,mesh,page,side\nb,m,p,Top\n",
            "\"Top\" is not a side (front, back)",
        ),
        (
            "block,mesh,page,unit\nb,m,p,Foot\n",
            "\"Foot\" is not a unit (mm, cm, m, in)",
        ),
        ("block,mesh,page\na/b,m,p\n", "an id has no slashes"),
        ("block,mesh,page\n", "the list contains no blocks"),
    ] {
        let found = refusal(text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
}

#[test]
fn other_columns_are_metadata() {
    let list = "sep=;\nSố hiệu ván;Bản quét;Ảnh trang;Triều đại; shelfmark ;;Bộ sưu tập\n\
        b1;1.stl;1.png;Nguyễn;R.1234/5;;\"Viện; kho A\"\nb2;2.stl;2.png; ;;;Lê\n";
    let read = read_blocks(list.as_bytes()).expect("valid");
    assert_eq!(read.warnings, [""; 0]);
    let meta = |row: usize| serde_json::to_value(&read.rows[row].meta).expect("JSON");
    let first =
        json!({ "Triều đại": "Nguyễn", "shelfmark": "R.1234/5", "Bộ sưu tập": "Viện; kho A" });
    assert_eq!(meta(0), first);
    assert_eq!(meta(1), json!({ "Bộ sưu tập": "Lê" }));
    let list = "block,khối,mesh,page\nb,4,m,p\n";
    let read = read_blocks(list.as_bytes()).expect("valid");
    assert_eq!(read.rows[0].meta["khối"], "4");
}

#[test]
fn metadata_with_the_name_of_another_column_is_reported() {
    for (columns, cells, expected) in [
        ("color,year", "x,1872", &[][..]),
        ("Site,size,slide", "x,x,x", &[]),
        ("lables", "l.json", &[("lables", "labels")]),
        (
            "Units,sides",
            "mm,back",
            &[("sides", "side"), ("Units", "unit")],
        ),
        ("unit,units", "mm,mm", &[]),
        ("unit,units", ",mm", &[("units", "unit")]),
    ] {
        let list = format!("{columns},block,mesh,page\n{cells},b,m,p\n");
        let read = read_blocks(list.as_bytes()).expect("valid");
        let expected = expected.iter().map(|(name, known)| {
            format!(
                "column {name:?} is kept as metadata; rename it to {known:?} if it is meant, and import again"
            )
        });
        assert_eq!(read.warnings, expected.collect::<Vec<_>>(), "{columns}");
    }
}

#[test]
fn metadata_has_the_limits_of_pairs() {
    let list = |name: &str, cell: &str| format!("block,mesh,page,{name}\nb,m,p,{cell}\n");
    let longest = list("note", &"x".repeat((1 << 16) - 4));
    assert_eq!(
        parse_blocks(longest.as_bytes()).map(|rows| rows.len()),
        Ok(1)
    );
    for (text, expected) in [
        (
            list("note", &"x".repeat(1 << 16)),
            "line 2: note has 65540 bytes, over the limit of 65536",
        ),
        (
            list(&"n".repeat(1001), "x"),
            "line 1: the name of column 4 has 1001 bytes, over the limit of 1000",
        ),
        (
            list("note", &"x".repeat(2 << 20)),
            "line 2: the row has more than 1048576 bytes; a closing quotation mark may be missing",
        ),
        (
            list("note,year,note", "x,1872,y"),
            "line 1: columns 4 and 6 are both named \"note\"",
        ),
    ] {
        let found = refusal(&text);
        assert!(found.starts_with(expected), "{found}");
    }
}

#[test]
fn lines_of_an_export_are_refused_by_name() {
    let line = r#"{"block":"b","mesh":"m","page":"p","meta":{},"status":"done","error":null,"characters":4}"#;
    let refused = read_block_json(line.as_bytes()).expect_err("refused");
    assert_eq!(
        refused.to_string(),
        "line 1: this is a line of an export with results; import your own list of blocks"
    );
    let own = line.replace("\"meta\":{},", "");
    let read = read_block_json(own.as_bytes()).expect("valid");
    assert_eq!(read.rows[0].meta.len(), 2);
}

#[test]
fn lists_in_json_have_the_rows_of_csv() {
    let csv = "Số hiệu ván,Bản quét,Ảnh trang,Mặt,Triều đại\nb1,1.stl,1.png,sau,Nguyễn\nb2,2.stl,2.png,,\n";
    let mut expected = parse_blocks(csv.as_bytes()).expect("valid");
    let rows = [
        r#"{"Số hiệu ván":"b1","Bản quét":"1.stl","Ảnh trang":"1.png","Mặt":"sau","Triều đại":"Nguyễn"}"#,
        r#"{"Số hiệu ván":"b2","Bản quét":"2.stl","Ảnh trang":"2.png","Mặt":null,"Triều đại":" "}"#,
    ];
    for (list, first) in [
        (rows.join("\n"), 1),
        (format!("[\n{}\n]", rows.join(",\n")), 2),
    ] {
        assert!(is_block_json(list.as_bytes()), "{list}");
        let read = read_block_json(list.as_bytes()).expect("valid");
        for (row, line) in expected.iter_mut().zip(first..) {
            row.line = line;
        }
        assert_eq!(read.rows, expected, "{list}");
    }
    for other in [
        r#"{"id":"a","mesh":"m","print":"p","block":"b"}"#,
        r#"{"id":"a","mesh":"m","print":"p","page":"4"}"#,
        "block,mesh,page\n",
        "{",
        "",
    ] {
        assert!(!is_block_json(other.as_bytes()), "{other}");
    }
    let good = r#"{"block":"b","mesh":"m","page":"p"}"#;
    let large = format!("{{\"block\":\"{}\"}}", "x".repeat(2 << 20));
    for list in [
        format!("{{\"block\":\"a\",}}\n{good}\n"),
        format!("{large}\n{good}\n"),
        format!("[[1], {good}]"),
    ] {
        assert!(is_block_json(list.as_bytes()), "{list:.40}");
    }
    let damaged =
        "{\"block\":\"b\",\"mesh\":\"m\",\"page\":\"p\"}\n{\"block\":\"b\",\"mesh\":\"m\"}\n[1]\n";
    let refused = read_block_json(damaged.as_bytes()).expect_err("refused");
    let lines: Vec<String> = refused.to_string().lines().map(str::to_owned).collect();
    assert_eq!(lines[0], "line 2: page is empty");
    assert!(
        lines[1].starts_with("line 3: not a JSON object"),
        "{lines:?}"
    );
    assert_eq!(lines.len(), 2);
}

#[test]
fn columns_with_other_names_are_named() {
    let csv = "Ván;Bản quét;Trang in;Năm\nb1;m.stl;p.jpg;1872\n";
    let json = r#"{"Ván":"b1","Bản quét":"m.stl","Trang in":"p.jpg","Năm":"1872"}"#;
    let expected = [("Bản quét", "mesh"), ("Trang in", "page"), ("Ván", "block")];
    for read in [
        read_blocks(csv.as_bytes()),
        read_block_json(json.as_bytes()),
    ] {
        let renamed = read.expect("valid").renamed;
        let renamed = renamed
            .iter()
            .map(|(written, name)| (written.as_str(), *name));
        assert_eq!(renamed.collect::<Vec<_>>(), expected);
    }
    let plain = read_blocks(b"Block,mesh,page\nb1,m.stl,p.jpg\n").expect("valid");
    assert!(plain.renamed.is_empty());
}

#[test]
fn empty_cells_behind_the_last_column_are_ignored() {
    let blocks = parse_blocks(b"block,mesh,page\nb,m,p,,\n").expect("parses");
    assert_eq!(blocks[0].page.to_str(), Some("p"));
    assert!(blocks[0].meta.is_empty());
}
