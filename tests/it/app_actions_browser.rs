//! Actions of a curator in a browser: settings, an import that is undone, a pair that is retired, runs of some pairs, a
//! disagreement that is settled, and the unit and the side of scans.

use std::path::Path;

use serde_json::Value;

use crate::app::app;
use crate::app_browser::{enter, on_page};
use crate::browser::{Browser, Tab};
use crate::cli::{mocban, status};
use crate::page::{Page, read_project};
use crate::review_browser::{ITEM, judge, saved, shown_long_enough};
use crate::waiting::{run_ends, wait_until};

/// The pairs of the page can be chosen.
const LISTED: &str =
    "document.body?.dataset.ready && document.querySelector('#choice')?.dataset.ready";

/// Opens a page of the project.
fn open(tab: &Tab<'_>, home: &str, path: &str) {
    tab.open(&format!("{home}{path}"));
    let (page, _) = path.split_once('?').unwrap_or((path, ""));
    tab.wait(&on_page(&format!("/{page}")));
}

/// Says yes to questions of the page.
fn agree(tab: &Tab<'_>) {
    tab.eval("window.confirm = () => true, null");
}

/// Saves a setting after a look at what it changes.
fn save_setting(tab: &Tab<'_>, home: &str, project: &Path) {
    let settings = || std::fs::read_to_string(project.join("mocban.toml")).unwrap_or_default();
    let before = settings();
    open(tab, home, "p/p/settings");
    tab.eval(
        "(() => {
            const field = document.getElementById('setting-run.workers');
            field.closest('details').open = true;
            field.value = '3';
            field.form.querySelector('button').id = 'look';
        })()",
    );
    tab.click("#look", false);
    tab.wait("document.body?.dataset.ready && document.querySelector('#save')");
    assert_eq!(settings(), before, "it is only shown");
    tab.click("#save", false);
    tab.wait("document.body?.dataset.ready && document.querySelector('#saved')");
    let after = settings();
    assert!(after.contains("workers = 3"), "{after}");
}

/// Undoes the newest import, and brings its pairs back.
fn undo_import(tab: &Tab<'_>, home: &str, project: &Path) {
    open(tab, home, "import?project=p");
    let button = |change: &str| format!("[name=change][value={change}]");
    let shown = |change: &str| tab.wait(&format!("document.querySelector('{}')", button(change)));
    for (change, next, pairs) in [("retire", "restore", 0), ("restore", "retire", 15)] {
        shown(change);
        tab.click(&button(change), false);
        shown(next);
        assert_eq!(status(project)["pairs"], pairs, "{change}");
    }
}

/// Takes a pair out of every count on its page, and brings it back.
fn retire_pair(tab: &Tab<'_>, home: &str, project: &Path) {
    open(tab, home, "p/p/pair/upright-0001/");
    agree(tab);
    tab.click("form[data-post$='actions/retire'] button", false);
    tab.wait("document.body?.dataset.ready && document.querySelector('#undo')");
    assert_eq!(status(project)["pairs"], 14);
    tab.click("#undo", false);
    tab.wait("document.querySelector('#done') && !document.querySelector('#undo')");
    assert_eq!(status(project)["pairs"], 15);
}

/// Runs the failed pairs again after their file was replaced, and then a chosen one.
fn run_some(tab: &Tab<'_>, home: &str, project: &Path) {
    std::fs::write(project.join("broken.ply"), "ply").expect("written");
    let list = "id,mesh,print\nbroken,broken.ply,data/prints/upright-0001.jpg\n";
    std::fs::write(project.join("more.csv"), list).expect("written");
    mocban(project, &["import", "more.csv"]).expect(0);
    mocban(project, &["run", "-q"]).expect(3);
    let mesh = project.join("data/meshes/upright-0001.ply");
    std::fs::copy(mesh, project.join("broken.ply")).expect("replaced");
    open(tab, home, "p/p/");
    tab.click("[name=which][value=failed]", false);
    wait_until("the failed pair is done", || {
        status(project)["jobs"]["done"] == 16
    });
    run_ends(project);
    let attempts = || {
        let shown = mocban(project, &["show", "upright-0002", "--json"]).expect(0);
        shown.json()["attempts"].as_array().map(Vec::len)
    };
    let before = attempts();
    tab.open(&format!("{home}p/p/pairs?view=table"));
    tab.wait(LISTED);
    tab.click("[data-pair=upright-0002]", false);
    agree(tab);
    tab.click("#compute", false);
    tab.wait("document.querySelector('#done')");
    wait_until("the pair is computed again", || attempts() > before);
    run_ends(project);
}

