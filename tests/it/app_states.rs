//! States of the app's pages that follow an action, a failure or missing rights: no state violates a rule of axe-core, skips a
//! level of headings, is wider than its window or logs an error.

use std::fs;
use std::path::Path;

use serde_json::json;

use crate::accessible::{axe, no_violation};
use crate::app::app;
use crate::app_browser::{enter, fits_width};
use crate::app_controls::{SHOWN, varied_project};
use crate::app_shared::app_as_other_user;
use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::odd::{set_mode, set_writable};
use crate::page::Page;
use crate::waiting::wait_until;

/// A small and a large window; the small one is dark.
const WINDOWS: [([u32; 2], bool); 2] = [([1440, 900], false), ([400, 800], true)];
/// A task has ended well.
const DONE: &str = "document.querySelector('[data-task=done]')";

/// A browser at the pages of an app.
struct StateCheck<'b> {
    browser: &'b Browser,
    tab: Tab<'b>,
    axe: Option<String>,
    /// Address of the home page.
    home: String,
}

impl StateCheck<'_> {
    /// Opens a page.
    fn open(&self, path: &str) {
        self.tab.open(&format!("{}{path}", self.home));
        self.tab.wait(SHOWN);
    }

    /// Opens a page, uses one of its buttons, and waits for what follows.
    fn act(&self, path: &str, button: &str, follows: &str) {
        self.open(path);
        self.press(button, follows);
    }

    fn press(&self, button: &str, follows: &str) {
        self.tab.click(button, false);
        self.tab.wait(follows);
    }

    /// Checks the state that is shown.
    fn check(&self, what: &str) {
        let skipped = self.tab.eval(
            "(() => {
                const shown = [...document.querySelectorAll('h1, h2, h3, h4')].filter((one) => one.checkVisibility());
                const level = (one) => (one ? Number(one.tagName[1]) : 0);
                return shown.filter((one, index) => level(one) > level(shown[index - 1]) + 1).map((one) => one.outerHTML);
            })()",
        );
        assert_eq!(skipped, json!([]), "{what}: levels of headings");
        for (size, dark) in WINDOWS {
            self.tab.resize(size);
            self.tab.dark(dark);
            fits_width(&self.tab, what);
            let name = format!("state_{what}_{}", size[0]);
            match &self.axe {
                Some(axe) => no_violation(&self.tab, axe, &name),
                None => self.tab.screenshot(&name),
            }
        }
        self.tab.resize(WINDOWS[0].0);
        let mut problems = self.browser.take_problems();
        problems.retain(|problem| !problem.contains("axe"));
        assert!(problems.is_empty(), "{what}: {problems:#?}");
    }
}

/// Makes a project with results, failures of pairs and of a block, a pair that waits, and reviewers who disagree.
fn make_project(dir: &tempfile::TempDir) {
    varied_project(dir);
    let project = dir.path().join("p");
    let triangle = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 300 0 0\nvertex 0 200 0\nendloop\nendfacet\nendsolid a\n";
    fs::write(project.join("b1.stl"), triangle).expect("written");
    fs::write(project.join("b1.png"), "no image").expect("written");
    let block = ["import", "--block", "b1.stl", "--page", "b1.png"];
    mocban(&project, &block).expect(0);
    mocban(&project, &["run"]).expect(3);
    let list = "id,mesh,print\nnew,data/meshes/upright-0001.ply,data/prints/upright-0001.jpg\n";
    fs::write(project.join("new.csv"), list).expect("written");
    mocban(&project, &["import", "new.csv"]).expect(0);
    for (reviewer, verdict) in [("lan", "pass"), ("minh", "fail")] {
        for pair in ["upright-0001", "upright-0002"] {
            let set = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
            mocban(&project, &set).expect(0);
        }
    }
}

/// Checks pages whose state is that of the project.
fn check_stored_states(states: &StateCheck<'_>, project: &Path) {
    // The list has no pair of this id that could be left out.
    let refused_import = format!("import?list={}/more.csv&leave=nobody", project.display());
    for (what, path) in [
        ("retired", "p/p/pair/upright-0007/"),
        ("failed_block", "p/p/block/b1/"),
        ("blocks", "p/p/blocks"),
        ("agreement", "p/p/review"),
        ("refused_setting", "p/p/settings?key=run.workers&value=many"),
        ("refused_import", refused_import.as_str()),
    ] {
        states.open(path);
        states.check(what);
    }
}

