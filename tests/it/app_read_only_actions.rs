//! Every action of `mocban app` on a project that cannot be written: it is refused with a sentence in both languages, and
//! changes nothing.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::app::{act, app, html, text};
use crate::app_choice::chosen;
use crate::app_controls::varied_project;
use crate::app_killed_actions::{last_import, list_of, write_list};
use crate::app_shared::app_as_other_user;
use crate::block_view::finished_block;
use crate::cli::shell;
use crate::odd::{set_mode, set_writable};
use crate::page::Page;
use crate::report::contents;
use crate::skipped::say_skipped;
use crate::waiting::wait_until;

/// What a refusal says of a place that cannot be written, in a language.
const SAID: [(&str, [&str; 2]); 2] = [
    (
        "en",
        ["This project is read-only", "This folder is read-only"],
    ),
    ("vi", ["Dự án này chỉ đọc được", "Thư mục này chỉ đọc được"]),
];

/// Pages of [`varied_project`], and what each says of a place that cannot be written: what [`SAID`] has at this index.
const PAGES: [(&str, Option<usize>); 21] = [
    ("/", Some(1)),
    ("/import", Some(1)),
    ("/restore", Some(1)),
    ("/p/p/", Some(0)),
    ("/p/p/pairs", Some(0)),
    ("/p/p/pairs?view=table&sort=confidence", Some(0)),
    ("/p/p/pairs?state=retired", Some(0)),
    ("/p/p/pair/upright-0000/", Some(0)),
    ("/p/p/pair/broken/", Some(0)),
    ("/p/p/pair/upright-0000/3d/", None),
    ("/p/p/blocks", Some(0)),
    ("/p/p/review", Some(0)),
    ("/p/p/review/agreement", None),
    ("/p/p/report", Some(0)),
    ("/p/p/report/numbers", None),
    ("/p/p/report/file/report.csv", None),
    ("/p/p/last-import", None),
    ("/p/p/export", Some(0)),
    ("/p/p/settings", Some(0)),
    ("/p/p/correct?what=unit&class=bad_input", Some(0)),
    ("/p/p/health", Some(0)),
];

/// Returns a command on a folder that is mounted read-only for this command alone, where not even root can write. On Linux,
/// every user may mount in a namespace of their own, unless an administrator forbids it.
fn on_read_only_disk(command: &Command, folder: &Path) -> Command {
    let mut mounted = shell(
        "exec unshare -rm sh -c 'mount --bind \"$0\" \"$0\" && mount -o remount,bind,ro \"$0\" && exec \"$@\"' \"$0\" \"$@\"",
    );
    mounted.arg(folder).arg(command.get_program());
    mounted.args(command.get_args());
    mounted
}

/// A folder with a project `p`, neither of which can be written.
struct ReadOnlyFolder {
    page: Page,
    dir: PathBuf,
    before: BTreeMap<PathBuf, Vec<u8>>,
}

impl ReadOnlyFolder {
    /// Opens the app on a disk that is read-only. `None` if no such disk can be made.
    fn mounted(dir: &Path) -> Option<Self> {
        let dir = dir.canonicalize().expect("a path");
        let written = dir.join("p/written");
        let mut touch = Command::new("touch");
        touch.arg(&written);
        let tried = on_read_only_disk(&Command::new("true"), &dir).output();
        if !tried.is_ok_and(|tried| tried.status.success()) {
            say_skipped("unshare and mount are needed, and a user who may use them");
            return None;
        }
        let refused = on_read_only_disk(&touch, &dir).output().expect("an end");
        assert!(
            !refused.status.success() && !written.exists(),
            "{refused:?}"
        );
        let before = contents(&dir.join("p"));
        let mut command = app(&dir);
        command.args(["--lang", "en"]);
        let page = Page::of(&mut on_read_only_disk(&command, &dir)).entered();
        Some(Self { page, dir, before })
    }

    /// Opens the app on the folder, which its user may not write.
    fn open(dir: &Path) -> Self {
        let dir = dir.canonicalize().expect("a path");
        let before = contents(&dir.join("p"));
        let mut command = app_as_other_user(&dir);
        set_writable(&dir.join("p"), false);
        set_mode(&dir, 0o555);
        let page = Page::of(&mut command).entered();
        Self { page, dir, before }
    }

    /// Sends actions, which are all refused in both languages.
    fn refuses(&self, actions: &[(&str, Value)]) {
        for (language, said) in SAID {
            html(&self.page, &format!("/?language={language}"));
            for (action, body) in actions {
                let reply = act(&self.page, action, body, |_| {});
                let why = text(&reply);
                assert_eq!(reply.status, 422, "{action}: {why}");
                assert!(
                    said.iter().any(|part| why.contains(part)),
                    "{action} {body}: {why}"
                );
            }
        }
        html(&self.page, "/?language=en");
    }

