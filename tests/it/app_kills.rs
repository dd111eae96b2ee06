//! `mocban app` is killed in the middle of an action: the project is as before it, and the same action then does its work.

use std::path::Path;

use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, token};
use crate::app_choice::chosen;
use crate::cli::mocban;
use crate::fault::Fault;
use crate::page::{Page, read_project, send};
use crate::waiting::wait_until;

/// How long the interrupted call takes, in milliseconds: until the app is killed.
const UNTIL_KILLED: u32 = 600_000;
/// The log of the catalog, to which a transaction is written.
const LOG: &str = "p/catalog.sqlite-wal";

/// An action that is killed.
struct KilledAction {
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

/// Returns the button that undoes the newest import.
fn last_import(page: &Page) -> Value {
    let part = text(&page.get("/p/p/last-import"));
    let at = part.split("name=\"at\" value=\"").nth(1);
    let at = at.and_then(|rest| rest.split('"').next());
    json!({"at": at.expect("a time"), "change": "retire"})
}

const ACTIONS: [KilledAction; 8] = [
    KilledAction {
        action: "retire",
        body: |_| json!({"pair": "upright-0001"}),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        action: "chosen",
        body: |_| chosen("retire", &["upright-0002", "upright-0003"]),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        action: "restore",
        body: |_| json!({"pair": "upright-0007"}),
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
        action: "last-import",
        body: last_import,
        at: ["write", LOG],
        state: retired,
        said: None,
    },
    KilledAction {
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
        action: "export",
        body: |_| json!({"purpose": "excel", "only": "all", "metric": ""}),
        at: ["write", "p/exports/.excel.*/new/*"],
        state: |project| project.join("exports/excel").exists().into(),
        said: Some(EXPORT_KILLED),
    },
    KilledAction {
        action: "export",
        body: |_| json!({"purpose": "excel", "only": "all", "metric": ""}),
        at: ["rename", "p/exports/excel"],
        state: |project| project.join("exports/excel").exists().into(),
        said: Some(EXPORT_KILLED),
    },
    KilledAction {
        action: "backup",
        body: |_| json!({}),
        at: ["rename", "p/backups/backup.sqlite"],
        state: |project| project.join("backups/backup.sqlite").exists().into(),
        said: Some(["health", "before the last backup was done"]),
    },
];

/// Sends an action, and kills the app at the call.
fn kill_in(action: &KilledAction, root: &Path) {
    let notes = tempfile::tempdir().expect("a temporary directory");
    let [call, file] = action.at;
    let mut command = app(root);
    let held = Fault::slow(call, file, UNTIL_KILLED);
    held.inject(1, root, notes.path(), &mut command);
    let mut page = Page::of(&mut command).entered();
    let body = (action.body)(&page).to_string();
    let mut headers = page.headers();
    headers.retain(|(name, _)| *name != "x-csrf-token");
    headers.push(("x-csrf-token", token(&page)));
    let (address, path) = (
        page.address(),
        format!("{}/p/p/actions/{}", page.session, action.action),
    );
    std::thread::scope(|scope| {
        // Long work replies at once, other actions never.
        scope.spawn(|| drop(send(address, "POST", &path, &headers, body.as_bytes())));
        wait_until("the action is held", || Fault::injected(notes.path()) > 0);
        page.kill();
    });
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
