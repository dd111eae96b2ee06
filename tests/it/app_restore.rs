//! A backup becomes a new project on a page of the app, and a refusal, a full disk or a kill leaves no half of one.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, token, with_project};
use crate::app_kills::{HeldApp, UNTIL_KILLED};
use crate::app_uploads::encode;
use crate::cli::{mocban, status};
use crate::fault::{ENOSPC, Fault};
use crate::page::{Page, Reply, read_project};
use crate::resume::RUN_SMALL;
use crate::waiting::wait_until;

/// The file in which a restored catalog is written.
const STAGED: &str = "again/.catalog.sqlite.*/catalog.sqlite";

/// Backs up the shared project, with a verdict.
fn backed_up(root: &Path) -> PathBuf {
    let set = [
        "verdict",
        "set",
        "upright-0001",
        "pass",
        "--reviewer",
        "lan",
    ];
    mocban(&root.join("p"), &set).expect(0);
    let file = root.join("p/backups/backup.sqlite");
    mocban(&root.join("p"), &["backup", "backups/backup.sqlite"]).expect(0);
    file
}

fn content(page: &Page, backup: &Path) -> String {
    let backup = encode(backup.to_str().expect("UTF-8"));
    text(&page.get(&format!("/restore/content?backup={backup}")))
}

fn body(backup: &Path, name: &str) -> Value {
    json!({"backup": backup.to_str().expect("UTF-8"), "name": name})
}

fn start(page: &Page, body: &Value) -> Reply {
    act(page, "/actions/restore", body, |_| {})
}

fn state(page: &Page, name: &str) -> String {
    text(&page.get(&format!("/restore?name={}", encode(name))))
}

/// Waits until a restore is over, and returns its page.
fn ended(page: &Page, name: &str) -> String {
    let is_over =
        |html: &str| html.contains("data-task=\"done\"") || html.contains("data-task=\"failed\"");
    wait_until("the restore is over", || is_over(&state(page, name)));
    state(page, name)
}

fn counts(project: &Path) -> (Value, usize) {
    let pairs = status(project)["pairs"].clone();
    let log = mocban(project, &["verdict", "log", "--json"]).expect(0);
    (pairs, log.out.lines().count())
}

