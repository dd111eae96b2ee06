//! Ids and file names as people write them: with accents, spaces and punctuation, composed and decomposed, with the
//! backslashes of Windows, misspelt, or missing.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use unicode_normalization::UnicodeNormalization as _;

use crate::cli::{binary, call, mocban};

/// The ids of the pairs, and the file names that their exports have. The third is decomposed (NFD) as it is written.
const IDS: [[&str; 2]; 3] = [
    ["chữ số 1", "chữ số 1"],
    ["tờ 3: 天?", "tờ 3%3A 天%3F"],
    ["b01.chu\u{31b}\u{303}", "b01.chữ"],
];

/// Writes the demo's inputs below `data`, and a list with the ids. Folder and file names are decomposed on disk; the
/// list writes them composed, and with backslashes in its last row.
fn write_inputs(dir: &Path) {
    mocban(dir, &["demo", "d", "--pairs", "3", "--no-run"]).expect(0);
    let mut list = "id,mesh,print,character\n".to_owned();
    for (k, [id, _]) in IDS.iter().enumerate() {
        let folder = dir.join("data").join("biản khắc".nfd().collect::<String>());
        fs::create_dir_all(&folder).expect("a folder");
        for (kind, name) in [("meshes", "lưới"), ("prints", "in")] {
            let file = fs::read_dir(dir.join("d/data").join(kind))
                .expect("a folder")
                .map(|entry| entry.expect("an entry").path())
                .find(|path| path.to_string_lossy().contains(&format!("upright-{k:04}")))
                .expect("an input");
            let extension = file.extension().expect("an extension").to_string_lossy();
            fs::copy(&file, folder.join(format!("{name} {k}.{extension}"))).expect("copied");
            let slash = if k == 2 { "\\" } else { "/" };
            let cell = format!("data{slash}biản khắc{slash}{name} {k}.{extension}");
            if kind == "meshes" {
                let _ = write!(list, "{id},{cell}");
            } else {
                let _ = writeln!(list, ",{cell},天");
            }
        }
    }
    fs::write(dir.join("pairs.csv"), list).expect("written");
}

#[test]
#[cfg(unix)]
fn pairs_with_vietnamese_names_are_aligned_shown_and_exported() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_inputs(dir.path());
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["import", "pairs.csv"]).expect(0);
    let again = at(&["import", "pairs.csv", "--json"]).expect(0).json();
    assert_eq!(again["unchanged"], 3);
    at(&["run"]).expect(0);
    // Composed, although the list has the id decomposed.
    let shown = at(&["show", "b01.chữ", "--json"]).expect(0).json();
    assert_eq!(shown["name"], "b01.chữ");
    at(&["export", "--to", "jsonl,webdataset,mesh", "-o", "out"]).expect(0);
    let lines = fs::read_to_string(dir.path().join("out/jsonl/pairs.jsonl")).expect("lines");
    for [_, folder] in IDS {
        assert!(
            dir.path().join("out/jsonl/pairs").join(folder).is_dir(),
            "{folder}"
        );
        assert!(
            dir.path().join("out/mesh/pairs").join(folder).is_dir(),
            "{folder}"
        );
    }
    for line in lines.lines() {
        let line: Value = serde_json::from_str(line).expect("JSON");
        for file in line["files"].as_object().expect("files").values() {
            let path = dir
                .path()
                .join("out/jsonl")
                .join(file.as_str().expect("a path"));
            assert!(path.is_file(), "{}", path.display());
        }
    }
    let shard =
        fs::File::open(dir.path().join("out/webdataset/pairs-000000.tar")).expect("a shard");
    let mut shard = tar::Archive::new(shard);
    let keys = shard.entries().expect("entries").map(|entry| {
        let path = entry
            .expect("an entry")
            .path()
            .expect("a path")
            .into_owned();
        path.to_string_lossy()
            .split('.')
            .next()
            .expect("a key")
            .to_owned()
    });
    let mut keys: Vec<String> = keys.collect();
    keys.sort();
    keys.dedup();
    assert_eq!(keys, ["b01%2Echữ", "chữ số 1", "tờ 3%3A 天%3F"]);
    // An export with these names is recognized and replaced.
    at(&["export", "--to", "jsonl,webdataset,mesh", "-o", "out"]).expect(0);
    at(&["check"]).expect(0);
}

