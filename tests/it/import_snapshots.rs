//! Snapshots of imports: lists of pairs as people have them, workbooks, and directories.

use mocban::workbook::test_helpers::{text_rows, workbook};

use crate::check::{at, done};
use crate::cli::{empty, mocban};
use crate::snapshots::{TWO_PAIRS, assert_call, write};

#[test]
fn import() {
    let dir = empty();
    let args = ["-C", "p", "import", "pairs.csv", "--allow-missing"];
    write(dir.path(), "pairs.csv", TWO_PAIRS);
    assert_call("import_new", dir.path(), &args);
    assert_call("import_unchanged", dir.path(), &args);
    write(
        dir.path(),
        "pairs.csv",
        &TWO_PAIRS.replace("b.png", "B.png"),
    );
    assert_call("import_changed", dir.path(), &args);
    assert_call(
        "import_json",
        dir.path(),
        &[
            "-C",
            "p",
            "--json",
            "import",
            "pairs.csv",
            "--allow-missing",
        ],
    );
    write(
        dir.path(),
        "pairs.csv",
        "id,mesh,print,charactr,unitt\na,a.stl,a.png,x,mm\n",
    );
    assert_call("import_misspelt_columns", dir.path(), &args);
    write(
        dir.path(),
        "case.csv",
        "id,mesh,print\nA1,pairs.csv,pairs.csv\na1,pairs.csv,pairs.csv\n",
    );
    assert_call(
        "import_similar_ids",
        dir.path(),
        &["-C", "q", "import", "case.csv", "--allow-missing"],
    );
}

#[test]
fn lists_as_spreadsheets_and_scripts_write_them() {
    let dir = empty();
    std::fs::create_dir(dir.path().join("quét")).expect("a directory");
    for name in ["quét/0117.STL", "quét/bản in 117.png"] {
        write(dir.path(), name, "x");
    }
    let rows = [
        &[
            "Số hiệu",
            "Bản quét",
            "Bản in",
            "Tên chữ",
            "Khối",
            "Ghi chú",
        ][..],
        &[
            "0117",
            "quét/0117.STL",
            "quét/bản\u{a0}in 117.png",
            "天",
            "4",
            "x",
        ],
    ];
    let sheets = [("Ván 4", text_rows(&rows)), ("Ván 5", String::new())];
    let sheets = sheets.each_ref().map(|(name, rows)| (*name, rows.as_str()));
    std::fs::write(dir.path().join("cặp.xlsx"), workbook(&sheets, "", "")).expect("written");
    let import = |list| ["-C", "p", "import", list];
    assert_call("import_xlsx", dir.path(), &import("cặp.xlsx"));
    let sheet = [&import("cặp.xlsx")[..], &["--sheet", "Ván 6"]].concat();
    assert_call("error_no_sheet", dir.path(), &sheet);
    write(
        dir.path(),
        "117.csv",
        "sep=;\nid;mesh;print\n117;quét/0117.STL;quét/bản in 117.png\n",
    );
    assert_call("error_lost_zeros", dir.path(), &import("117.csv"));
    write(
        dir.path(),
        "nhan.json",
        "[{\"id\": 118, \"mesh\": \"Quét/117.stl\", \"print\": \"quét/bản in 117.tif\", \"block\": NaN}]",
    );
    assert_call("error_similar_files", dir.path(), &import("nhan.json"));
    write(
        dir.path(),
        "chấm.csv",
        "Mã số,Đánh giá,Người chấm\n117,Đạt,lan\n",
    );
    let verdicts = ["-C", "p", "verdict", "import", "chấm.csv"];
    assert_call("error_verdict_of_similar_pair", dir.path(), &verdicts);
}

