//! Commands that are refused leave everything as it was.

use std::fmt::Write as _;
use std::path::Path;

use crate::backup::files;
use crate::cli::{Call, binary, call, empty, mocban};
use crate::postgres_server::url;

/// Rows of more than two chunks that an import sends to the catalog.
const ROWS: usize = 5_000;

/// Writes a list whose last row names a missing file, and imports it.
fn import_with_a_wrong_last_row(root: &Path, args: &[&str]) -> Call {
    for name in ["a.stl", "a.png"] {
        std::fs::write(root.join(name), "x").expect("written");
    }
    let mut list = "id,mesh,print\n".to_owned();
    for row in 0..ROWS {
        // Writing to a string does not fail.
        let _ = writeln!(list, "r{row},a.stl,a.png");
    }
    list += "last,missing.stl,a.png\n";
    std::fs::write(root.join("list.csv"), list).expect("written");
    mocban(root, &[args, &["import", "list.csv"]].concat())
}

#[test]
fn an_import_with_an_error_in_its_last_row_adds_nothing() {
    let dir = empty();
    let root = dir.path();
    std::fs::write(root.join("one.csv"), "id,mesh,print\none,b,c\n").expect("written");
    let first = ["-C", "p", "-q", "import", "--allow-missing", "one.csv"];
    mocban(root, &first).expect(0);
    let refused = import_with_a_wrong_last_row(root, &["-C", "p"]).expect(2);
    assert!(refused.err.contains("missing.stl"), "{}", refused.err);
    let status = mocban(root, &["-C", "p", "status", "--json"]).expect(0);
    assert_eq!(status.json()["pairs"], 1);
}

#[test]
fn an_import_that_is_refused_creates_no_catalog_on_a_server() {
    let Some(url) = url() else { return };
    let dir = empty();
    let server = format!(
        "{url}&options=-c%20search_path%3Drefused{}",
        std::process::id()
    );
    let at = ["-C", "p", "--catalog", &server];
    import_with_a_wrong_last_row(dir.path(), &at).expect(2);
    assert!(!dir.path().join("p").exists());
    let status = mocban(dir.path(), &["--catalog", &server, "status"]);
    assert!(status.err.contains("there is no catalog"), "{}", status.err);
}

#[test]
fn a_demo_that_is_refused_writes_nothing() {
    let dir = empty();
    let data = dir.path().join("d/data");
    std::fs::create_dir_all(&data).expect("a folder");
    std::fs::write(data.join("mine"), "ten years").expect("written");
    for kind in [&[] as &[&str], &["--block"]] {
        let demo = ["demo", "d", "--no-run", "--set", "run.workers=1"];
        mocban(dir.path(), &[&demo[..], kind].concat()).expect(2);
        assert_eq!(files(&dir.path().join("d")), ["data"]);
    }
    let address = "postgres://me:secret@db.example/lab";
    let demo = ["demo", "other", "--no-run", "--catalog", address];
    mocban(dir.path(), &demo).expect(2);
    assert!(!dir.path().join("other").exists());
}

#[test]
fn a_demo_never_goes_to_a_server_or_a_store_that_settings_name() {
    let dir = empty();
    let server = "postgres://db.example/lab";
    let store = "s3://lab/x";
    let set_store = format!("storage.artifacts={store}");
    let pairs: &[&str] = &["demo", "d", "--pairs", "1", "--no-run"];
    for (variable, args, more) in [
        ("MOCBAN_STORAGE__CATALOG", pairs, &[] as &[&str]),
        ("MOCBAN_STORAGE__CATALOG", &["demo", "d", "--block"], &[]),
        ("MOCBAN_NONE", pairs, &["--catalog", server]),
        ("MOCBAN_NONE", pairs, &["--set", &set_store]),
    ] {
        let mut command = binary();
        command.current_dir(dir.path());
        if variable != "MOCBAN_NONE" {
            command.env(variable, server);
        }
        let refused = call(command.args(args).args(more)).expect(2);
        let says = "so commands on the demo would work there";
        assert!(refused.err.contains(says), "{}", refused.err);
        assert!(!dir.path().join("d").exists());
    }
    let mut command = binary();
    command.current_dir(dir.path());
    command.env("MOCBAN_STORAGE__CATALOG", server);
    let local = ["demo", "d", "--pairs", "1", "--no-run", "--catalog", ""];
    call(command.args(local)).expect(0);
    assert!(dir.path().join("d/catalog.sqlite").is_file());
}

#[test]
fn manual_pages_replace_only_pages_of_this_program() {
    let dir = empty();
    let pages = dir.path().join("pages");
    mocban(dir.path(), &["man", "pages"]).expect(0);
    let page = pages.join("mocban.1");
    let written = std::fs::read_to_string(&page).expect("a page");
    std::fs::write(&page, written.replace("mocban ", "mocban  ")).expect("written");
    mocban(dir.path(), &["man", "pages"]).expect(0);
    assert_eq!(std::fs::read_to_string(&page).expect("a page"), written);

    let mine = pages.join("mocban-run.1");
    std::fs::write(&mine, "my notes").expect("written");
    std::fs::remove_file(&page).expect("removed");
    let before = files(&pages);
    let refused = mocban(dir.path(), &["man", "pages"]).expect(2);
    assert!(
        refused
            .err
            .contains("mocban-run.1 exists and is not a manual page of this program"),
        "{}",
        refused.err
    );
    assert_eq!(files(&pages), before);
    assert_eq!(std::fs::read_to_string(&mine).expect("mine"), "my notes");
}
