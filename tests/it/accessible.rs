//! Accessibility of the pages, checked by axe-core. `AXE_JS` is the path of `axe.min.js`. Without it or without a
//! browser, the tests are skipped.

use serde_json::Value;

use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::page::{Page, read_project};
use crate::review_browser::{PLAIN, enter, judge};
use crate::skipped::say_skipped;

/// Returns the source of axe-core. Returns `None`, with a line on stderr, if axe-core is not available.
pub(crate) fn axe() -> Option<String> {
    let Some(path) = std::env::var_os("AXE_JS") else {
        say_skipped("AXE_JS names no axe.min.js");
        return None;
    };
    Some(std::fs::read_to_string(path).expect("axe.min.js"))
}

/// Fails if axe-core, whose source is `axe`, finds a violation. `what` names the state of the page.
pub(crate) fn no_violation(tab: &Tab<'_>, axe: &str, what: &str) {
    let found = run_axe(tab, axe, what, "{}");
    assert!(found["passes"].as_u64() > Some(10), "{found}");
    assert_eq!(found["violations"], serde_json::json!([]), "{what}");
}

/// Fails if axe-core finds text without enough contrast.
pub(crate) fn no_faint_text(tab: &Tab<'_>, axe: &str, what: &str) {
    let found = run_axe(tab, axe, what, "{ runOnly: ['color-contrast'] }");
    assert_eq!(found["passes"], 1, "{what}: {found}");
    assert_eq!(found["violations"], serde_json::json!([]), "{what}");
}

/// Runs axe-core with options, and returns how many rules pass, and the violations.
fn run_axe(tab: &Tab<'_>, axe: &str, what: &str, options: &str) -> Value {
    if tab.eval("typeof axe") != "object" {
        tab.eval(&format!("{axe}; null"));
    }
    // The elements that pass are not listed, which takes most of the time.
    let found = tab.eval(&format!(
        "axe.run({{ resultTypes: ['violations'], ...{options} }}).then(({{ passes, violations }}) => ({{
            passes: passes.length,
            violations: violations.map(({{ id, nodes }}) => `${{id}}: ${{nodes.map(({{ target }}) => target).join(' ')}}`),
        }}))",
    ));
    tab.screenshot(&what.replace([',', ' '], "_"));
    found
}

#[test]
fn axe_finds_nothing_in_the_review_page() {
    let (Some(axe), Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let few = [&PLAIN[..], &["--metric", "density", "--sample", "3"]].concat();
    for (language, size, dark) in [("en", [1440, 900], false), ("vi", [400, 800], true)] {
        let page = Page::start(
            &project,
            language,
            &[&few[..], &["--lang", language]].concat(),
        );
        let tab = enter(&browser, &page, size);
        tab.dark(dark);
        judge(&tab, "Digit1");
        judge(&tab, "KeyP");
        no_violation(&tab, &axe, &format!("{language}, an item"));
        for key in ["KeyH", "KeyJ", "Slash"] {
            tab.key(key);
            tab.wait("document.querySelector('dialog[open]')");
            no_violation(&tab, &axe, &format!("{language} after {key}"));
            tab.key("Escape");
            tab.wait("!document.querySelector('dialog[open]')");
        }
        tab.key("KeyC");
        tab.wait("document.getElementById('legend').textContent.includes('IoU')");
        no_violation(&tab, &axe, &format!("{language}, the alignment editor"));
        tab.key("Enter");
        tab.wait("!document.querySelector('[data-action=align]').classList.contains('on')");
        tab.key("KeyP");
        tab.wait("document.getElementById('bar').value === 3");
        tab.wait("document.getElementById('end').dataset.ready");
        no_violation(&tab, &axe, &format!("{language}, the end"));
    }
}

#[test]
fn axe_finds_nothing_in_a_report() {
    let (Some(axe), Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    for (pair, verdict) in [("upright-0001", "fail"), ("upright-0002", "pass")] {
        let set = ["verdict", "set", pair, verdict, "--reviewer", "lan"];
        mocban(project.dir(), &set).expect(0);
    }
    let file = project.dir().join("report.html");
    mocban(
        project.dir(),
        &["report", "-f", "html", "-o", "report.html"],
    )
    .expect(0);
    for (size, dark) in [([1200, 900], false), ([400, 800], true)] {
        let tab = browser.tab(size[0], size[1]);
        tab.dark(dark);
        tab.open(&format!("file://{}", file.display()));
        tab.wait("document.querySelector('figure.item') && document.readyState === 'complete'");
        no_violation(&tab, &axe, &format!("{size:?}"));
    }
}
