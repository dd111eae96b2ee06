//! Two apps on one project, and an app on a project that cannot be written.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::app::{act, html, open_app, text, with_project};
use crate::app_choice::{chosen, import_more};
use crate::cli::{binary_beside, mocban, status};
use crate::odd::{as_other_user, set_mode, set_writable};
use crate::page::{Page, read_project};
use crate::waiting::wait_until;

const CHOSEN: &str = "/p/p/actions/chosen";

/// Returns the command of the app on a folder with the project `p`, run without the rights of root.
pub(crate) fn app_as_other_user(folder: &Path) -> Command {
    let project = folder.join("p");
    let mut command = binary_beside(&project);
    command.args(["--json", "app", "--no-open", "--lang", "en"]);
    command.arg(folder);
    as_other_user(&mut command, &project);
    command
}

#[test]
fn two_apps_on_one_project_show_and_change_the_same() {
    let (dir, first) = with_project();
    let second = open_app(dir.path());
    // Both change the project at the same time.
    std::thread::scope(|scope| {
        for (page, numbers) in [(&first, [1, 2, 3]), (&second, [4, 5, 6])] {
            scope.spawn(move || {
                for number in numbers {
                    let pair = json!({"pair": format!("upright-{number:04}")});
                    let reply = act(page, "/p/p/actions/retire", &pair, |_| {});
                    assert_eq!(reply.status, 200, "{pair}: {}", text(&reply));
                }
            });
        }
    });
    assert_eq!(status(&dir.path().join("p"))["retired"], 6);
    for (page, pair) in [(&first, "upright-0004"), (&second, "upright-0001")] {
        let shown = html(page, &format!("/p/p/pair/{pair}/"));
        assert!(shown.contains("This pair is retired."), "{shown}");
        let twice = act(page, CHOSEN, &chosen("retire", &[pair]), |_| {});
        assert_eq!(twice.status, 422, "{}", text(&twice));
    }
    for (page, value) in [(&first, "3"), (&second, "4")] {
        let setting = json!({"key": "run.workers", "value": value});
        let reply = act(page, "/p/p/actions/setting", &setting, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
    }
    let settings = std::fs::read_to_string(dir.path().join("p/mocban.toml"));
    let settings = settings.expect("the settings");
    assert!(settings.contains("workers = 4"), "the last one: {settings}");
    let pairs = ["upright-0010", "upright-0011"];
    let reply = act(&first, CHOSEN, &chosen("review", &pairs), |_| {}).json();
    let go = reply["go"].as_str().expect("a page");
    let judged = html(&second, &format!("/p/p/{go}"));
    let part = "Only the chosen pairs are judged: <b>2</b>";
    assert!(judged.contains(part), "{judged}");
    for path in [
        "/",
        "/import",
        "/import?project=new",
        "/import?project=p",
        "/p/p/",
        "/p/p/review",
    ] {
        let shown = html(&first, path);
        assert!(!shown.contains("is read-only"), "{path}: {shown}");
    }
    // A run that one of them started is that of both.
    import_more(dir.path(), ["late".to_owned()]);
    let run = json!({"which": "all"});
    let reply = act(&first, "/p/p/actions/run", &run, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("both show the new result", || {
        [&first, &second].iter().all(|page| {
            let shown = html(page, "/p/p/");
            shown.contains("pair/late/") && shown.contains("Look for changed files")
        })
    });
    mocban(&dir.path().join("p"), &["check"]).expect(0);
}

#[test]
fn a_project_on_a_read_only_disk_is_shown_and_says_why_nothing_changes() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir).dir().to_owned();
    let catalog = || std::fs::read(project.join("catalog.sqlite")).expect("a catalog");
    let before = catalog();
    let mut command = app_as_other_user(dir.path());
    set_writable(&project, false);
    set_mode(dir.path(), 0o555);
    let page = Page::of(&mut command).entered();
    html(&page, "/p/p/report/numbers");
    // Every page says it before anybody types.
    for (path, what) in [
        ("/", "This folder is read-only"),
        ("/import", "This folder is read-only"),
        ("/restore", "This folder is read-only"),
        ("/import?project=new", "This folder is read-only"),
        ("/import?project=p", "This project is read-only"),
        ("/p/p/", "This project is read-only"),
        ("/p/p/pairs", "This project is read-only"),
        ("/p/p/pair/upright-0000/", "This project is read-only"),
        ("/p/p/review", "This project is read-only"),
        ("/p/p/export", "This project is read-only"),
        ("/p/p/settings", "This project is read-only"),
        ("/p/p/health", "This project is read-only"),
    ] {
        let shown = html(&page, path);
        assert!(shown.contains(what), "{path}: {shown}");
    }
    let upload = json!({
        "name": "x", "content": "0".repeat(64), "files": 1, "bytes": 5, "take_over": false,
    });
    for (action, body, part) in [
        (
            "/p/p/actions/retire",
            json!({"pair": "upright-0001"}),
            "This project is read-only",
        ),
        (
            CHOSEN,
            chosen("retire", &["upright-0002"]),
            "This project is read-only",
        ),
        (
            "/p/p/actions/setting",
            json!({"key": "run.workers", "value": "3"}),
            "This project is read-only",
        ),
        ("/actions/demo", Value::Null, "This folder is read-only"),
        (
            "/actions/upload",
            upload,
            "the files cannot be written (Permission denied",
        ),
    ] {
        let reply = act(&page, action, &body, |_| {});
        let said = text(&reply);
        assert!([422, 503].contains(&reply.status), "{action}: {said}");
        assert!(said.contains(part), "{action}: {said}");
    }
    // Chosen pairs are kept until the app ends.
    let pairs = ["upright-0001", "upright-0004"];
    let reply = act(&page, CHOSEN, &chosen("review", &pairs), |_| {}).json();
    let go = reply["go"].as_str().expect("a page");
    let judged = html(&page, &format!("/p/p/{go}"));
    let part = "Only the chosen pairs are judged: <b>2</b>";
    assert!(judged.contains(part), "{judged}");
    set_mode(dir.path(), 0o755);
    set_writable(&project, true);
    assert!(catalog() == before, "nothing has changed");
}

#[test]
fn a_review_of_a_read_only_catalog_is_refused_before_the_first_answer() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir).dir().to_owned();
    // SQLite can make its other files, and so opens the catalog.
    set_mode(dir.path(), 0o755);
    set_mode(&project, 0o777);
    let mut command = app_as_other_user(dir.path());
    set_mode(&project.join("catalog.sqlite"), 0o444);
    let page = Page::of(&mut command).entered();
    let start = json!({"reviewer": "lan", "metric": "density", "sample": "", "order": "random"});
    let reply = act(&page, "/p/p/actions/review", &start, |_| {});
    let said = text(&reply);
    assert_eq!(reply.status, 422, "{said}");
    assert!(said.contains("This project is read-only"), "{said}");
    for (language, part) in [("en", "is read-only"), ("vi", "chỉ đọc được")] {
        let shown = html(&page, &format!("/p/p/review?language={language}"));
        assert!(shown.contains(part), "{shown}");
    }
}
