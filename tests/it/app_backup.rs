//! The backup of the app with the scans and prints, and the project that is restored from it.

use serde_json::json;

use crate::app::{act, app, open_app, text, token, with_project};
use crate::app_kills::{HeldApp, UNTIL_KILLED};
use crate::app_uploads::encode;
use crate::backup::files as names;
use crate::fault::Fault;
use crate::page::{Page, read_project};
use crate::waiting::wait_until;

#[test]
fn scans_and_prints_are_saved_beside_the_backup_and_restored() {
    let (dir, page) = with_project();
    let root = dir.path().canonicalize().expect("a path");
    let health = text(&page.get("/p/p/health"));
    for part in ["id=\"with-inputs\"", "data-load=\"health/inputs\""] {
        assert!(health.contains(part), "{part}: {health}");
    }
    let backup = root.join("p/backups/backup.sqlite");
    let shown = encode(backup.to_str().expect("UTF-8"));
    let content = || text(&page.get(&format!("/restore/content?backup={shown}")));
    for (language, part) in [("vi", "đĩa còn trống"), ("en", "are free")] {
        page.get(&format!("/?language={language}"));
        let size = text(&page.get("/p/p/health/inputs"));
        assert!(size.contains(part), "{size}");
    }
    let done = |part: &str| {
        let is_done = || text(&page.get("/p/p/health")).contains("data-task=\"done\"");
        wait_until("the backup is done", is_done);
        let html = text(&page.get("/p/p/health"));
        assert!(html.contains(part), "{part}: {html}");
    };
    let reply = act(&page, "/p/p/actions/backup", &json!({}), |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    done("15 pairs and 0 verdicts are in the backup");
    assert!(content().contains("Not in a backup"), "{}", content());
    let form = json!({"inputs": "yes"});
    let reply = act(&page, "/p/p/actions/backup", &form, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("scans and prints are saved", || {
        root.join("p/backups/backup.sqlite.inputs/data").is_dir()
            && text(&page.get("/p/p/health")).contains("of them were copied now")
    });
    assert!(content().contains("Beside the backup"), "{}", content());

    let form = json!({"backup": backup.to_str().expect("UTF-8"), "name": "again"});
    let reply = act(&page, "/actions/restore", &form, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let state = || text(&page.get("/restore?name=again"));
    wait_until("the restore is over", || {
        ["done", "failed"]
            .iter()
            .any(|end| state().contains(&format!("data-task=\"{end}\"")))
    });
    assert!(
        state().contains("were copied into the project"),
        "{}",
        state()
    );
    assert!(root.join("again/inputs/data/meshes").is_dir());
}

#[test]
fn an_app_of_a_relative_folder_names_whole_paths() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let mut command = app("./".as_ref());
    command.args(["--lang", "en"]).current_dir(&root);
    let page = Page::of(&mut command).entered();
    let form = json!({"inputs": "yes"});
    let reply = act(&page, "/p/p/actions/backup", &form, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let copies = root.join("p/backups/backup.sqlite.inputs");
    let said = format!(" are in {},", copies.display());
    wait_until("the backup names its copies", || {
        text(&page.get("/p/p/health")).contains(&said)
    });
}

#[test]
fn a_killed_copy_of_scans_and_prints_goes_on_with_the_next_click() {
    const STAGED: &str = "p/backups/backup.sqlite.inputs/.mocban-inputs.json.*/new";
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let app = HeldApp::start(&root, Fault::slow("write", STAGED, UNTIL_KILLED), 3);
    let (form, token) = (json!({"inputs": "yes"}), token(&app.page));
    app.kill_in("/p/p/actions/backup", token, &form);
    assert!(root.join("p/backups/backup.sqlite").is_file());
    let next = open_app(&root);
    let health = || text(&next.get("/p/p/health"));
    let said = health();
    let part = "ended before all scans and prints were copied";
    assert!(said.contains(part), "{said}");
    let reply = act(&next, "/p/p/actions/backup", &form, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the others are copied", || {
        health().contains("of them were copied now")
    });
    let copies = names(&root.join("p/backups/backup.sqlite.inputs"));
    assert_eq!(copies, ["data", "mocban-inputs.json"]);
}
