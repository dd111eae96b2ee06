//! Kills `mocban app` in every action that changes a project. Before anything is stored, the project is unchanged, and the same
//! action then does its work. Once a transaction is stored, the project is as before or after the action, and never between.

use std::path::Path;

use mocban::store::Project;
use serde_json::{Value, json};

use crate::app::{act, open_app, text};
use crate::app_choice::chosen;
use crate::cli::{mocban, status};
use crate::killed_project::{KilledAction, kill_each};
use crate::page::{Page, answer};
use crate::review_page::{ask, check_answers};

/// What the page of exports says.
const EXPORT_KILLED: [&str; 2] = ["export", "before the last export was done"];
/// The pages of a reviewer.
const REVIEW: &str = "/p/p/review/lan/metric%3Drelief%26order%3Drandom";
const ANSWER: &str = "/p/p/review/lan/metric%3Drelief%26order%3Drandom/api/answer";
const UNDO: &str = "/p/p/review/lan/metric%3Drelief%26order%3Drandom/api/undo";
const ALIGN: &str = "/p/p/review/lan/metric%3Drelief%26order%3Drandom/api/align";
/// A list of pairs in a project.
const LIST: &str = "data/more.csv";

/// Returns the number of pairs.
fn pairs(project: &Path) -> Value {
    status(project)["pairs"].clone()
}

/// Returns the number of retired pairs.
fn retired(project: &Path) -> Value {
    status(project)["retired"].clone()
}

/// Returns how often a pair was computed.
fn attempts(project: &Path) -> Value {
    let shown = mocban(project, &["show", "broken", "--json"]).expect(0);
    shown.json()["attempts"].as_array().map(Vec::len).into()
}

/// Returns whether a block is known.
fn block(project: &Path) -> Value {
    mocban(project, &["show", "b1", "--json"]).code.into()
}

/// Returns everything that reviewers have judged, without numbers: times differ.
fn judged(project: &Path) -> Value {
    let log = mocban(project, &["verdict", "log", "--json"]).expect(0);
    let project = Project::open(project).expect("a project");
    let mut all = format!("{} {:?}", log.out, check_answers(&project));
    all.retain(|c| !c.is_ascii_digit());
    all.into()
}

/// Returns how many alignments were stored by hand.
fn aligned_by_hand(project: &Path) -> Value {
    let project = Project::open(project).expect("a project");
    let stored = ask(&project, async |catalog| {
        catalog.manual_alignments().await.expect("alignments")
    });
    stored.len().into()
}

/// Returns the names of the sets of chosen pairs.
fn chosen_sets(project: &Path) -> Value {
    let sets = std::fs::read_dir(project.join("chosen"));
    let sets = sets.into_iter().flatten().flatten();
    let names = sets.map(|set| set.file_name().to_string_lossy().into_owned());
    // A killed app leaves a hidden folder.
    names.filter(|name| !name.starts_with('.')).collect()
}

/// Returns the text of a file of the project; empty if there is none.
fn content(project: &Path, file: &str) -> Value {
    let text = std::fs::read_to_string(project.join(file));
    text.unwrap_or_default().into()
}

fn settings(project: &Path) -> Value {
    content(project, "mocban.toml")
}

fn views(project: &Path) -> Value {
    content(project, "saved-views.json")
}

/// Returns the unit and the side of a pair.
fn said_of_scan(project: &Path) -> Value {
    let shown = mocban(project, &["show", "upright-0001", "--json"]).expect(0);
    let shown = shown.json();
    json!([shown["unit"], shown["scanned_face_down"]])
}

/// Adds a pair that fails.
fn fail_one(project: &Path) {
    std::fs::write(project.join("broken.stl"), "solid x").expect("written");
    let list = "id,mesh,print\nbroken,broken.stl,data/prints/upright-0001.jpg\n";
    std::fs::write(project.join("more.csv"), list).expect("written");
    mocban(project, &["import", "more.csv"]).expect(0);
    mocban(project, &["run", "-q"]).expect(3);
}