#[test]
fn missing_files_are_named_and_nothing_is_imported() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let mut rows = String::new();
    for k in 0..30 {
        let _ = writeln!(rows, "{k},m/{k}.stl,p/{k}.png");
    }
    fs::write(
        dir.path().join("pairs.csv"),
        format!("id,mesh,print\n{rows}"),
    )
    .expect("written");
    let refused = mocban(dir.path(), &["-C", "p", "import", "pairs.csv"]).expect(2);
    assert!(
        refused
            .err
            .contains("60 files are missing, nothing was imported"),
        "{}",
        refused.err
    );
    assert!(
        refused
            .err
            .contains("pairs.csv: line 2: mesh m/0.stl of 0 does not exist"),
        "{}",
        refused.err
    );
    assert!(refused.err.contains("and 50 more"), "{}", refused.err);
    assert!(refused.err.contains("--allow-missing"), "{}", refused.err);
    assert!(!dir.path().join("p").exists());
    let taken = mocban(
        dir.path(),
        &[
            "-C",
            "p",
            "import",
            "pairs.csv",
            "--allow-missing",
            "--json",
        ],
    );
    let taken = taken.expect(0).json();
    assert_eq!(taken["added"], 30);
    assert_eq!(taken["missing_files"].as_array().map(Vec::len), Some(60));
}

#[test]
fn a_list_in_a_windows_encoding_is_recognized() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    // "chữ" in Windows-1258, and "café" in Windows-1252.
    for (cell, name) in [
        (&b"ch\xfd\xde"[..], "Windows-1258"),
        (&b"caf\xe9"[..], "Windows-1252"),
    ] {
        let list = [b"id,mesh,print\na,", cell, b".stl,b.png\n"].concat();
        fs::write(dir.path().join("pairs.csv"), list).expect("written");
        let refused = mocban(dir.path(), &["-C", "p", "import", "pairs.csv"]).expect(2);
        assert!(refused.err.contains(name), "{}", refused.err);
        assert!(refused.err.contains("CSV UTF-8"), "{}", refused.err);
    }
}

#[test]
fn a_misspelt_column_is_named() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    fs::write(dir.path().join("pairs.csv"), "id,mech,print\na,b,c\n").expect("written");
    let refused = mocban(dir.path(), &["-C", "p", "import", "pairs.csv"]).expect(2);
    assert!(
        refused.err.contains("rename \"mech\" to \"mesh\""),
        "{}",
        refused.err
    );
}

#[test]
fn folders_and_files_of_the_command_line_are_found_in_any_form() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    mocban(dir.path(), &["demo", "d", "--pairs", "1", "--no-run"]).expect(0);
    let on_disk = |name: &str| dir.path().join(name.nfd().collect::<String>());
    for (from, to) in [("meshes", "lưới"), ("prints", "bản in")] {
        fs::rename(dir.path().join("d/data").join(from), on_disk(to)).expect("renamed");
    }
    let import = [
        "-C", "p", "import", "--meshes", "lưới", "--prints", "bản in",
    ];
    let outcome = mocban(dir.path(), &[&import[..], &["--json"]].concat());
    assert_eq!(outcome.expect(0).json()["added"], 1);
    fs::write(
        on_disk("danh sách.csv"),
        "id,mesh,print\nmột,lưới/upright-0000.ply,bản in/upright-0000.jpg\n",
    )
    .expect("written");
    let list = ["-C", "q", "import", "danh sách.csv", "--json"];
    assert_eq!(mocban(dir.path(), &list).expect(0).json()["added"], 1);
    let files = ["lưới/upright-0000.ply", "bản in/upright-0000.jpg"];
    mocban(dir.path(), &[&["align"], &files[..]].concat()).expect(0);
}

#[test]
fn a_run_takes_its_names_from_a_file_or_the_standard_input() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    mocban(dir.path(), &["demo", "p", "--pairs", "4", "--no-run"]).expect(0);
    let file = dir.path().join("names.txt");
    let planned = |args: &[&str]| {
        let mut run = binary();
        run.current_dir(dir.path())
            .args(["-C", "p", "run", "--dry-run", "--json", "--names-from"])
            .args(args)
            .stdin(fs::File::open(&file).expect("a file"));
        call(&mut run)
    };
    // As programs of Windows write it, with blanks of a spreadsheet.
    fs::write(
        &file,
        "\u{feff}upright-0000 \r\n\r\n\tupright-0002\r\n \r\n",
    )
    .expect("written");
    for (args, pairs) in [
        (&["-"][..], 2),
        (&["names.txt"], 2),
        (&["-", "upright-0003"], 3),
    ] {
        let plan = planned(args).expect(0).json();
        assert_eq!(plan["pairs"], pairs, "{args:?}: {plan}");
    }
    for (bytes, code, part) in [
        (&b"upright-0000\nnobody\n"[..], 4, "nobody"),
        (b"\n", 4, "has no names"),
        (b"ch\xff", 2, "is not UTF-8"),
    ] {
        fs::write(&file, bytes).expect("written");
        for from in ["-", "names.txt"] {
            let refused = planned(&[from]).expect(code);
            assert!(refused.err.contains(part), "{}", refused.err);
        }
    }
    let missing = planned(&["missing.txt"]).expect(2);
    assert!(missing.err.contains("missing.txt"), "{}", missing.err);
}
