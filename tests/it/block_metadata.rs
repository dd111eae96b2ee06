//! The other columns of lists: `show`, the app and a restored backup have those of blocks, and imports without a list keep
//! them.

use std::fs;
use std::path::Path;

use mocban::workbook::test_helpers::{text_rows, workbook};
use serde_json::json;

use crate::app::{open_app, text};
use crate::app_uploads::encode;
use crate::blocks::write_blocks;
use crate::cli::{Call, mocban};

fn project(dir: &Path, args: &[&str]) -> Call {
    mocban(dir, &[&["-C", "p"], args].concat())
}

/// Imports a list and returns what is said of it.
fn import_list(dir: &Path, list: &str) -> String {
    fs::write(dir.join("list.csv"), list).expect("written");
    project(dir, &["import", "list.csv"]).expect(0).err
}

/// Writes a workbook with one sheet of these rows.
fn write_workbook(dir: &Path, rows: &[&[&str]]) {
    let rows = text_rows(rows);
    let book = workbook(&[("Ván", rows.as_str())], "", "");
    fs::write(dir.join("ván.xlsx"), book).expect("written");
}

#[test]
fn other_columns_of_a_list_of_blocks_are_kept_shown_and_restored() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    write_blocks(dir, &["b1", "b2"]);
    let header = [
        "Số hiệu ván",
        "Bản quét",
        "Ảnh trang",
        "Triều đại",
        "shelfmark",
    ];
    let first = ["b1", "b1.stl", "b1.png", "Nguyễn", "R.12"];
    let second = ["b2", "b2.stl", "b2.png", "", "R.13"];
    write_workbook(dir, &[&header, &first, &second]);
    let import = ["import", "ván.xlsx", "--json"];
    let imported = project(dir, &import).expect(0);
    assert_eq!(imported.json()["blocks"]["added"], 2);
    assert!(!imported.err.contains("metadata"), "{}", imported.err);
    let meta = |place: &str, block: &str| {
        let shown = mocban(dir, &["-C", place, "show", block, "--json"]);
        shown.expect(0).json()["meta"].clone()
    };
    let of_first = json!({ "Triều đại": "Nguyễn", "shelfmark": "R.12" });
    assert_eq!(meta("p", "b1"), of_first);
    let shown = project(dir, &["show", "b1"]).expect(0);
    for part in ["Triều đại", "Nguyễn", "R.12"] {
        assert!(shown.out.contains(part), "{part}: {}", shown.out);
    }
    let page = open_app(dir);
    let html = text(&page.get("/p/p/block/b2/"));
    assert!(html.contains("<dt>shelfmark</dt><dd>R.13</dd>"), "{html}");
    assert!(!html.contains("Triều đại"), "an empty cell is no metadata");
    drop(page);

    project(dir, &["backup", "b.sqlite"]).expect(0);
    mocban(dir, &["restore", "b.sqlite", "q"]).expect(0);
    assert_eq!(meta("q", "b1"), of_first);

    let changed = ["b1", "b1.stl", "b1.png", "Nguyễn", "R.14"];
    write_workbook(dir, &[&header, &changed, &second]);
    let again = project(dir, &import).expect(0).json();
    assert_eq!(again["blocks"]["changed"][0]["id"], "b1");
    assert_eq!(again["blocks"]["changed"][0]["fields"], json!(["metadata"]));
    assert_eq!(again["blocks"]["unchanged"], 1);
    assert_eq!(meta("p", "b1")["shelfmark"], "R.14");

    let line = r#"{"Khối":"b1","Bản quét":"b1.stl","Trang":"b1.png","shelfmark":14}"#;
    fs::write(dir.join("ván.jsonl"), line).expect("written");
    let lines = project(dir, &["import", "ván.jsonl", "--json"]).expect(0);
    assert_eq!(lines.json()["blocks"]["changed"][0]["id"], "b1");
    assert_eq!(meta("p", "b1"), json!({ "shelfmark": 14 }));

    let alone = [
        "import", "--block", "b1.stl", "--page", "b1.png", "--unit", "mm", "--json",
    ];
    let alone = project(dir, &alone).expect(0).json();
    assert_eq!(alone["blocks"]["changed"][0]["fields"], json!(["unit"]));
    assert_eq!(meta("p", "b1"), json!({ "shelfmark": 14 }));
}

