//! `mocban app` in a browser: from an empty folder to a report without a typed command, every page in both themes, and the
//! keyboard alone.

use std::time::{Duration, Instant};

use crate::accessible::{axe, no_faint_text, no_violation};
use crate::app::app;
use crate::browser::{Browser, Tab};
use crate::cli::{mocban, status};
use crate::page::{Page, project_with_failure, read_project};
use crate::review_browser::{ITEM, judge, saved, shown_long_enough};
use crate::waiting::wait_until;

/// Longest time from an empty folder to the report of the demo. It is no measurement of speed: the demo takes a small part of
/// it, also on a busy computer.
const DEMO_LIMIT: Duration = Duration::from_mins(5);

/// Opens the app in a tab and returns the address of its home page.
pub(crate) fn enter<'b>(browser: &'b Browser, page: &Page, size: [u32; 2]) -> (Tab<'b>, String) {
    let tab = browser.tab(size[0], size[1]);
    tab.open(&page.url);
    tab.wait("document.body?.dataset.ready");
    let home = tab.eval("location.href");
    (tab, home.as_str().expect("a URL").to_owned())
}

/// Follows a link or presses a button with the mouse, and waits for what follows.
fn click(tab: &Tab<'_>, element: &str, follows: &str) {
    tab.click(element, false);
    tab.wait(follows);
}

/// The page of a section is shown.
pub(crate) fn on_page(section: &str) -> String {
    format!("document.body?.dataset.ready && location.pathname.endsWith('{section}')")
}

/// The page of a pair is shown, and its keys work.
fn on_pair(name: &str) -> String {
    format!(
        "{} && document.getElementById('stage')?.dataset.ready",
        on_page(&format!("/pair/{name}/"))
    )
}

#[test]
fn the_demo_comes_to_its_report_without_a_typed_command() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let began = Instant::now();
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, _) = enter(&browser, &page, [1366, 660]);
    click(&tab, "#demo", &on_page("/p/mocban-demo/"));
    tab.screenshot("app_before_run");
    click(
        &tab,
        "#start",
        "document.querySelectorAll('.pair-card').length > 0",
    );
    tab.screenshot("app_running");
    // The page follows the run by itself.
    tab.wait("document.querySelector('a.figure.good b')?.textContent === '24'");
    tab.wait("!document.querySelector('#stop') && document.querySelector('#start')");
    click(&tab, "nav a[href$='/review']", &on_page("/review"));
    tab.click("#reviewer", false);
    tab.text("lan");
    click(&tab, "form.action .primary", ITEM);
    tab.key("Escape");
    tab.wait("!document.querySelector('dialog[open]')");
    for _ in 0..4 {
        shown_long_enough(&tab);
        judge(&tab, "KeyP");
    }
    saved(&tab);
    click(&tab, "header a", &on_page("/p/mocban-demo/"));
    click(&tab, "nav a[href$='/report']", &on_page("/report"));
    tab.wait("document.querySelector('#numbers table')");
    let took = began.elapsed();
    assert!(took < DEMO_LIMIT, "the demo took {took:?}");
    tab.screenshot("app_report");
    let text = tab.eval("document.querySelector('#numbers').innerText");
    assert!(text.as_str().expect("text").contains("24"), "{text}");
    let status = status(&dir.path().join("mocban-demo"));
    assert_eq!(status["jobs"]["done"], 24);
    let judged = status["verdicts"]["pass"].as_u64();
    assert!(judged > Some(0), "{judged:?}");
}

#[test]
fn every_page_is_accessible_in_both_themes_and_logs_no_error() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    project_with_failure(dir.path());
    let page = Page::of(&mut app(dir.path()));
    let (tab, home) = enter(&browser, &page, [1440, 900]);
    for (name, path) in [
        ("home", ""),
        ("run", "p/p/"),
        ("pairs", "p/p/pairs"),
        ("table", "p/p/pairs?view=table&state=failed"),
        ("none", "p/p/pairs?block=nowhere"),
        ("unknown", "p/p/pairs?id=nobody"),
        ("unsaved", "p/p/pairs?sort=iou"),
        ("pair", "p/p/pair/upright-0000/"),
        ("paper", "p/p/pair/upright-0000/?compare=paper"),
        ("failed_pair", "p/p/pair/broken/"),
        ("unit", "p/p/correct?what=unit&class=no_solution"),
        ("side", "p/p/correct?what=side&pair=upright-0000"),
        ("no_blocks", "p/p/blocks"),
        ("review", "p/p/review"),
        ("report", "p/p/report"),
        ("export", "p/p/export"),
        ("import", "import"),
        ("restore", "restore"),
        ("settings", "p/p/settings?key=run.workers&value=3"),
        ("health", "p/p/health"),
        ("missing", "p/nowhere/"),
    ] {
        looks_right(
            &browser,
            &tab,
            name,
            &format!("{home}{path}"),
            axe.as_deref(),
        );
    }
}

