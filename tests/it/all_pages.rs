//! Every page in a browser: none logs an error on the console, has a failed request, or violates a rule of axe-core.

use std::path::Path;

use crate::accessible::{axe, no_violation};
use crate::block_view::{BLOCK_SHOWN, finished_block};
use crate::browser::{Browser, Tab};
use crate::cli::{binary, mocban};
use crate::page::{Page, read_project};
use crate::review_browser::{PLAIN, enter};

/// A small and a large window; the small one is dark.
const WINDOWS: [([u32; 2], bool); 2] = [([1280, 900], false), ([390, 800], true)];

/// Checks a page that is shown.
fn check(browser: &Browser, tab: &Tab<'_>, axe: Option<&String>, what: &str) {
    // Events that arrived before a reply are read with it.
    tab.eval("null");
    let problems = browser.take_problems();
    assert!(problems.is_empty(), "{what}: {problems:#?}");
    for (size, dark) in WINDOWS {
        tab.resize(size);
        tab.dark(dark);
        if let Some(axe) = axe {
            no_violation(tab, axe, &format!("{what}_{}", size[0]));
        }
    }
    // Requests of axe-core itself do not count.
    browser.take_problems();
}

/// Opens an address, waits until the page is shown, and checks it.
fn visit(browser: &Browser, axe: Option<&String>, what: &str, address: &str, shown: &str) {
    let tab = browser.tab(1280, 900);
    tab.open(address);
    tab.wait(shown);
    tab.wait("document.readyState === 'complete'");
    check(browser, &tab, axe, what);
}

fn view(dir: &Path, project: &str, name: &str) -> Page {
    let args = ["-C", project, "--json", "view", "--no-open", name];
    Page::of(binary().current_dir(dir).args(args))
}

/// Opens the hint of a manual alignment, the field for a note and the dialog for a pair. The image stays whole and in its
/// place. The dialog stays open.
fn nothing_covers_the_image(tab: &Tab<'_>) {
    let edge = |query: &str, edge: &str| {
        let value = tab.eval(&format!(
            "document.querySelector('{query}').getBoundingClientRect().{edge}"
        ));
        value.as_f64().expect("a number")
    };
    let bottom = edge(".picture", "bottom");
    for (key, shown) in [("KeyC", "#hint"), ("KeyN", "#note-row")] {
        tab.key(key);
        tab.wait(&format!("!document.querySelector('{shown}').hidden"));
        tab.screenshot(&format!("review_{key}"));
        assert!((edge(".picture", "bottom") - bottom).abs() < 1.0, "{shown}");
        assert!(edge(shown, "top") >= bottom, "{shown}");
        tab.key("Escape");
        tab.wait(&format!("document.querySelector('{shown}').hidden"));
    }
    tab.key("KeyJ");
    tab.wait("document.querySelector('#jump[open]')");
    assert!(edge("#jump label", "bottom") <= edge("#jump input", "top"));
    let [go, close] = ["button[value=go]", "button[formnovalidate]"];
    assert!(edge(go, "right") + 4.0 <= edge(close, "left"));
}

#[test]
fn no_served_page_has_a_fault() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let (axe, dir) = (axe(), tempfile::tempdir().expect("a temporary directory"));
    let project = read_project(&dir);
    let visit = |what: &str, address: &str, shown: &str| {
        visit(&browser, axe.as_ref(), what, address, shown);
    };
    let review = Page::start(&project, "lan", &PLAIN);
    let closed = "document.querySelector('[lang=vi] h1')";
    visit("closed", &format!("http://{}/", review.host), closed);
    let tab = enter(&browser, &review, [1280, 900]);
    tab.wait("document.body.dataset.prefetched");
    check(&browser, &tab, axe.as_ref(), "review");
    tab.resize(WINDOWS[0].0);
    nothing_covers_the_image(&tab);
    check(&browser, &tab, axe.as_ref(), "review_jump");
    let scan = view(dir.path(), "p", "upright-0001");
    visit("view_pair", &scan.url, "window.mocbanViewer");
}

#[test]
fn no_page_of_a_block_has_a_fault() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let (axe, dir) = (axe(), tempfile::tempdir().expect("a temporary directory"));
    finished_block(dir.path());
    let page = view(dir.path(), "p", "b1");
    let tab = browser.tab(1280, 900);
    tab.open(&page.url);
    tab.wait(BLOCK_SHOWN);
    check(&browser, &tab, axe.as_ref(), "view_block");
    tab.resize([1280, 900]);
    tab.eval("mocbanBlock.open(0), null");
    tab.wait("window.mocbanViewer");
    let buttons = "[...document.querySelectorAll('dialog button')].filter((one) => one.textContent === 'Close').length";
    assert_eq!(tab.eval(buttons), 1);
    check(&browser, &tab, axe.as_ref(), "view_block_scan");
    tab.key("Escape");
    tab.wait("!mocbanBlock.dialog.open");
    tab.eval("document.querySelector('a[href=correct]').click(), null");
    tab.wait("window.mocbanCorrection");
    check(&browser, &tab, axe.as_ref(), "correct");
}

#[test]
fn no_written_page_has_a_fault() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let (axe, dir) = (axe(), tempfile::tempdir().expect("a temporary directory"));
    let project = read_project(&dir);
    for (pair, verdict) in [("upright-0001", "fail"), ("upright-0002", "pass")] {
        let set = ["verdict", "set", pair, verdict, "--reviewer", "lan"];
        mocban(project.dir(), &set).expect(0);
    }
    for args in [
        &["report", "-f", "html", "-o", "report.html"][..],
        &["export", "--to", "viewer", "-o", "viewer"],
        &["docs", "docs"],
    ] {
        mocban(project.dir(), args).expect(0);
    }
    for (path, shown) in [
        ("report.html", "document.querySelector('figure.item')"),
        (
            "viewer/index.html",
            "document.querySelector('li img')?.naturalWidth",
        ),
        (
            "viewer/pairs/upright-0001/viewer.html",
            "window.mocbanViewer",
        ),
        ("docs/index.html", "document.querySelector('main h1')"),
        (
            "docs/guides/install.html",
            "document.querySelector('main pre')",
        ),
        (
            "docs/reference/data.html",
            "document.querySelector('main table')",
        ),
        (
            "docs/vi/thuat-ngu.html",
            "document.querySelector('main h1')",
        ),
    ] {
        let file = project.dir().join(path).canonicalize().expect(path);
        let address = format!("file://{}", file.display());
        let what = path.replace(['/', '.'], "_");
        visit(&browser, axe.as_ref(), &what, &address, shown);
    }
}