#[test]
fn folders_keep_the_columns_of_a_list_of_pairs() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    for (file, content) in [("m/a.stl", "solid a"), ("i/a.png", "no image")] {
        let file = dir.join(file);
        fs::create_dir_all(file.parent().expect("a folder")).expect("created");
        fs::write(file, content).expect("written");
    }
    let list = "id,mesh,print,character,block,scanned_face_down,shelfmark\na,m/a.stl,i/a.png,天,k1,yes,R.1\n";
    fs::write(dir.join("pairs.csv"), list).expect("written");
    project(dir, &["import", "pairs.csv"]).expect(0);
    let folders = ["import", "--meshes", "m", "--prints", "i", "--json"];
    let again = project(dir, &folders).expect(0).json();
    assert_eq!(again["unchanged"], 1, "{again}");
    let shown = project(dir, &["show", "a", "--json"]).expect(0).json();
    assert_eq!(shown["meta"], json!({ "shelfmark": "R.1" }));
    let columns = ["character", "block", "scanned_face_down"].map(|column| shown[column].clone());
    assert_eq!(columns, [json!("天"), json!("k1"), json!(true)]);
}

#[test]
fn a_list_that_lacks_a_known_column_says_what_is_lost() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    write_blocks(dir, &["b1", "b2"]);
    fs::write(dir.join("l.json"), "{}").expect("written");
    let import = |list: &str| import_list(dir, list);
    let labels =
        "block,mesh,page,labels,unit\nb1,b1.stl,b1.png,l.json,mm\nb2,b2.stl,b2.png,l.json,mm\n";
    let first = import(labels);
    assert!(!first.contains("missing in this import"), "{first}");
    let again = import("block,mesh,page,unit\nb1,b1.stl,b1.png,mm\nb2,b2.stl,b2.png,\n");
    for sentence in [
        "2 known blocks lose their labels, empty or missing in this import, first b1; if that was not meant, import again with these values",
        "1 known block loses its unit, empty or missing in this import: b2; ",
    ] {
        assert!(again.contains(sentence), "{again}");
    }
    let pairs = "id,mesh,print,character,block\na,b1.stl,b1.png,天,k1\n";
    import(pairs);
    let again = import("id,mesh,print,character\na,b1.stl,b1.png,天\n");
    let sentence = "1 known pair loses its block, empty or missing in this import: a; ";
    assert!(again.contains(sentence), "{again}");
    assert!(!again.contains("its character"), "{again}");
}

#[test]
fn metadata_that_an_import_empties_is_named_by_column() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    write_blocks(dir, &["b1"]);
    let import = |list: &str| import_list(dir, list);
    import("block,mesh,page,shelf,room\nb1,b1.stl,b1.png,R.1,2\n");
    import("id,mesh,print,shelf,room\na,b1.stl,b1.png,R.1,2\n");
    for (list, sentence) in [
        (
            "block,mesh,page,room\nb1,b1.stl,b1.png,2\n",
            "1 known block loses its \"shelf\", empty or missing in this import: b1; ",
        ),
        (
            "id,mesh,print,room\na,b1.stl,b1.png,2\n",
            "1 known pair loses its \"shelf\", empty or missing in this import: a; ",
        ),
        (
            "id,mesh,print,shelf,room\na,b1.stl,b1.png,R.1,\n",
            "1 known pair loses its \"room\", empty or missing in this import: a; ",
        ),
    ] {
        let again = import(list);
        assert!(again.contains(sentence), "{again}");
        assert_eq!(again.matches("empty or missing").count(), 1, "{again}");
    }
}

#[test]
fn the_app_says_which_columns_and_pages_a_list_of_blocks_changes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    write_blocks(dir, &["b1"]);
    fs::copy(dir.join("b1.png"), dir.join("other.png")).expect("copied");
    let list = dir.join("list.csv");
    let write = |text: &str| fs::write(&list, text).expect("written");
    let header = "Ván,Bản quét,Trang in,Ghi chú,Kho lưu";
    write(&format!("{header}\nb1,b1.stl,b1.png,x,R.12\n"));
    project(dir, &["import", "list.csv"]).expect(0);
    let page = open_app(dir);
    let query = format!("project=p&list={}", encode(list.to_str().expect("UTF-8")));
    let shown = || text(&page.get(&format!("/import?{query}&language=vi")));
    let same = shown();
    assert!(!same.contains("column-changes"), "{same}");
    assert!(same.contains("đổi tệp của các ván đã có"), "{same}");
    write("Ván,Bản quét,Trang in\nb1,b1.stl,other.png\n");
    let changed = shown();
    for part in [
        "Số ván được đổi bản quét hoặc trang in: <b>1</b>",
        "Số ván mất giá trị ở các cột khác: <b>1</b> (Ghi chú, Kho lưu)",
    ] {
        assert!(changed.contains(part), "{part}: {changed}");
    }
}
