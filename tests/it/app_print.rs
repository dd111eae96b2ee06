//! Reports on paper: the page of the app and the HTML file are black on white, without navigation and controls.

use serde_json::{Value, json};

use crate::app::app;
use crate::app_browser::enter;
use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::page::{Page, read_project};

/// Shows a page as it is printed, although the screen is dark.
fn as_printed(tab: &Tab<'_>) {
    let dark = json!([{ "name": "prefers-color-scheme", "value": "dark" }]);
    tab.call(
        "Emulation.setEmulatedMedia",
        &json!({ "media": "print", "features": dark }),
    );
}

fn style(tab: &Tab<'_>, selector: &str, property: &str) -> Value {
    tab.eval(&format!(
        "getComputedStyle(document.querySelector('{selector}')).{property}"
    ))
}

/// Fails unless a printed page is black on white, hides some parts and shows others.
fn is_for_paper(tab: &Tab<'_>, hidden: &[&str], shown: &[&str]) {
    for selector in hidden {
        assert_eq!(style(tab, selector, "display"), "none", "{selector}");
    }
    for selector in shown {
        assert_ne!(style(tab, selector, "display"), "none", "{selector}");
    }
    assert_eq!(style(tab, "h1", "color"), "rgb(0, 0, 0)");
}

#[test]
fn the_report_of_the_app_is_printed_once_its_numbers_are_there() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    tab.open(&format!("{home}p/p/report"));
    tab.wait("document.querySelector('#print')?.disabled === false");
    let loaded = tab.eval("document.querySelector('#numbers table') !== null");
    assert_eq!(loaded, true);
    tab.eval("window.print = () => { window.printed = true; }, null");
    tab.eval("document.querySelector('#print').click(), null");
    assert_eq!(tab.eval("window.printed"), true);
    as_printed(&tab);
    let shown = ["h1", "#numbers table", ".on-paper"];
    is_for_paper(&tab, &[".bar", "#print", ".not-on-paper"], &shown);
    let background = style(&tab, "body", "backgroundColor");
    assert_eq!(background, "rgb(255, 255, 255)");
    assert_eq!(style(&tab, ".scroll", "overflowX"), "visible");
    tab.screenshot("app_report_on_paper");
}

#[test]
fn the_html_report_is_printed_without_its_navigation() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let file = project.dir().join("report.html");
    let report = ["report", "-f", "html", "-o", "report.html"];
    mocban(project.dir(), &report).expect(0);
    let tab = browser.tab(800, 1000);
    tab.open(&format!("file://{}", file.display()));
    tab.wait("document.readyState === 'complete' && document.querySelector('figure.item')");
    as_printed(&tab);
    is_for_paper(
        &tab,
        &["nav", ".hint"],
        &["h1", ".wide table", "figure.item"],
    );
    let background = style(&tab, "html", "backgroundColor");
    assert_eq!(background, "rgb(255, 255, 255)");
    assert_eq!(style(&tab, ".wide", "breakInside"), "avoid");
    tab.screenshot("report_on_paper");
}