/// Checks what pages show after actions.
fn check_actions(states: &StateCheck<'_>, project: &Path) {
    let setting = "p/p/settings?key=run.workers&value=3";
    let saved = format!("{SHOWN} && document.querySelector('#saved')");
    states.act(setting, "#save", &saved);
    states.check("saved_setting");
    let exported = format!("{DONE} && document.querySelector('.zip')");
    states.open("p/p/export");
    states
        .tab
        .eval("document.querySelector('#purpose').value = 'table', null");
    states.press("#export", &exported);
    states.check("exported");
    states.act("p/p/health", "#check", DONE);
    states.check("checked");
    let backup = format!("restore?backup={}/backups/backup.sqlite", project.display());
    states.act(&backup, "#restore", "document.querySelector('#restored')");
    states.check("restored");
}

/// Checks the page of a run that goes on, and that of one that stops. The run waits until the file is removed.
fn check_run(states: &StateCheck<'_>, hold: &Path) {
    states.act("p/p/", "#start", "document.querySelector('#stop')");
    wait_until("the run is held", || hold.exists());
    states.check("running");
    let stops = "document.querySelector('#stop')?.textContent === 'Stop at once'";
    states.press("#stop", stops);
    states.check("stopping");
    fs::remove_file(hold).expect("the run waits");
    states.tab.wait("document.querySelector('#start')");
}

/// Checks what a guest sees first.
fn check_guest(states: &StateCheck<'_>) {
    let tab = &states.tab;
    states.open("p/p/review");
    tab.eval("document.querySelector('#reviewer').value = 'Bảo', null");
    let invited = "document.querySelector('.invitation .qr path')";
    states.press("[name=invite]", invited);
    states.check("invited");
    let link = tab.eval("document.querySelector('.invitation .link').value");
    tab.open(link.as_str().expect("a link"));
    tab.wait("document.querySelector('form button')");
    states.check("welcome");
    let begun = "document.body?.dataset.ready && document.body.dataset.shown && document.querySelector('#guide[open]')";
    states.press("form button", begun);
    states.check("guest");
}

#[test]
fn every_state_is_accessible_and_logs_no_error() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let hold = tempfile::tempdir().expect("a temporary directory");
    let hold = hold.path().join("hold");
    let mut command = app(dir.path());
    command.args(["--lang", "en", "--listen", "127.0.0.1"]);
    command.env("MOCBAN_HOLD_AT", "fit:computed@new");
    command.env("MOCBAN_HOLD_FILE", &hold);
    let page = Page::of(&mut command);
    let (tab, home) = enter(&browser, &page, WINDOWS[0].0);
    let mut states = StateCheck {
        browser: &browser,
        tab,
        axe,
        home,
    };
    states.check("no_project");
    make_project(&dir);
    let folder = dir.path().canonicalize().expect("a path");
    let project = folder.join("p");
    check_stored_states(&states, &project);
    check_actions(&states, &project);
    check_run(&states, &hold);
    check_guest(&states);
    // The page of an app that has ended would say so.
    states.tab.open("about:blank");
    states.tab.wait("location.href === 'about:blank'");
    drop(page);
    // A command that ends well leaves no log, which only a user who may write could read.
    mocban(&project, &["retire", "upright-0003"]).expect(0);
    let mut command = app_as_other_user(dir.path());
    set_writable(&project, false);
    set_mode(dir.path(), 0o555);
    let page = Page::of(&mut command);
    let (tab, home) = enter(&browser, &page, WINDOWS[0].0);
    (states.tab, states.home) = (tab, home);
    for (what, path) in [
        ("read_only_folder", ""),
        ("read_only_run", "p/p/"),
        ("read_only_review", "p/p/review"),
    ] {
        states.open(path);
        states.tab.wait("document.querySelector('#read-only')");
        states.check(what);
    }
    set_mode(dir.path(), 0o755);
    set_writable(&project, true);
}
