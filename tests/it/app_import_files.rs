//! What the page of imports says of the files before anything is stored: their sizes, their unit, and which cannot be used.

use std::path::Path;

use mocban::raster::{ImageLimits, decode};
use serde_json::{Value, json};

use crate::app::{html, open_app, text, with_project};
use crate::app_import::{copy_inputs, folders};
use crate::app_uploads::encode;
use crate::page::Page;
use crate::small_block::{demo_block, few_labels};

/// Returns the query of an import of two folders.
fn query(dir: &Path, more: &str) -> String {
    let folder = |name: &str| encode(dir.join(name).to_str().expect("UTF-8"));
    let [meshes, prints] = [folder("x/scans"), folder("x/prints")];
    format!("?project=new&meshes={meshes}&prints={prints}{more}")
}

fn files(page: &Page, query: &str) -> String {
    html(page, &format!("/import/files{query}"))
}

/// Returns all files that cannot be used, and the number of pairs.
fn problems(page: &Page, query: &str) -> (Vec<String>, Value) {
    let (mut found, mut after) = (Vec::new(), json!(0));
    loop {
        let reply = page
            .get(&format!("/import/problems{query}&after={after}"))
            .json();
        let more = reply["problems"].as_array().expect("a list").iter();
        found.extend(more.map(|line| line.as_str().expect("a text").to_owned()));
        if reply["next"].is_null() {
            return (found, reply["looked_at"].clone());
        }
        assert!(
            reply["next"].as_u64() > after.as_u64(),
            "it goes on: {reply}"
        );
        after = reply["next"].clone();
    }
}

#[test]
fn sizes_and_the_unit_are_shown_before_the_import() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(
        dir,
        &[
            ("meshes/upright-0000.ply", "x/scans/1.ply"),
            ("prints/upright-0000.jpg", "x/prints/1.jpg"),
        ],
    );
    let shown = folders(&page, dir, "");
    for part in [
        "data-load=\"./import/files?",
        "data-address=\"./import/problems?",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let english = files(&page, &query(dir, ""));
    for part in [
        " px</td>",
        " mm</td>",
        "probably mm",
        "id=\"use-unit\"",
        "unit=mm",
    ] {
        assert!(english.contains(part), "{part}: {english}");
    }
    let chosen = files(&page, &query(dir, "&unit=mm"));
    assert!(chosen.contains("mm, as chosen"), "{chosen}");
    assert!(!chosen.contains("use-unit"), "{chosen}");
    let wrong = files(&page, &query(dir, "&unit=m"));
    assert!(wrong.contains("m, as chosen; more likely mm"), "{wrong}");
    let vietnamese = files(&page, &query(dir, "&language=vi"));
    assert!(vietnamese.contains("có lẽ là mm"), "{vietnamese}");
    page.get("/?language=en");
    assert!(!dir.join("new").exists(), "nothing is stored");
}

#[test]
fn files_that_cannot_be_used_are_named_before_the_import() {
    let (dir, page) = with_project();
    let dir = dir.path();
    let inputs = ["empty", "cut", "lfs", "text", "whole"].map(|name| {
        let to = [
            format!("x/scans/{name}.ply"),
            format!("x/prints/{name}.jpg"),
        ];
        let from = ["meshes/upright-0000.ply", "prints/upright-0000.jpg"];
        for (from, to) in from.into_iter().zip(&to) {
            copy_inputs(dir, &[(from, to.as_str())]);
        }
        to.map(|path| dir.join(path))
    });
    let [[empty, _], [cut, cut_print], [lfs, _], [_, no_print], _] = inputs;
    let write = |path: &Path, bytes: &[u8]| std::fs::write(path, bytes).expect("written");
    write(&empty, b"");
    for path in [&cut, &cut_print] {
        let bytes = std::fs::read(path).expect("a file");
        // A mesh of this length is read as a whole.
        write(path, &bytes[..bytes.len() / 4]);
    }
    write(
        &lfs,
        b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n",
    );
    write(&no_print, b"notes");
    let (found, pairs) = problems(&page, &query(dir, ""));
    assert_eq!((found.len(), pairs), (5, json!(5)), "{found:#?}");
    for (name, part) in [
        ("empty: ", "the file is empty"),
        ("cut: ", "truncated"),
        ("lfs: ", "Git LFS"),
        ("text: ", "the file is text"),
    ] {
        let is_named = |line: &String| line.starts_with(name) && line.contains(part);
        assert!(found.iter().any(is_named), "{name}{part}: {found:#?}");
    }
    let table = files(&page, &query(dir, ""));
    assert_eq!(table.matches("class=\"bad\"").count(), 5, "{table}");
    page.get("/?language=vi");
    let (found, _) = problems(&page, &query(dir, ""));
    assert!(
        found.iter().any(|line| line.contains("tệp rỗng")),
        "{found:#?}"
    );
    page.get("/?language=en");
}

#[test]
fn files_outside_the_folders_of_the_user_are_not_opened() {
    let (dir, page) = with_project();
    let list = dir.path().join("list.csv");
    std::fs::write(&list, "id,mesh,print\na,/etc/passwd,/etc/hosts\n").expect("written");
    let list = encode(list.to_str().expect("UTF-8"));
    let query = format!("?project=new&list={list}");
    let (found, pairs) = problems(&page, &query);
    assert_eq!((found, pairs), (Vec::new(), json!(1)), "no faults");
    let table = files(&page, &query);
    let said = "not looked at: it is outside your folders and disks";
    assert_eq!(table.matches(said).count(), 2, "{table}");
}