/// Writes a list of a pair that is not in the project.
pub(crate) fn write_list(project: &Path) {
    let list = std::fs::read_to_string(project.join("data/manifest.csv")).expect("a manifest");
    let rows: Vec<&str> = list.lines().take(2).collect();
    let [head, row] = rows.as_slice() else {
        unreachable!("a head and a row: {list}");
    };
    let row = row.replacen("upright-0000", "new-0000", 1);
    std::fs::write(project.join(LIST), format!("{head}\n{row}\n")).expect("written");
}

/// Returns the form that imports the list.
pub(crate) fn list_of(to: &str, project: &Path) -> Value {
    json!({"project": to, "list": project.join(LIST)})
}

/// Puts the files of a whole block into two folders.
pub(crate) fn write_block(project: &Path) {
    let files = [("meshes", "ply", "scan"), ("prints", "jpg", "page")];
    for (folder, ending, to) in files {
        let file = format!("data/{folder}/upright-0001.{ending}");
        let to = project.join("one").join(to);
        std::fs::create_dir_all(&to).expect("a folder");
        let copy = to.join(format!("b1.{ending}"));
        std::fs::copy(project.join(file), copy).expect("copied");
    }
}

fn whole_block(_page: &Page, project: &Path) -> Value {
    let [scan, page] = ["one/scan", "one/page"].map(|folder| project.join(folder));
    json!({"project": "p", "meshes": scan, "prints": page, "unit": "mm", "whole_block": "yes"})
}

/// Sends an action to an app of its own.
fn act_before(project: &Path, path: &str, body: impl FnOnce(&Page) -> Value) {
    let page = open_app(project.parent().expect("a folder"));
    let reply = act(&page, path, &body(&page), |_| {});
    assert_eq!(reply.status, 200, "{path}: {}", text(&reply));
}

/// Returns the button that undoes the newest import, or brings its pairs back.
pub(crate) fn last_import(page: &Page, change: &str) -> Value {
    let part = text(&page.get("/p/p/last-import"));
    let at = part.split("name=\"at\" value=\"").nth(1);
    let at = at.and_then(|rest| rest.split('"').next());
    json!({"at": at.expect("a time"), "change": change})
}

/// Returns the first item of the review.
fn first_item(page: &Page) -> Value {
    page.get(&format!("{REVIEW}/api/queue")).json()["items"][0].clone()
}

fn first_answer(page: &Page) -> Value {
    answer("e-1", &first_item(page), "pass")
}

/// Returns the alignment of the first item, as the editor begins with it.
fn first_alignment(page: &Page, _project: &Path) -> Value {
    let item = first_item(page)["id"].clone();
    let id = item.as_str().expect("an id");
    let start = page.get(&format!("{REVIEW}/api/alignment/{id}")).json();
    let map = &start["view_from_depth"];
    json!({"event": "a-1", "item": id, "view_from_depth": map, "note": null})
}

/// Saves a view before.
fn save_view(project: &Path) {
    act_before(project, "/p/p/actions/view", |_| view("save"));
}

/// Returns a change of a view.
fn view(action: &str) -> Value {
    let [view, name] = match action {
        "save" => ["", "hỏng"],
        "rename" => ["hỏng", "lỗi"],
        _ => ["hỏng", ""],
    };
    json!({"action": action, "view": view, "name": name, "list": "state=failed"})
}

