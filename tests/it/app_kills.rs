//! `mocban app` is killed in the middle of an action: the project is as before it, and the same action then does its work.

use std::path::Path;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, token};
use crate::app_choice::import_more;
use crate::app_killed_actions::killed_actions;
use crate::app_routes::{REVIEW_ROUTES, ROUTES, writes};
use crate::block_correction::{CorrectionSession, printed_side, refused_block, true_points};
use crate::block_view::finished_block;
use crate::cli::{mocban, status};
use crate::fault::Fault;
use crate::page::{Page, read_project, send};
use crate::project_dump::ProjectDump;
use crate::resume::RUN_SMALL;
use crate::small_block::stored_block;
use crate::waiting::{run_ends, wait_until};

/// How long the interrupted call takes, in milliseconds: until the app is killed.
pub(crate) const UNTIL_KILLED: u32 = 600_000;
/// The log of the catalog, to which a transaction is written.
pub(crate) const LOG: &str = "p/catalog.sqlite-wal";

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

#[test]
fn a_killed_repair_leaves_the_damage_and_is_done_by_the_next_app() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let project = root.join("p");
    let results = status(&project)["jobs"]["done"].clone();
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
    assert_eq!(
        status(&project)["jobs"]["done"],
        results,
        "nothing is half mended"
    );
    assert_eq!(check()["damage"], found["damage"]);
    let next = open_app(&root);
    let reply = act(&next, "/p/p/actions/check", &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the repair is done", || {
        text(&next.get("/p/p/health")).contains("All damage was mended")
    });
    mocban(&project, &RUN_SMALL).expect(0);
    mocban(&project, &["check"]).expect(0);
    assert_eq!(status(&project)["jobs"]["done"], results);
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
    let status = status(&project);
    assert_eq!(status["pairs"], 24);
    assert_eq!(status["jobs"]["ready"], 24);
    mocban(&project, &["check"]).expect(0);
    let other = tempfile::tempdir().expect("a temporary directory");
    mocban(other.path(), &["demo", "mocban-demo", "--no-run"]).expect(0);
    let other = ProjectDump::of(&other.path().join("mocban-demo"));
    ProjectDump::of(&project).must_equal(&other, "a demo that was not killed");
}

#[test]
fn a_run_outlives_a_killed_app_and_is_stopped_and_resumed_by_the_next() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    import_more(&root, ["late".to_owned()]);
    let hold = root.join("hold");
    let mut command = app(&root);
    command.env("MOCBAN_HOLD_AT", "fit:computed");
    command.env("MOCBAN_HOLD_FILE", &hold);
    let mut page = Page::of(&mut command).entered();
    let send = |page: &Page, action: &str, body: &Value| {
        let reply = act(page, &format!("/p/p/actions/{action}"), body, |_| {});
        assert_eq!(reply.status, 200, "{action}: {}", text(&reply));
    };
    let all = json!({"which": "all"});
    send(&page, "run", &all);
    wait_until("the run is held", || hold.exists());
    page.kill();
    let project = root.join("p");
    assert_eq!(status(&project)["running"], true, "the run goes on");
    let next = open_app(&root);
    send(&next, "stop", &json!({}));
    std::fs::remove_file(&hold).expect("the run waits");
    run_ends(&project);
    assert_eq!(status(&project)["jobs"]["leased"], 0);
    send(&next, "run", &all);
    wait_until("all pairs are done", || {
        status(&project)["jobs"]["done"] == 16
    });
    run_ends(&project);
    mocban(&project, &["check"]).expect(0);
}

/// Returns whether the block `b1` has control points.
fn has_points(page: &Page) -> bool {
    text(&page.get("/p/p/block/b1/")).contains("places were chosen by a person")
}

/// Kills an app that removes control points, and removes them with the next one.
fn kill_removal(root: &Path, saved_hash: &Value) {
    let remove = "/p/p/block/b1/view/correct/remove";
    let body = json!({ "saved_hash": saved_hash });
    let held = HeldApp::start(root, Fault::slow("write", LOG, UNTIL_KILLED), 1);
    let token = token(&held.page);
    held.kill_in(remove, token, &body);
    let next = open_app(root);
    assert!(has_points(&next), "nothing is half removed");
    let removed = act(&next, remove, &body, |_| {});
    assert_eq!(removed.status, 200, "{}", text(&removed));
    assert!(!has_points(&next));
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
    let HeldApp { page, notes } = HeldApp::start(&root, Fault::slow("write", LOG, UNTIL_KILLED), 1);
    let (session, id) = tried(page);
    let (page, token) = (session.page, session.token);
    let body = json!({"id": id, "saved_hash": null});
    HeldApp { page, notes }.kill_in("/p/p/block/b1/view/correct/save", token, &body);
    let next = open_app(&root);
    assert!(!has_points(&next), "nothing is half saved");
    let (session, id) = tried(next);
    let saved = session.save(id, &Value::Null);
    assert_eq!(saved.status, 200, "{}", text(&saved));
    assert!(has_points(&session.page));
    let saved_hash = saved.json()["saved_hash"].clone();
    drop(session);
    kill_removal(&root, &saved_hash);
    mocban(&root.join("p"), &["check"]).expect(0);
}