#[test]
fn import_of_directories() {
    let dir = empty();
    for folder in ["bản khắc", "bản in"] {
        std::fs::create_dir(dir.path().join(folder)).expect("a directory");
    }
    for name in ["bản khắc/1.stl", "bản khắc/2.stl", "bản khắc/notes.txt"] {
        write(dir.path(), name, "x");
    }
    for name in ["bản in/1.png", "bản in/3.png"] {
        write(dir.path(), name, "x");
    }
    let folders = ["--meshes", "bản khắc", "--prints", "bản in"];
    let import = ["-C", "dự án", "import"];
    let args = [&import[..], &folders].concat();
    assert_call("import_directories", dir.path(), &args);
    let swapped = ["--meshes", "bản in", "--prints", "bản khắc"];
    let args_swapped = [&import[..], &swapped].concat();
    assert_call("error_swapped_directories", dir.path(), &args_swapped);
    write(dir.path(), "bản khắc/1.ply", "x");
    assert_call("error_same_stem", dir.path(), &args);
    std::fs::remove_file(dir.path().join("bản khắc/1.ply")).expect("removed");
    for (folder, extension) in [("bản khắc", "stl"), ("bản in", "png")] {
        for block in ["ván 1", "ván 2"] {
            std::fs::create_dir(dir.path().join(folder).join(block)).expect("a directory");
            for k in 1..4 {
                write(
                    dir.path(),
                    &format!("{folder}/{block}/{k}.{extension}"),
                    "x",
                );
            }
        }
    }
    assert_call("import_directories_in_directories", dir.path(), &args);
    let block = |name: &str| ["bản khắc", "bản in"].map(|folder| format!("{folder}/{name}"));
    for (name, block) in ["ván 1", "ván 2"].map(|name| (name, block(name))) {
        let folders = ["--meshes", &block[0], "--prints", &block[1]];
        let args = [&["-C", "q", "import"][..], &folders].concat();
        if name == "ván 1" {
            mocban(dir.path(), &args).expect(0);
        } else {
            assert_call("error_changed_files", dir.path(), &args);
        }
    }
}

#[test]
fn workbooks_of_blocks_and_of_verdicts_are_read() {
    let dir = empty();
    let project = done(dir.path());
    let save = |name: &str, rows: &[&[&str]]| {
        let rows = text_rows(rows);
        let sheets = [("Ghi chú", ""), ("Danh sách", rows.as_str())];
        std::fs::write(dir.path().join(name), workbook(&sheets, "", "")).expect("written");
    };
    for name in ["ván.stl", "trang.png"] {
        write(dir.path(), name, "x");
    }
    save(
        "ván.xlsx",
        &[
            &["Khối", "mesh", "page", "unit"],
            &["Ván 4", "ván.stl", "trang.png", "mm"],
        ],
    );
    let import = [
        "-C",
        "q",
        "import",
        "ván.xlsx",
        "--sheet",
        "Danh sách",
        "--json",
    ];
    let imported = mocban(dir.path(), &import).expect(0).json();
    assert_eq!(imported["blocks"]["added"], 1);
    let block = mocban(dir.path(), &["-C", "q", "show", "Ván 4", "--json"]).expect(0);
    assert_eq!(block.json()["unit"], "mm", "{}", block.out);
    save(
        "đánh giá.xlsx",
        &[
            &["Pair", "Verdict", "Reviewer"],
            &["upright-0000", "đạt", "minh"],
            &["upright-0001", "không đạt", "minh"],
        ],
    );
    let file = dir.path().join("đánh giá.xlsx").display().to_string();
    let refused = at(&project, &["verdict", "import", &file]).expect(2).err;
    let sheets = "only the sheet \"Ghi chú\" is read; name another one with --sheet: \"Danh sách\"";
    assert!(refused.contains(sheets), "{refused}");
    assert!(
        refused.contains("columns pair, verdict, reviewer are missing"),
        "{refused}"
    );
    let verdicts = ["verdict", "import", &file, "--sheet", "Danh sách"];
    at(&project, &verdicts).expect(0);
    for (pair, verdict) in [("upright-0000", "pass"), ("upright-0001", "fail")] {
        let log = at(&project, &["verdict", "log", pair, "--json"]).expect(0);
        let line = log.out.lines().find(|line| line.contains("\"minh\""));
        let line = line.unwrap_or_else(|| panic!("{pair}: {}", log.out));
        let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert_eq!(line["verdict"], verdict, "{pair}");
    }
}

#[test]
fn the_same_files_under_another_spelling_or_another_id_are_recognized() {
    let dir = empty();
    let root = dir.path();
    for folder in ["lists/old", "a"] {
        std::fs::create_dir_all(root.join(folder)).expect("folders");
    }
    for file in ["a/1.ply", "a/1.png", "a/2.ply", "a/2.png"] {
        write(root, file, "x");
    }
    let old = "id,mesh,print\n1,../../a/1.ply,../../a/1.png\n2,../../a/2.ply,../../a/2.png\n";
    write(root, "lists/old/pairs.csv", old);
    write(root, "pairs.csv", &old.replace("../../", ""));
    write(root, "more.csv", "id,mesh,print\nm,./a/1.ply,a/1.png\n");
    let import = |list: &str| mocban(root, &["-C", "p", "import", list]).expect(0).err;
    import("lists/old/pairs.csv");
    let again = import("pairs.csv");
    let unchanged = "0 pairs added, 0 changed, 2 unchanged";
    assert!(again.contains(unchanged), "{again}");
    let more = import("more.csv");
    let known = "pairs with the same mesh and print as one of the project: 1, first m, as 1";
    assert!(more.contains(known), "{more}");
}