/// Actions that only start a run change nothing by themselves: `app_kills.rs` tests that their run goes on.
const IN_CATALOG: [KilledAction; 15] = [
    KilledAction::in_catalog(
        "/p/p/actions/retry",
        |_, _| json!({"class": "bad_input"}),
        attempts,
    )
    .after(fail_one),
    KilledAction::in_catalog(
        "/p/p/actions/chosen",
        |_, _| chosen("resume", &["broken"]),
        attempts,
    )
    .after(fail_one),
    KilledAction::in_catalog(
        "/p/p/actions/correct",
        |_, _| json!({"what": "unit", "pair": "upright-0001", "unit": "cm", "shown": "1"}),
        said_of_scan,
    )
    .computing_again("upright-0001"),
    KilledAction::in_catalog(
        "/p/p/actions/correct",
        |_, _| json!({"what": "side", "pair": "upright-0001", "shown": "1"}),
        said_of_scan,
    )
    .computing_again("upright-0001"),
    KilledAction::in_catalog(
        "/p/p/actions/retire",
        |_, _| json!({"pair": "upright-0001"}),
        retired,
    ),
    KilledAction::in_catalog(
        "/p/p/actions/chosen",
        |_, _| chosen("retire", &["upright-0002", "upright-0003"]),
        retired,
    ),
    KilledAction::in_catalog(
        "/p/p/actions/restore",
        |_, _| json!({"pair": "upright-0007"}),
        retired,
    ),
    KilledAction::in_catalog(
        "/p/p/actions/last-import",
        |page, _| last_import(page, "retire"),
        retired,
    ),
    KilledAction::in_catalog(
        "/p/p/actions/last-import",
        |page, _| last_import(page, "restore"),
        retired,
    )
    .after(|project| {
        act_before(project, "/p/p/actions/last-import", |page| {
            last_import(page, "retire")
        });
    }),
    KilledAction::in_catalog("/actions/import", |_, project| list_of("p", project), pairs)
        .after(write_list),
    KilledAction {
        at: ["write", "new/.catalog.sqlite.mocban-new-*"],
        ..KilledAction::in_catalog(
            "/actions/import",
            |_, project| list_of("new", project),
            |project| {
                let new = project.with_file_name("new");
                new.join("catalog.sqlite").exists().into()
            },
        )
        .after(write_list)
    },
    KilledAction::in_catalog("/actions/import", whole_block, block).after(write_block),
    KilledAction::in_catalog(ANSWER, |page, _| first_answer(page), judged),
    KilledAction::in_catalog(UNDO, |_, _| json!({"event": "e-1"}), judged)
        .after(|project| act_before(project, ANSWER, first_answer)),
    KilledAction::in_catalog(ALIGN, first_alignment, aligned_by_hand),
];

const IN_FILES: [KilledAction; 9] = [
    KilledAction::in_file(
        "/p/p/actions/setting",
        |_, _| json!({"key": "run.workers", "value": "3"}),
        "p/mocban.toml",
        settings,
    ),
    KilledAction::in_file(
        "/p/p/actions/view",
        |_, _| view("save"),
        "p/saved-views.json",
        views,
    ),
    KilledAction::in_file(
        "/p/p/actions/view",
        |_, _| view("rename"),
        "p/saved-views.json",
        views,
    )
    .after(save_view),
    KilledAction::in_file(
        "/p/p/actions/view",
        |_, _| view("remove"),
        "p/saved-views.json",
        views,
    )
    .after(save_view),
    KilledAction::in_file(
        "/p/p/actions/chosen",
        |_, _| chosen("review", &["upright-0001"]),
        "p/chosen/*",
        chosen_sets,
    ),
    KilledAction {
        at: ["write", "p/exports/.excel.*/new/*"],
        ..EXPORT
    },
    EXPORT,
    KilledAction {
        said: Some(["health", "before the last backup was done"]),
        ..KilledAction::in_file(
            "/p/p/actions/backup",
            |_, _| json!({}),
            "p/backups/backup.sqlite",
            |project| project.join("backups/backup.sqlite").exists().into(),
        )
    },
    KilledAction {
        at: ["write", "p/backups/.backup.sqlite.*/catalog.sqlite"],
        said: Some(["health", "before the last backup was done"]),
        ..KilledAction::in_file(
            "/p/p/actions/backup",
            |_, _| json!({"inputs": "yes"}),
            "p/backups/backup.sqlite",
            |project| project.join("backups/backup.sqlite").exists().into(),
        )
    },
];

/// An export that is killed before it gets its name.
const EXPORT: KilledAction = KilledAction {
    said: Some(EXPORT_KILLED),
    ..KilledAction::in_file(
        "/p/p/actions/export",
        |_, _| json!({"purpose": "excel", "only": "all", "metric": ""}),
        "p/exports/excel",
        |project| project.join("exports/excel").exists().into(),
    )
};

/// Returns the addresses of the actions.
pub(crate) fn killed_actions() -> Vec<&'static str> {
    let all = IN_CATALOG.iter().chain(&IN_FILES);
    all.map(|action| action.action).collect()
}

#[test]
fn a_killed_change_of_the_catalog_is_made_as_a_whole_or_by_the_next_app() {
    kill_each(&IN_CATALOG);
}

#[test]
fn a_killed_change_of_a_file_leaves_the_old_one_and_is_made_by_the_next_app() {
    kill_each(&IN_FILES);
}