    /// Sends every action on [`project_with_list`].
    fn refuses_all_actions(&self) {
        let project = self.dir.join("p");
        let review = |invite: &str| {
            json!({
                "reviewer": "lan", "metric": "density", "sample": "", "order": "random", "invite": invite,
            })
        };
        let backup = project.join("backups/backup.sqlite");
        self.refuses(&[
            ("/p/p/actions/run", json!({"which": "all"})),
            ("/p/p/actions/run", json!({"which": "failed"})),
            ("/p/p/actions/retry", json!({"class": "bad_input"})),
            ("/p/p/actions/retry", json!({"pair": "broken"})),
            ("/p/p/actions/retire", json!({"pair": "upright-0001"})),
            ("/p/p/actions/restore", json!({"pair": "upright-0007"})),
            ("/p/p/actions/chosen", chosen("retire", &["upright-0002"])),
            ("/p/p/actions/chosen", chosen("resume", &["broken"])),
            ("/p/p/actions/chosen", chosen("compute", &["upright-0002"])),
            (
                "/p/p/actions/correct",
                json!({"what": "unit", "unit": "m", "pair": "upright-0002", "shown": "1"}),
            ),
            (
                "/p/p/actions/last-import",
                last_import(&self.page, "retire"),
            ),
            ("/actions/import", list_of("p", &project)),
            ("/actions/import", list_of("new", &project)),
            ("/p/p/actions/view", view("save", "", "x")),
            ("/p/p/actions/view", view("rename", "hỏng", "x")),
            ("/p/p/actions/view", view("remove", "hỏng", "")),
            (
                "/p/p/actions/setting",
                json!({"key": "run.workers", "value": "3"}),
            ),
            ("/p/p/actions/review", review("")),
            ("/p/p/actions/review", review("yes")),
            (
                "/p/p/actions/export",
                json!({"purpose": "excel", "only": "all", "metric": ""}),
            ),
            ("/p/p/actions/backup", json!({})),
            ("/p/p/actions/backup", json!({"inputs": "yes"})),
            ("/p/p/actions/check", json!({"what": "repair"})),
            ("/p/p/actions/check", json!({"what": "lost"})),
            ("/actions/demo", Value::Null),
            (
                "/actions/restore",
                json!({"backup": backup, "name": "new", "inputs": ""}),
            ),
        ]);
        // What only reads still works.
        let check = json!({"what": "check"});
        let reply = act(&self.page, "/p/p/actions/check", &check, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
        let part = "All are sound";
        wait_until(part, || html(&self.page, "/p/p/health").contains(part));
        let setting = html(&self.page, "/p/p/settings?key=run.workers&value=3");
        assert!(!setting.contains("id=\"save\""), "{setting}");
    }
}

impl Drop for ReadOnlyFolder {
    fn drop(&mut self) {
        set_mode(&self.dir, 0o755);
        set_writable(&self.dir.join("p"), true);
        if !std::thread::panicking() {
            let is_unchanged = contents(&self.dir.join("p")) == self.before;
            assert!(is_unchanged, "nothing has changed");
            let entries = std::fs::read_dir(&self.dir).expect("a folder").flatten();
            let projects = entries.filter(|entry| entry.path().join("catalog.sqlite").exists());
            assert_eq!(projects.count(), 1, "no project was added");
        }
    }
}

/// Returns a change of the saved view of [`varied_project`].
fn view(action: &str, view: &str, name: &str) -> Value {
    json!({"action": action, "view": view, "name": name, "list": "state=failed"})
}

/// Makes a [`varied_project`] with a list, which [`ReadOnlyFolder::refuses_all_actions`] imports.
fn project_with_list() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let project = dir.path().canonicalize().expect("a path").join("p");
    write_list(&project);
    dir
}

#[test]
fn no_action_changes_a_project_that_cannot_be_written() {
    let dir = project_with_list();
    ReadOnlyFolder::open(dir.path()).refuses_all_actions();
}

#[test]
fn a_project_on_a_read_only_disk_is_shown_and_stays_as_it_is() {
    let dir = project_with_list();
    let Some(folder) = ReadOnlyFolder::mounted(dir.path()) else {
        return;
    };
    for (language, said) in SAID {
        for (path, expected) in PAGES {
            let join = if path.contains('?') { '&' } else { '?' };
            let shown = html(&folder.page, &format!("{path}{join}language={language}"));
            if let Some(index) = expected {
                let part = said[index];
                assert!(shown.contains(part), "{path}: {part}: {shown}");
            }
        }
    }
    folder.refuses_all_actions();
}

#[test]
fn no_action_changes_a_block_that_cannot_be_written() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let folder = ReadOnlyFolder::open(dir.path());
    let view = "/p/p/block/b1/view";
    let boxes = folder.page.get(&format!("{view}/boxes/block.json")).json();
    let shown = boxes["shown"].clone();
    assert!(shown.is_string(), "{boxes}");
    // Nobody draws boxes or points that cannot be stored.
    let block = html(&folder.page, "/p/p/block/b1/");
    assert!(block.contains("href=\"view/\""), "{block}");
    for editor in ["boxes", "correct"] {
        assert!(!block.contains(&format!("view/{editor}")), "{block}");
        let reply = folder.page.get(&format!("{view}/{editor}"));
        let why = text(&reply);
        assert_eq!(reply.status, 422, "{editor}: {why}");
        assert!(why.contains("This project is read-only"), "{why}");
    }
    folder.refuses(&[
        ("/p/p/actions/run", json!({"which": "all"})),
        (
            "/p/p/block/b1/view/boxes/save",
            json!({"shown": shown, "edits": {"removed": [0], "edited": []}}),
        ),
        (
            "/p/p/block/b1/view/boxes/earlier",
            json!({ "shown": shown }),
        ),
        (
            "/p/p/block/b1/view/correct/save",
            json!({"id": 1, "saved_hash": null}),
        ),
        (
            "/p/p/block/b1/view/correct/remove",
            json!({ "saved_hash": null }),
        ),
    ]);
}