/// Asserts that a page is no wider than its window.
pub(crate) fn fits_width(tab: &Tab<'_>, what: &str) {
    let overflow = tab.eval("document.documentElement.scrollWidth - innerWidth");
    let fits = overflow.as_f64().is_some_and(|px| px <= 0.0);
    assert!(fits, "{what} is {overflow} px too wide");
}

/// Opens a page in every size and theme. It must fit, have no fault that axe finds, and log no error.
pub(crate) fn looks_right(
    browser: &Browser,
    tab: &Tab<'_>,
    name: &str,
    url: &str,
    axe: Option<&str>,
) {
    tab.resize([1440, 900]);
    tab.open(url);
    tab.wait("document.body?.dataset.ready");
    // Rules that ask what an element is called or how elements nest have the same answer in both themes.
    for (size, dark, all_rules) in [
        ([1440, 900], false, true),
        ([1366, 660], true, false),
        ([400, 800], true, false),
        ([400, 800], false, true),
    ] {
        tab.resize(size);
        tab.dark(dark);
        fits_width(tab, &format!("{name} {size:?}"));
        let theme = if dark { "dark" } else { "light" };
        let what = format!("app_{name}_{}_{theme}", size[0]);
        match axe {
            Some(axe) if all_rules => no_violation(tab, axe, &what),
            Some(axe) => no_faint_text(tab, axe, &what),
            None => tab.screenshot(&what),
        }
    }
    let mut problems = browser.take_problems();
    problems.retain(|problem| !problem.contains("axe"));
    assert!(problems.is_empty(), "{name}: {problems:#?}");
}

#[test]
fn a_pair_is_found_and_seen_with_the_keyboard_alone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    tab.open(&format!("{home}p/p/pairs"));
    tab.wait(&on_page("/pairs"));
    tab.tab_to("#jump-id");
    tab.text("upright-0003");
    tab.press("Enter", false);
    tab.wait(&on_pair("upright-0003"));
    tab.key("KeyB");
    tab.wait("document.querySelector('#blink').getAttribute('aria-pressed') === 'true'");
    tab.wait("document.querySelector('#stage').src.includes('relief')");
    tab.key("KeyB");
    tab.key("ArrowRight");
    tab.wait(&on_pair("upright-0004"));
    tab.key("ArrowLeft");
    tab.wait(&on_pair("upright-0003"));
    tab.press_enter_on("main a[href='3d/']");
    tab.wait("document.querySelector('.scan-canvas canvas')");
    tab.eval("history.back(), null");
    tab.wait(&on_pair("upright-0003"));
    // No control has a negative tab index, not even a hidden one.
    let unreachable = tab.eval(
        "[...document.querySelectorAll('a[href], button, input, select')].filter((one) => one.tabIndex < 0).length",
    );
    assert_eq!(unreachable, 0);
}

#[test]
fn a_run_survives_the_app_and_is_stopped_from_the_next_one() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let demo = ["demo", "p", "--pairs", "12", "--no-run", "-q"];
    mocban(dir.path(), &demo).expect(0);
    // The run waits at its third pair until the file is removed.
    let hold = dir.path().join("hold");
    let held = || {
        let mut command = app(dir.path());
        command.args(["--lang", "en"]);
        command.env("MOCBAN_HOLD_AT", "register:computed:3");
        command.env("MOCBAN_HOLD_FILE", &hold);
        command
    };
    let mut page = Page::of(&mut held());
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    tab.open(&format!("{home}p/p/"));
    tab.wait(&on_page("/p/p/"));
    tab.eval("document.querySelector('[name=jobs]').value = '1', document.querySelector('#start').click(), null");
    tab.wait("document.querySelector('#stop')");
    wait_until("the run is held", || hold.exists());
    page.kill();
    let project = dir.path().join("p");
    assert_eq!(status(&project)["running"], true, "the run goes on");
    let next = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &next, [1280, 800]);
    tab.open(&format!("{home}p/p/"));
    tab.wait(&on_page("/p/p/"));
    tab.wait("document.querySelector('#stop')");
    tab.eval("document.querySelector('#stop').click(), null");
    tab.wait("document.querySelector('#stop')?.textContent === 'Stop at once'");
    std::fs::remove_file(&hold).expect("the run waits");
    tab.wait("document.querySelector('#start')");
    let stopped = status(&project);
    assert_eq!(stopped["running"], false);
    assert_eq!(stopped["jobs"]["leased"], 0);
    assert!(stopped["jobs"]["ready"].as_u64() > Some(0), "{stopped}");
    mocban(&project, &["check"]).expect(0);
}

#[test]
fn a_number_that_was_typed_stays_when_the_page_is_renewed() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    tab.open(&format!("{home}p/p/"));
    tab.wait(&on_page("/p/p/"));
    tab.eval("document.querySelector('[name=jobs]').value = '7', null");
    let verdict = ["verdict", "set", "upright-0001", "pass"];
    let verdict = [&verdict[..], &["--reviewer", "lan"]].concat();
    mocban(&dir.path().join("p"), &verdict).expect(0);
    tab.wait("document.querySelector('a.figure[href=review]')");
    let typed = tab.eval("document.querySelector('[name=jobs]').value");
    assert_eq!(typed, "7");
}