/// Returns the path of the labels of the block `b1`.
fn labels_path(root: &Path) -> Value {
    stored_block(root)["labels_path"].clone()
}

/// Kills an app that replaces the labels of the block, and replaces them with the next one.
fn kill_labels(root: &Path, action: &str, body: impl Fn(&Value) -> Value) {
    let boxes = "/p/p/block/b1/view/boxes";
    let body_of = |page: &Page| {
        let shown = page.get(&format!("{boxes}/block.json")).json();
        body(&shown["shown"])
    };
    let before = labels_path(root);
    let held = HeldApp::start(root, Fault::slow("write", LOG, UNTIL_KILLED), 1);
    let (sent, token) = (body_of(&held.page), token(&held.page));
    held.kill_in(&format!("{boxes}{action}"), token, &sent);
    assert_eq!(labels_path(root), before, "nothing is half stored");
    let next = open_app(root);
    let reply = act(&next, &format!("{boxes}{action}"), &body_of(&next), |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_ne!(labels_path(root), before);
    mocban(&root.join("p"), &["check"]).expect(0);
}

#[test]
fn killed_boxes_are_saved_by_the_next_app_or_not_at_all() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = dir.path().canonicalize().expect("a path");
    finished_block(&root);
    let before = labels_path(&root);
    kill_labels(
        &root,
        "/save",
        |shown| json!({"shown": shown, "edits": {"removed": [0], "edited": []}}),
    );
    let saved = labels_path(&root);
    let saved = saved.as_str().expect("a path");
    assert!(saved.starts_with("labels/b1-"), "{saved}");
    kill_labels(&root, "/earlier", |shown| json!({ "shown": shown }));
    assert_eq!(labels_path(&root), before);
}

/// Actions that are killed in another test or leave nothing half done, each with where or why.
const OTHER_ACTIONS: [(&str, &str); 15] = [
    ("/actions/demo", "above"),
    ("/actions/restore", "app_restore.rs"),
    ("/actions/upload", "app_uploads.rs"),
    ("/actions/upload-end", "app_uploads.rs"),
    ("/uploads/1/x", "app_uploads.rs and app_upload_resume.rs"),
    ("/p/p/actions/check", "above"),
    ("/p/p/actions/run", "above"),
    ("/p/p/actions/stop", "above"),
    ("/p/p/actions/review", "it opens a page or makes a link"),
    ("/p/p/actions/invitation", "a link ends with the app"),
    ("/correct/try", "it stores nothing"),
    ("/correct/save", "above"),
    ("/correct/remove", "above"),
    ("/boxes/save", "above"),
    ("/boxes/earlier", "above"),
];
/// The routes of the page on which the alignment of a block is corrected.
const CORRECTION_ROUTES: &str = include_str!("../../crates/pages/src/view/correction_page.rs");
/// The routes of the page on which the boxes of a block are changed.
const BOXES_ROUTES: &str = include_str!("../../crates/pages/src/view/boxes_page.rs");

/// A new action must be killed in a test, too.
#[test]
fn every_action_of_the_app_is_killed_in_a_test() {
    let killed = killed_actions();
    let is_other = |path: &str| OTHER_ACTIONS.iter().any(|(known, _)| *known == path);
    let is_killed = |path: &str| killed.contains(&path);
    // The routes of a review are relative to its page.
    let is_killed_in_review = |path: &str| killed.iter().any(|known| known.ends_with(path));
    // The pages of a block and a review are passed on to their own routes.
    let is_passed_on = |path: &str| path.contains("/block/") || path.contains("/lan/");
    let of_app = writes(ROUTES)
        .into_iter()
        .filter(|path| !is_passed_on(path));
    let of_app: Vec<String> = of_app
        .chain(writes(CORRECTION_ROUTES))
        .chain(writes(BOXES_ROUTES))
        .collect();
    let of_review = writes(REVIEW_ROUTES);
    let unknown_of_app = of_app
        .iter()
        .filter(|path| !is_killed(path) && !is_other(path));
    let unknown_of_review = of_review
        .iter()
        .filter(|path| !is_killed_in_review(path) && !is_other(path));
    let unknown: Vec<&String> = unknown_of_app.chain(unknown_of_review).collect();
    assert_eq!(unknown, [""; 0], "kill the app in these, too");
    let is_gone = |path: &&str| !of_app.iter().chain(&of_review).any(|route| route == path);
    let gone: Vec<&str> = OTHER_ACTIONS
        .iter()
        .map(|(path, _)| *path)
        .filter(is_gone)
        .collect();
    assert_eq!(gone, [""; 0], "no route of the app");
}
