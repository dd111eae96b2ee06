//! `mocban app` is killed in the middle of an action: the project is as before it, and the same action then does its work.

use std::path::Path;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, token};
use crate::app_choice::chosen;
use crate::block_correction::{CorrectionSession, printed_side, refused_block, true_points};
use crate::cli::mocban;
use crate::fault::Fault;
use crate::page::{Page, read_project, send};
use crate::waiting::wait_until;

/// How long the interrupted call takes, in milliseconds: until the app is killed.
pub(crate) const UNTIL_KILLED: u32 = 600_000;
/// The log of the catalog, to which a transaction is written.
const LOG: &str = "p/catalog.sqlite-wal";

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

/// An app that waits at a system call, with the notes of its faults.
pub(crate) struct HeldApp {
    pub(crate) page: Page,
    notes: tempfile::TempDir,
}

impl HeldApp {
    /// Starts an app that `held` holds at its `nth` call.
    pub(crate) fn start(root: &Path, held: Fault, nth: usize) -> Self {
        let notes = tempfile::tempdir().expect("a temporary directory");
        let mut command = app(root);
        held.inject(nth, root, notes.path(), &mut command);
        let page = Page::of(&mut command).entered();
        Self { page, notes }
    }

    /// Sends an action to an address below the session, and kills the app at the call.
    pub(crate) fn kill_in(mut self, action: &str, token: String, body: &Value) {
        let mut headers = self.page.headers();
        headers.retain(|(name, _)| *name != "x-csrf-token");
        headers.push(("x-csrf-token", token));
        let (address, path) = (
            self.page.address(),
            format!("{}{action}", self.page.session),
        );
        let body = body.to_string();
        std::thread::scope(|scope| {
            // Long work replies at once, other actions never.
            scope.spawn(|| drop(send(address, "POST", &path, &headers, body.as_bytes())));
            let is_held = || Fault::injected(self.notes.path()) > 0;
            wait_until("the action is held", is_held);
            self.page.kill();
        });
    }
}

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

#[test]
fn a_killed_repair_leaves_the_damage_and_is_done_by_the_next_app() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let project = root.join("p");
    let status = || mocban(&project, &["status", "--json"]).expect(0).json();
    let results = status()["jobs"]["done"].clone();
    let mut folders = std::fs::read_dir(project.join("artifacts")).expect("artifacts");
    let folder = folders.find_map(|entry| Some(entry.ok()?.path()).filter(|path| path.is_dir()));
    let mut files = std::fs::read_dir(folder.expect("a folder")).expect("files");
    let artifact = files.next().expect("an artifact").expect("its name").path();
    std::fs::write(artifact, "damaged").expect("written");
    let check = || mocban(&project, &["check", "--json"]).expect(12).json();
    let found = check();
    let held = HeldApp::start(&root, Fault::slow("write", LOG, UNTIL_KILLED), 1);
    let (body, token) = (json!({"what": "repair"}), token(&held.page));
    held.kill_in("/p/p/actions/check", token, &body);
    assert_eq!(status()["jobs"]["done"], results, "nothing is half mended");
    assert_eq!(check()["damage"], found["damage"]);
    let next = open_app(&root);
    let reply = act(&next, "/p/p/actions/check", &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the repair is done", || {
        text(&next.get("/p/p/health")).contains("All damage was mended")
    });
    mocban(&project, &["run", "-q"]).expect(0);
    mocban(&project, &["check"]).expect(0);
    assert_eq!(status()["jobs"]["done"], results);
}

/// Returns the processes whose command lines have a text.
fn processes_with(text: &str) -> Vec<Pid> {
    let found = std::fs::read_dir("/proc").expect("processes").flatten();
    let found = found.filter_map(|entry| {
        let id = entry.file_name().to_str()?.parse().ok()?;
        // A process that has ended has an empty one.
        let line = std::fs::read(entry.path().join("cmdline")).ok()?;
        let has_text = String::from_utf8_lossy(&line).contains(text);
        has_text.then(|| Pid::from_raw(id)).flatten()
    });
    found.collect()
}

#[test]
fn a_killed_demo_is_whole_after_the_next_click() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = dir.path().canonicalize().expect("a path");
    let held = Fault::slow("write", "*mocban-demo*/*", UNTIL_KILLED);
    let held = HeldApp::start(&root, held, 20);
    let token = token(&held.page);
    held.kill_in("/actions/demo", token, &json!({}));
    // The process that writes the demo outlives the app.
    let demo = root.join("mocban-demo").display().to_string();
    for writer in processes_with(&demo) {
        // It may have ended meanwhile.
        let _ = kill_process(writer, Signal::KILL);
    }
    wait_until("the writer ends", || processes_with(&demo).is_empty());
    assert!(!root.join("mocban-demo/catalog.sqlite").exists());
    let next = open_app(&root);
    wait_until("the demo is made", || {
        act(&next, "/actions/demo", &json!({}), |_| {}).status == 200
    });
    let project = root.join("mocban-demo");
    let status = mocban(&project, &["status", "--json"]).expect(0).json();
    assert_eq!(status["pairs"], 24);
    assert_eq!(status["jobs"]["ready"], 24);
    mocban(&project, &["check"]).expect(0);
}

#[test]
fn killed_control_points_are_saved_by_the_next_app_or_not_at_all() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = dir.path().canonicalize().expect("a path");
    refused_block(&root);
    let tried = |page: Page| {
        let session = CorrectionSession::of(page, "/p/p/block/b1/view");
        let block = session.block();
        let side = &block["sides"][printed_side(&root)]["side"];
        let id = session.tried(side, &true_points(&root, &block));
        (session, id)
    };
    let is_saved = |page: &Page| {
        let block = text(&page.get("/p/p/block/b1/"));
        block.contains("places were chosen by a person")
    };
    let HeldApp { page, notes } = HeldApp::start(&root, Fault::slow("write", LOG, UNTIL_KILLED), 1);
    let (session, id) = tried(page);
    let (page, token) = (session.page, session.token);
    let body = json!({"id": id, "saved_hash": null});
    HeldApp { page, notes }.kill_in("/p/p/block/b1/view/correct/save", token, &body);
    let next = open_app(&root);
    assert!(!is_saved(&next), "nothing is half saved");
    let (session, id) = tried(next);
    let saved = session.save(id, &Value::Null);
    assert_eq!(saved.status, 200, "{}", text(&saved));
    assert!(is_saved(&session.page));
    mocban(&root.join("p"), &["check"]).expect(0);
}