/// Settles a result on which two reviewers disagree.
fn settle(tab: &Tab<'_>, home: &str, project: &Path) {
    for pair in ["upright-0003", "upright-0004", "upright-0005"] {
        for (verdict, reviewer) in [("pass", "lan"), ("fail", "minh")] {
            let set = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
            let set = [&set[..], &["--metric", "ensemble"]].concat();
            mocban(project, &set).expect(0);
        }
    }
    open(tab, home, "p/p/review");
    tab.wait("document.querySelector('#reviewers table')");
    tab.eval(
        "document.querySelector('#reviewer').value = 'hoa',
         document.querySelector('[name=sample]').value = '',
         document.querySelector('[name=order]').value = 'adjudicate', null",
    );
    tab.click("form.action .primary", false);
    tab.wait(ITEM);
    tab.key("Escape");
    tab.wait("!document.querySelector('dialog[open]')");
    shown_long_enough(tab);
    judge(tab, "KeyP");
    saved(tab);
    let log = mocban(project, &["verdict", "log", "--json"]).expect(0);
    let settled = log.out.contains("adjudicate") && log.out.contains("hoa");
    assert!(settled, "{}", log.out);
}

#[test]
fn a_curator_changes_a_project_and_takes_changes_back() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let project = dir.path().join("p");
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    undo_import(&tab, &home, &project);
    retire_pair(&tab, &home, &project);
    save_setting(&tab, &home, &project);
    run_some(&tab, &home, &project);
    settle(&tab, &home, &project);
    mocban(&project, &["check"]).expect(0);
}

/// Adds two pairs whose unit is wrong, and lets them fail.
fn fail_by_unit(project: &Path) {
    let rows = [1, 2]
        .map(|n| format!("m-{n},data/meshes/upright-0001.ply,data/prints/upright-0001.jpg,m\n"));
    let list = format!("id,mesh,print,unit\n{}", rows.concat());
    std::fs::write(project.join("more.csv"), list).expect("written");
    mocban(project, &["import", "more.csv"]).expect(0);
    mocban(project, &["run", "-q"]).expect(3);
}

#[test]
fn failed_pairs_get_another_unit_and_the_other_side() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let project = dir.path().join("p");
    fail_by_unit(&project);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open(&tab, &home, "p/p/");
    tab.eval("document.querySelector('#failures').scrollIntoView(), null");
    tab.wait("document.querySelectorAll('.examples img').length === 4");
    tab.wait(
        "[...document.querySelectorAll('.examples img')].every((one) => one.complete && one.naturalWidth > 0)",
    );
    tab.screenshot("app_failed_groups");
    tab.click("#failures a[href*='what=unit&class=']", false);
    tab.wait(&on_page("/p/p/correct"));
    let text = tab.eval("document.querySelector('#corrected').textContent");
    assert_eq!(text, "2 pairs: m-1, m-2");
    // Without a unit, nothing is sent.
    agree(&tab);
    tab.click("#correct", false);
    assert_eq!(tab.eval("document.activeElement.id"), "unit");
    tab.eval("document.querySelector('#unit').value = 'mm', null");
    tab.eval("window.confirm = (text) => { window.asked = text; return false; }, null");
    tab.click("#correct", false);
    let asked = tab.eval("window.asked");
    let asked = asked.as_str().expect("a question");
    assert!(asked.contains("2 pairs"), "{asked}");
    assert_eq!(status(&project)["jobs"]["done"], 15, "nothing was done");
    agree(&tab);
    tab.click("#correct", false);
    tab.wait(&on_page("/p/p/"));
    wait_until("both are aligned", || {
        status(&project)["jobs"]["done"] == 17
    });
    run_ends(&project);
    let shown = || {
        mocban(&project, &["show", "m-1", "--json"])
            .expect(0)
            .json()
    };
    let found = shown();
    assert_eq!(found["unit"], "mm");
    assert_eq!(found["scanned_face_down"], Value::Null);
    open(&tab, &home, "p/p/pair/m-1/");
    tab.click(".actions a[href*='what=side']", false);
    tab.wait(&on_page("/p/p/correct"));
    agree(&tab);
    tab.click("#correct", false);
    tab.wait(&on_page("/pair/m-1/"));
    assert!(shown()["scanned_face_down"].is_boolean());
    run_ends(&project);
    mocban(&project, &["check"]).expect(0);
}
