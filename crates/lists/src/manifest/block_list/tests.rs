//! Which lists of blocks are read, and why others are refused.

use super::{is_block_list, parse_blocks, read_blocks};
use mocban_core::domain::{BlockSide, LengthUnit};

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
            "block,mesh,page,unit\nb,m,p,Inch\n",
            "\"Inch\" is not a unit (mm, cm, m, in)",
        ),
        ("block,mesh,page\na/b,m,p\n", "an id has no slashes"),
        ("block,mesh,page\n", "the list contains no blocks"),
    ] {
        let found = refusal(text);
        assert!(found.contains(expected), "{text:?}: {found}");
    }
}

#[test]
fn other_columns_are_named_and_not_read() {
    let known = "; a list of blocks has: block, mesh, page, labels, unit, side";
    for (columns, cells, expected) in [
        ("color", "x", "column \"color\" is ignored"),
        (
            "color,year,,folio,note",
            "x,1,,2,y",
            "columns \"color\", \"year\", \"folio\" and 1 more are ignored",
        ),
        (
            "color,lables",
            "x,l.json",
            "columns \"color\", \"lables\" are ignored; rename \"lables\" to \"labels\" if it is meant, and import again",
        ),
        ("unit,units", "mm,mm", "column \"units\" is ignored"),
    ] {
        let list = format!("{columns},block,mesh,page\n{cells},b,m,p\n");
        let read = read_blocks(list.as_bytes()).expect("valid");
        assert_eq!(read.unread, Some(format!("{expected}{known}")));
        assert_eq!(read.rows[0].page.to_str(), Some("p"));
    }
    let list = "block,mesh,page,,\nb,m,p,,\n";
    assert_eq!(read_blocks(list.as_bytes()).expect("valid").unread, None);
}
