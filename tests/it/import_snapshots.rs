//! Snapshots of imports: lists of pairs, and directories.

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
