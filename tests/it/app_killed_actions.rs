//! Every action of `mocban app` that changes a project is killed: the project is as before it, and the same action then does its
//! work.

use std::path::Path;

use serde_json::{Value, json};

use crate::app::{act, open_app, text, token};
use crate::app_choice::chosen;
use crate::app_kills::{HeldApp, LOG, UNTIL_KILLED};
use crate::cli::mocban;
use crate::fault::Fault;
use crate::page::{Page, read_project};
use crate::waiting::wait_until;

/// An action that is killed.
struct KilledAction {
    /// Changes the project before.
    prepare: fn(&Path),
    /// Address below that of the project.
    action: &'static str,
    body: fn(&Page) -> Value,
    /// The system call at which it is killed, and the file.
    at: [&'static str; 2],
    /// Returns what the action changes in a project.
    state: fn(&Path) -> Value,
    /// The page that says of long work that it was killed, and what it says.
    said: Option<[&'static str; 2]>,
}

/// What the page of exports says.
const EXPORT_KILLED: [&str; 2] = ["export", "before the last export was done"];

/// Returns the number of retired pairs.
fn retired(project: &Path) -> Value {
    mocban(project, &["status", "--json"]).expect(0).json()["retired"].clone()
}

/// Returns how often a pair was computed.
fn attempts(project: &Path) -> Value {
    let shown = mocban(project, &["show", "broken", "--json"]).expect(0);
    shown.json()["attempts"].as_array().map(Vec::len).into()
}

/// Adds a pair that fails.
fn fail_one(project: &Path) {
    std::fs::write(project.join("broken.stl"), "solid x").expect("written");
    let list = "id,mesh,print\nbroken,broken.stl,data/prints/upright-0001.jpg\n";
    std::fs::write(project.join("more.csv"), list).expect("written");
    mocban(project, &["import", "more.csv"]).expect(0);
    mocban(project, &["run", "-q"]).expect(3);
}

/// Returns the button that undoes the newest import.
fn last_import(page: &Page) -> Value {
    let part = text(&page.get("/p/p/last-import"));
    let at = part.split("name=\"at\" value=\"").nth(1);
    let at = at.and_then(|rest| rest.split('"').next());
    json!({"at": at.expect("a time"), "change": "retire"})
}

const ACTIONS: [KilledAction; 10] = [
    KilledAction {
        prepare: fail_one,
        action: "retry",
        body: |_| json!({"class": "bad_input"}),
        at: ["write", LOG],
        state: attempts,
        said: None,
    },
    KilledAction {
        prepare: fail_one,
        action: "chosen",
        body: |_| chosen("resume", &["broken"]),
        at: ["write", LOG],
        state: attempts,
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "retire",
        body: |_| json!({"pair": "upright-0001"}),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "chosen",
        body: |_| chosen("retire", &["upright-0002", "upright-0003"]),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "restore",
        body: |_| json!({"pair": "upright-0007"}),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "last-import",
        body: last_import,
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "setting",
        body: |_| json!({"key": "run.workers", "value": "3"}),
        at: ["rename", "p/mocban.toml"],
        state: |project| {
            let file = std::fs::read_to_string(project.join("mocban.toml"));
            file.unwrap_or_default().into()
        },
        said: None,
    },
    KilledAction {
        prepare: |_| {},
        action: "export",
        body: |_| json!({"purpose": "excel", "only": "all", "metric": ""}),
        at: ["write", "p/exports/.excel.*/new/*"],
        state: |project| project.join("exports/excel").exists().into(),
        said: Some(EXPORT_KILLED),
    },
    KilledAction {
        prepare: |_| {},
        action: "export",
        body: |_| json!({"purpose": "excel", "only": "all", "metric": ""}),
        at: ["rename", "p/exports/excel"],
        state: |project| project.join("exports/excel").exists().into(),
        said: Some(EXPORT_KILLED),
    },
    KilledAction {
        prepare: |_| {},
        action: "backup",
        body: |_| json!({}),
        at: ["rename", "p/backups/backup.sqlite"],
        state: |project| project.join("backups/backup.sqlite").exists().into(),
        said: Some(["health", "before the last backup was done"]),
    },
];

/// Sends an action, and kills the app at the call.
fn kill_in(action: &KilledAction, root: &Path) {
    let [call, file] = action.at;
    let held = HeldApp::start(root, Fault::slow(call, file, UNTIL_KILLED), 1);
    let (body, token) = ((action.body)(&held.page), token(&held.page));
    let address = format!("/p/p/actions/{}", action.action);
    held.kill_in(&address, token, &body);
}

#[test]
fn a_killed_action_leaves_the_project_as_it_was_and_is_done_by_the_next_app() {
    for action in &ACTIONS {
        let what = format!("{} at {:?}", action.action, action.at);
        let dir = tempfile::tempdir().expect("a temporary directory");
        read_project(&dir);
        let root = dir.path().canonicalize().expect("a path");
        let project = root.join("p");
        mocban(&project, &["retire", "upright-0007"]).expect(0);
        (action.prepare)(&project);
        let before = (action.state)(&project);
        kill_in(action, &root);
        assert_eq!((action.state)(&project), before, "{what}");
        mocban(&project, &["check"]).expect(0);
        let next = open_app(&root);
        if let Some([page, part]) = action.said {
            let html = text(&next.get(&format!("/p/p/{page}")));
            assert!(html.contains(part), "{what}: {html}");
        }
        let body = (action.body)(&next);
        let path = format!("/p/p/actions/{}", action.action);
        let reply = act(&next, &path, &body, |_| {});
        assert_eq!(reply.status, 200, "{what}: {}", text(&reply));
        wait_until(&what, || (action.state)(&project) != before);
        mocban(&project, &["check"]).expect(0);
    }
}
