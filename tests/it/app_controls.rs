//! The controls of all pages of the app: each is large enough for a finger, and is reached with the key Tab.

use std::path::Path;

use serde_json::json;

use crate::app::app;
use crate::app_browser::{enter, fits_width};
use crate::block_view::{BLOCK_SHOWN, finished_block};
use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::made_once::copy_of;
use crate::page::{Page, project_with_failure, read_project};
use crate::review_browser::ITEM;

/// Smallest width and height of a control in CSS pixels.
const SMALLEST: u32 = 44;

/// A page of the app is shown.
pub(crate) const SHOWN: &str = "document.body?.dataset.ready && !document.querySelector('#choice:not([data-ready])') && [...document.querySelectorAll('[data-load]')].every((part) => part.dataset.loaded)";

/// Pages of the app.
pub(crate) const PAGES: [&str; 23] = [
    "",
    "p/p/",
    "p/p/pairs",
    "p/p/pairs?view=table&compare=density",
    "p/p/pairs?state=retired",
    "p/p/pairs?state=failed",
    "p/p/pairs?id=nobody",
    "p/p/pair/upright-0000/?compare=density",
    "p/p/pair/upright-0000/?compare=paper",
    "p/p/pair/upright-0007/",
    "p/p/pair/broken/",
    "p/p/correct?what=unit&pair=broken",
    "p/p/blocks",
    "p/p/review",
    "p/p/report",
    "p/p/export",
    "import",
    "import?project=p&mend=broken",
    "import?project=p&mend_class=bad_input",
    "restore",
    "p/p/settings?key=run.workers&value=3",
    "p/p/health",
    "p/nowhere/",
];

/// Copies a project with a failed and a retired pair, a saved view and a backup.
pub(crate) fn varied_project(dir: &tempfile::TempDir) {
    copy_of("a varied project", dir.path(), make_varied);
}

fn make_varied(dir: &Path) {
    let project = project_with_failure(dir);
    let project = project.dir();
    mocban(project, &["retire", "upright-0007"]).expect(0);
    let views = r#"{"views":[{"name":"hỏng","list":"state=failed"}]}"#;
    std::fs::write(project.join("saved-views.json"), views).expect("written");
    mocban(project, &["backup", "backups/backup.sqlite"]).expect(0);
}

/// Fails if a control that is shown is smaller than a finger. A link within a sentence is as high as its line.
pub(crate) fn fits_fingers(tab: &Tab<'_>, what: &str) {
    let small = tab.eval(&format!(
        "(() => {{
            const controls = [...document.querySelectorAll('a[href], button, select, summary, input:not([type=hidden])')];
            const isInSentence = (one) => one.matches('a') && getComputedStyle(one).display === 'inline'
                && one.parentElement.textContent.trim() !== one.textContent.trim();
            return controls
                .filter((one) => one.checkVisibility() && !one.matches('.skip') && !isInSentence(one))
                .map((one) => (one.type === 'checkbox' ? one.closest('label') : one))
                .map((one) => [one.outerHTML.slice(0, 80), one.getBoundingClientRect()])
                .filter(([, {{ width, height }}]) => Math.min(width, height) < {SMALLEST} - 0.5)
                .map(([text, {{ width, height }}]) => `${{text}}: ${{width}} x ${{height}}`);
        }})()"
    ));
    assert_eq!(small, json!([]), "{what}");
}

#[test]
fn every_control_of_the_app_fits_a_finger() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let page = Page::of(&mut app(dir.path()));
    let (tab, home) = enter(&browser, &page, [1024, 768]);
    tab.use_fingers([1024, 768]);
    // `app_phone` opens the same pages on a phone.
    for path in PAGES {
        tab.open(&format!("{home}{path}"));
        tab.wait(SHOWN);
        fits_fingers(&tab, path);
        fits_width(&tab, path);
    }
    tab.screenshot("app_fingers_1024");
    for size in [[1024, 768], [400, 800]] {
        tab.use_fingers(size);
        tab.open(&format!("{home}p/p/pair/upright-0000/3d/"));
        tab.wait("document.querySelector('.scan-canvas canvas')");
        fits_fingers(&tab, &format!("3D {size:?}"));
    }
    // A small window has no room for small controls either.
    let narrow = browser.tab(400, 800);
    narrow.open(&format!("{home}p/p/pairs"));
    narrow.wait(SHOWN);
    fits_fingers(&narrow, "a narrow window");
}

#[test]
fn every_control_of_a_review_fits_a_finger() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1024, 768]);
    tab.open(&format!("{home}p/p/review"));
    tab.wait(SHOWN);
    tab.eval("document.querySelector('#reviewer').value = 'lan', document.querySelector('form.action .primary').click(), null");
    tab.wait(ITEM);
    for size in [[400, 800], [1024, 768]] {
        tab.use_fingers(size);
        fits_fingers(&tab, &format!("review {size:?}"));
        tab.screenshot(&format!("review_fingers_{}", size[0]));
    }
}

#[test]
fn every_control_of_the_views_of_a_block_fits_a_finger() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1024, 768]);
    for size in [[400, 800], [1024, 768]] {
        tab.use_fingers(size);
        for (path, shown) in [
            ("p/p/blocks", SHOWN),
            ("p/p/block/b1/", SHOWN),
            ("p/p/block/b1/view/", BLOCK_SHOWN),
            ("p/p/block/b1/view/correct", "window.mocbanCorrection"),
            ("p/p/block/b1/view/boxes", "window.mocbanBoxes"),
        ] {
            tab.open(&format!("{home}{path}"));
            tab.wait(shown);
            fits_fingers(&tab, &format!("{path} {size:?}"));
            fits_width(&tab, path);
        }
    }
}

#[test]
fn every_control_is_reached_with_the_key_tab() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    // Pages that read themselves again while they are shown have the same parts.
    let is_still = |path: &&&str| !["p/p/", "p/p/review", "p/p/export"].contains(*path);
    for path in PAGES.iter().filter(is_still) {
        tab.open(&format!("{home}{path}"));
        tab.wait(SHOWN);
        let count = tab.eval(
            "(() => {
                const all = [...document.querySelectorAll('a[href], button, select, summary, input, [tabindex=\"0\"]')];
                window.missed = new Set(all.filter((one) => one.checkVisibility() && !one.disabled && one.type !== 'hidden'));
                document.addEventListener('focusin', ({ target }) => window.missed.delete(target));
                return window.missed.size;
            })()",
        );
        for _ in 0..=count.as_u64().expect("a number") {
            tab.press("Tab", false);
        }
        let missed = tab.eval("[...window.missed].map((one) => one.outerHTML.slice(0, 80))");
        assert_eq!(missed, json!([]), "{path}");
    }
}