#[test]
fn a_backup_is_shown_and_becomes_a_project() {
    let (dir, page) = with_project();
    let root = dir.path().canonicalize().expect("a path");
    let backup = backed_up(&root);
    let shown = text(&page.get("/restore"));
    for part in ["href=\"restore?backup=", "p/backups/backup.sqlite"] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    assert!(text(&page.get("/")).contains("href=\"restore\""));
    let health = text(&page.get("/p/p/health"));
    assert!(health.contains("Restore as a new project"), "{health}");
    for (language, parts) in [
        (
            "en",
            [
                "What is in the backup",
                "Not in a backup",
                "free on this disk",
            ],
        ),
        (
            "vi",
            [
                "Bản sao lưu có gì",
                "Không có trong bản sao lưu",
                "đĩa còn trống",
            ],
        ),
    ] {
        page.get(&format!("/?language={language}"));
        let html = content(&page, &backup);
        for part in parts.into_iter().chain(["<b>15</b>", "value=\"p 2\""]) {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
    page.get("/?language=en");
    // The new project would look for the files of the shared project in its own folder.
    let html = content(&page, &backup);
    for part in ["of them in its own folder", "(data/"] {
        assert!(html.contains(part), "{part}: {html}");
    }
    assert!(!html.contains("p 2/data"), "{html}");
    let mut form = body(&backup, "again");
    form["inputs"] = json!(root.join("p").to_str().expect("UTF-8"));
    let reply = start(&page, &form);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let go = reply.json()["go"].to_string();
    assert!(go.contains("name=again"), "{go}");
    let done = ended(&page, "again");
    for part in [
        "15 pairs and 4 verdicts were restored",
        "href=\"./p/again/\"",
    ] {
        assert!(done.contains(part), "{part}: {done}");
    }
    assert_eq!(page.get("/p/again/").status, 200);
    // An app that was started later does not know how the restore ended.
    let later = state(&open_app(&root), "again");
    for part in ["The project is there", "href=\"./p/again/health\""] {
        assert!(later.contains(part), "{part}: {later}");
    }
    assert_eq!(counts(&root.join("again")), (json!(15), 4));
    // Only the depth maps and masks are computed again.
    mocban(&root.join("again"), &RUN_SMALL).expect(0);
    mocban(&root.join("again"), &["check"]).expect(0);
    mocban(&root.join("p"), &["check"]).expect(0);
}

#[test]
fn a_restore_that_cannot_be_done_is_refused_in_both_languages() {
    let (dir, page) = with_project();
    let root = dir.path().canonicalize().expect("a path");
    let backup = backed_up(&root);
    let written = |name: &str, bytes: &[u8]| {
        let path = root.join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let whole = std::fs::read(&backup).expect("a backup");
    let notes = written("notes.sqlite", b"text");
    let cut = written("cut.sqlite", &whole[..whole.len() / 2]);
    // The version of the schema stands here in every file of SQLite.
    let mut other = whole.clone();
    other[60..64].copy_from_slice(&99_u32.to_be_bytes());
    let other = written("other.sqlite", &other);
    std::fs::create_dir(root.join("mine")).expect("a folder");
    written("mine/scan.stl", b"solid x");
    for (language, parts) in [
        (
            "en",
            [
                "is not a backup",
                "is damaged",
                "another version",
                "there is a folder",
                "outside your folders",
                "cannot be the name",
                "the name of the project is empty",
            ],
        ),
        (
            "vi",
            [
                "không phải là bản sao lưu",
                "bị hỏng",
                "một phiên bản khác",
                "đã có thư mục",
                "nằm ngoài các thư mục",
                "không thể là tên dự án",
                "tên dự án đang để trống",
            ],
        ),
    ] {
        page.get(&format!("/?language={language}"));
        for (file, part) in [(&notes, parts[0]), (&cut, parts[1]), (&other, parts[2])] {
            let html = content(&page, file);
            assert!(
                html.contains(part) && !html.contains("<form"),
                "{part}: {html}"
            );
        }
        for (file, name, part) in [
            (notes.as_path(), "again", parts[0]),
            (backup.as_path(), "mine", parts[3]),
            (backup.as_path(), "p", parts[3]),
            (Path::new("/etc/passwd"), "again", parts[4]),
            (backup.as_path(), "../again", parts[5]),
            (backup.as_path(), "", parts[6]),
        ] {
            let reply = start(&page, &body(file, name));
            let said = text(&reply);
            assert!(reply.status == 422 && said.contains(part), "{part}: {said}");
        }
        // What only SQLite finds is said by the task.
        for (file, part) in [(&cut, parts[1]), (&other, parts[2])] {
            assert_eq!(start(&page, &body(file, "again")).status, 200);
            let html = ended(&page, "again");
            assert!(html.contains(part), "{part}: {html}");
            assert!(!root.join("again").exists(), "nothing is left");
        }
    }
    assert_eq!(
        std::fs::read_dir(root.join("mine"))
            .expect("a folder")
            .count(),
        1
    );
}

/// The restore would refuse it, so its folder is offered as one of scans and prints.
#[test]
fn copies_with_a_damaged_list_are_looked_for_by_their_paths() {
    let (dir, page) = with_project();
    let root = dir.path().canonicalize().expect("a path");
    let backup = backed_up(&root);
    let folder = root.join("p/backups/backup.sqlite.inputs");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::write(folder.join("mocban-inputs.json"), "{").expect("written");
    page.get("/?language=en");
    let html = content(&page, &backup);
    for part in ["is damaged", "Look for them there", "<b>15</b>"] {
        assert!(html.contains(part), "{part}: {html}");
    }
    assert!(!html.contains("<form"), "{html}");
    assert_eq!(start(&page, &body(&backup, "again")).status, 422);
    let mut form = body(&backup, "again");
    form["inputs"] = json!(folder.to_str().expect("UTF-8"));
    let reply = start(&page, &form);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let done = ended(&page, "again");
    assert!(done.contains("15 pairs and 4 verdicts"), "{done}");
}

#[test]
fn restores_run_at_once_and_one_name_is_taken_once() {
    let (dir, page) = with_project();
    let root = dir.path().canonicalize().expect("a path");
    let backup = backed_up(&root);
    let second = open_app(&root);
    for (page, name) in [(&page, "one"), (&page, "two"), (&second, "three")] {
        let reply = start(page, &body(&backup, name));
        assert_eq!(reply.status, 200, "{name}: {}", text(&reply));
    }
    // It is being done, or is done already.
    assert_eq!(start(&page, &body(&backup, "one")).status, 422);
    for (page, name) in [(&page, "one"), (&page, "two"), (&second, "three")] {
        let html = ended(page, name);
        assert!(html.contains("data-task=\"done\""), "{name}: {html}");
        assert_eq!(counts(&root.join(name)), (json!(15), 4));
    }
}

#[test]
fn a_full_disk_leaves_no_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let backup = backed_up(&root);
    let notes = tempfile::tempdir().expect("a temporary directory");
    let mut command = app(&root);
    command.args(["--lang", "en"]);
    let full = Fault::once("write", STAGED, ENOSPC).and_later();
    full.inject(1, &root, notes.path(), &mut command);
    let page = Page::of(&mut command).entered();
    assert_eq!(start(&page, &body(&backup, "again")).status, 200);
    let html = ended(&page, "again");
    assert!(
        html.contains("the disk is full, so nothing was restored"),
        "{html}"
    );
    assert!(!root.join("again").exists(), "nothing is left");
}

#[test]
fn a_killed_restore_leaves_no_project_and_is_done_by_the_next_app() {
    for held in [
        Fault::slow("write", STAGED, UNTIL_KILLED),
        Fault::slow("sync", STAGED, UNTIL_KILLED),
    ] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        read_project(&dir);
        let root = dir.path().canonicalize().expect("a path");
        let backup = backed_up(&root);
        let app = HeldApp::start(&root, held, 1);
        let (form, token) = (body(&backup, "again"), token(&app.page));
        app.kill_in("/actions/restore", token, &form);
        assert!(!root.join("again/catalog.sqlite").exists(), "no project");
        let next = open_app(&root);
        assert!(!text(&next.get("/")).contains("href=\"./p/again/\""));
        let said = state(&next, "again");
        assert!(
            said.contains("ended before the project was restored"),
            "{said}"
        );
        let reply = start(&next, &form);
        assert_eq!(reply.status, 200, "{}", text(&reply));
        let done = ended(&next, "again");
        assert!(done.contains("15 pairs and 4 verdicts"), "{done}");
        assert_eq!(counts(&root.join("again")), (json!(15), 4));
        let hidden = std::fs::read_dir(root.join("again"))
            .expect("a folder")
            .flatten();
        let mut names = hidden.map(|entry| entry.file_name());
        assert!(!names.any(|name| name.to_string_lossy().contains("partial")));
    }
}