#[test]
fn all_pairs_of_a_large_folder_are_looked_at_in_steps() {
    let (dir, page) = with_project();
    let dir = dir.path();
    for number in 0..1005 {
        for (folder, ending) in [("scans", "stl"), ("prints", "png")] {
            let file = dir.join(format!("x/{folder}/{number}.{ending}"));
            std::fs::create_dir_all(file.parent().expect("a folder")).expect("created");
            std::fs::write(file, "").expect("written");
        }
    }
    let (found, pairs) = problems(&page, &query(dir, ""));
    assert_eq!((found.len(), pairs), (2010, json!(1005)));
    let last = files(&page, &query(dir, "&from=1000"));
    assert_eq!(last.matches("<th scope=\"row\">").count(), 5, "{last}");
}

#[test]
fn all_rows_of_a_long_list_are_looked_at_in_steps() {
    let (dir, page) = with_project();
    let dir = dir.path();
    std::fs::create_dir(dir.join("x")).expect("a folder");
    let row = |number: u32| format!("{number},x/{number}.stl,x/{number}.png\n");
    let rows: Vec<String> = (0..1005).map(row).collect();
    let list = format!("id,mesh,print\n{}", rows.concat());
    std::fs::write(dir.join("list.csv"), list).expect("written");
    for number in 0..1005 {
        for ending in ["stl", "png"] {
            std::fs::write(dir.join(format!("x/{number}.{ending}")), "").expect("written");
        }
    }
    let list = encode(dir.join("list.csv").to_str().expect("UTF-8"));
    let query = format!("?project=new&list={list}");
    page.get(&format!("/import{query}"));
    let (found, pairs) = problems(&page, &query);
    assert_eq!((found.len(), pairs), (2010, json!(1005)));
    let last = files(&page, &format!("{query}&from=1000"));
    assert_eq!(last.matches("<th scope=\"row\">").count(), 5, "{last}");
}

#[test]
fn a_unit_that_all_files_name_is_offered_and_said_to_be_unused() {
    let (dir, page) = with_project();
    let dir = dir.path();
    for (name, bytes) in [
        (
            "x/scans/1.xyz",
            &b"# units: m\n0 0 0\n0.04 0.03 0\n0 0.01 0\n"[..],
        ),
        ("x/prints/1.png", &b""[..]),
    ] {
        let file = dir.join(name);
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("created");
        std::fs::write(file, bytes).expect("written");
    }
    let shown = files(&page, &query(dir, ""));
    for part in [
        "m, as the file says; not used unless it is chosen",
        "id=\"use-unit\"",
        "unit=m",
        "1 / 1 of the scans shown here",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
}

#[test]
fn a_block_is_shown_with_its_page_labels_and_scan_before_the_import() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = dir.path();
    demo_block(root);
    few_labels(root, &root.join("few.json"));
    let rows = "block,mesh,page,labels\n\
        b1,d/data/block.ply,d/data/page.jpg,few.json\n\
        b2,d/data/block.ply,d/data/page.jpg,d/data/block.ply\n";
    std::fs::write(root.join("blocks.csv"), rows).expect("written");
    let page = open_app(root);
    let list = encode(root.join("blocks.csv").to_str().expect("UTF-8"));
    let query = format!("?project=new&list={list}");
    let shown = files(&page, &query);
    for part in [
        "Labels: <b>6</b> characters (VIA 2)",
        " mm</td>",
        "import/picture/page?",
        "import/picture/scan?",
        "loading=\"lazy\"",
        "class=\"bad\"",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let (found, blocks) = problems(&page, &query);
    assert_eq!((found.len(), blocks), (1, json!(2)), "{found:#?}");
    assert!(found[0].starts_with("b2: "), "{found:#?}");
    let picture =
        |kind: &str, place: u32| page.get(&format!("/import/picture/{kind}{query}&place={place}"));
    let drawn = |kind: &str, place: u32| {
        let reply = picture(kind, place);
        assert_eq!(reply.status, 200, "{kind}: {}", text(&reply));
        assert_eq!(reply.header("content-type"), Some("image/jpeg"), "{kind}");
        let image = decode(&reply.body, &ImageLimits::SUGGESTED).expect("a picture");
        let longest = image.rgb.width().max(image.rgb.height());
        assert!((500..=560).contains(&longest), "{kind}: {longest} pixels");
        image.rgb.to_rgb16().into_owned()
    };
    let is_vermillion = |colour: &[u16; 3]| {
        let [red, green, blue] = colour.map(|value| value >> 8);
        red > 160 && (40..150).contains(&green) && blue < 90
    };
    let marked = |place: u32| {
        let image = drawn("page", place);
        image
            .data()
            .iter()
            .filter(|colour| is_vermillion(colour))
            .count()
    };
    assert!(marked(0) > 100, "the boxes of the labels");
    assert!(marked(1) < marked(0) / 4, "a mesh is no labels");
    let scan = drawn("scan", 0);
    let first = scan.data()[scan.data().len() / 2];
    assert!(
        scan.data().iter().any(|colour| *colour != first),
        "a relief"
    );
    for (kind, place) in [("page", 2), ("scan", 9), ("other", 0)] {
        assert_eq!(picture(kind, place).status, 404, "{kind} {place}");
    }
    let nothing = page.get("/import/picture/page?project=new");
    assert_eq!(nothing.status, 404);
    assert!(!root.join("new").exists(), "nothing is stored");
}
