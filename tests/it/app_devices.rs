//! The app with one kind of device: from a folder of files to an export by touch alone on a phone, and by keys alone.

use std::path::Path;

use crate::app::app;
use crate::app_browser::{enter, fits_width, on_page};
use crate::app_controls::SHOWN;
use crate::browser::{Browser, Tab};
use crate::cli::status;
use crate::page::{Page, read_project};
use crate::review_browser::{ITEM, accepts_an_answer, judge, saved, shown, shown_long_enough};

/// Number of pairs, and of the items that are judged.
const PAIRS: usize = 5;

/// Makes a folder with scans, prints and a list of some of them.
fn files(dir: &Path) {
    let from = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&from);
    std::fs::rename(project.dir().join("data"), dir.join("data")).expect("moved");
    let all = std::fs::read_to_string(dir.join("data/manifest.csv")).expect("a manifest");
    let some: Vec<&str> = all.lines().take(1 + PAIRS).collect();
    std::fs::write(dir.join("data/some.csv"), some.join("\n")).expect("written");
}

/// A person at the app.
struct Curator<'t, 'b> {
    tab: &'t Tab<'b>,
    /// Uses a control.
    activate: fn(&Tab<'_>, &str),
    /// Moves into a field.
    focus: fn(&Tab<'_>, &str),
    /// Closes the guide of a first review.
    close_guide: fn(&Tab<'_>),
    /// Passes the item that is shown.
    pass: fn(&Tab<'_>),
}

impl Curator<'_, '_> {
    /// Uses a control, and waits for what follows.
    fn use_control(&self, control: &str, follows: &str) {
        (self.activate)(self.tab, control);
        self.tab.wait(follows);
    }

    /// Types into a field.
    fn write(&self, field: &str, text: &str) {
        (self.focus)(self.tab, field);
        self.tab.text(text);
        let value = format!("document.querySelector(`{field}`).value === '{text}'");
        self.tab.wait(&value);
    }

    /// Goes from a folder to the report of its pairs, and to an export.
    fn comes_to_an_export(&self, dir: &Path) {
        let on_page = |section: &str| format!("{} && {SHOWN}", on_page(section));
        self.use_control("main a[href=import]", &on_page("/import"));
        let folder = "main a[href$='data'][href*='path=']";
        let listed = "a.button[href*='some.csv']";
        let shows_list = format!("{SHOWN} && document.querySelector(`{listed}`)");
        self.use_control(folder, &shows_list);
        let is_planned = format!("{SHOWN} && document.querySelector('#import')");
        self.use_control(listed, &is_planned);
        self.write("#project", "p");
        self.use_control("#import", &on_page("/p/p/"));
        let all = format!("document.querySelector('a.figure.good b')?.textContent === '{PAIRS}'");
        self.use_control("#start", &all);
        self.tab
            .wait("!document.querySelector('#stop') && document.querySelector('#start')");
        self.use_control("nav a[href$='/review']", &on_page("/review"));
        self.write("#reviewer", "lan");
        self.use_control("form.action .primary", ITEM);
        self.tab.wait("document.querySelector('#guide[open]')");
        (self.close_guide)(self.tab);
        self.tab.wait("!document.querySelector('dialog[open]')");
        for _ in 0..PAIRS {
            shown_long_enough(self.tab);
            (self.pass)(self.tab);
        }
        saved(self.tab);
        self.use_control("header a", &on_page("/p/p/"));
        self.use_control("nav a[href$='/report']", &on_page("/report"));
        self.tab.wait("document.querySelector('#numbers table')");
        fits_width(self.tab, "the report");
        let on_export = on_page("/export");
        self.use_control("nav a[href$='/export']", &on_export);
        let file = "main a[href^='exports/excel/']";
        let is_exported = format!("{on_export} && document.querySelector(`{file}`)");
        self.use_control("#export", &is_exported);
        assert!(dir.join("p/exports/excel").is_dir(), "the export is stored");
        let status = status(&dir.join("p"));
        assert_eq!(status["jobs"]["done"], PAIRS);
        // Some of the items are attention checks, or come twice.
        let passed = status["verdicts"]["pass"].as_u64();
        assert!(passed > Some(1), "{status}");
    }
}

/// Taps on the verdict.
fn tap_pass(tab: &Tab<'_>) {
    let before = shown(tab);
    accepts_an_answer(tab);
    tab.tap("button.verdict[data-action=pass]");
    tab.wait(&format!("document.body.dataset.shown !== '{before}'"));
}

#[test]
fn a_folder_comes_to_an_export_by_touch_alone_on_a_phone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    files(dir.path());
    let page = Page::of(app(dir.path()).args(["--lang", "vi"]));
    let size = [400, 800];
    let (tab, home) = enter(&browser, &page, size);
    tab.use_fingers(size);
    tab.open(&home);
    tab.wait(SHOWN);
    let curator = Curator {
        tab: &tab,
        activate: |tab, control| tab.tap(control),
        focus: |tab, field| tab.tap(field),
        close_guide: |tab| tab.tap("#guide form.title button"),
        pass: tap_pass,
    };
    curator.comes_to_an_export(dir.path());
}

#[test]
fn a_folder_comes_to_an_export_with_the_keyboard_alone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    files(dir.path());
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, _) = enter(&browser, &page, [1280, 800]);
    let curator = Curator {
        tab: &tab,
        activate: |tab, control| tab.press_enter_on(control),
        focus: |tab, field| tab.tab_to(field),
        close_guide: |tab| tab.key("Escape"),
        pass: |tab| judge(tab, "KeyP"),
    };
    curator.comes_to_an_export(dir.path());
}
