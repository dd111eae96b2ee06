//! The app on a phone, 400 px wide: no page is wider than the window, and every control is reached and fits a finger.

use serde_json::json;

use crate::app::app;
use crate::app_browser::{enter, fits_width};
use crate::app_controls::{PAGES, SHOWN, fits_fingers, varied_project};
use crate::browser::{Browser, Tab};
use crate::page::Page;
use crate::review_browser::ITEM;

const PHONE: [u32; 2] = [400, 800];

/// Fails if a page scrolls sideways, or a control is covered by another part, outside of the window or small.
fn fits_phone(tab: &Tab<'_>, what: &str) {
    let covered = tab.eval(
        "(() => {
            for (const part of document.querySelectorAll('details')) part.open = true;
            const controls = [...document.querySelectorAll('a[href], button, select, summary, input:not([type=hidden])')];
            const isShown = (one) => one.checkVisibility() && !one.matches('.skip');
            return controls.filter(isShown).filter((one) => {
                one.scrollIntoView({ block: 'center', inline: 'center', behavior: 'instant' });
                const [{ left, top, width, height }] = one.getClientRects();
                const found = document.elementFromPoint(left + width / 2, top + height / 2);
                return !(one.closest('label') ?? one).contains(found);
            }).map((one) => one.outerHTML.slice(0, 80));
        })()",
    );
    assert_eq!(covered, json!([]), "{what}: covered");
    let aside = tab.eval("[scrollX, document.documentElement.scrollWidth - innerWidth]");
    assert_eq!(aside, json!([0, 0]), "{what}: the page scrolls sideways");
    fits_fingers(tab, what);
}

#[test]
fn every_page_fits_a_phone_in_both_languages() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let page = Page::of(&mut app(dir.path()));
    let (tab, home) = enter(&browser, &page, PHONE);
    tab.use_fingers(PHONE);
    let project = dir.path().canonicalize().expect("a path").join("p");
    let project = project.to_str().expect("UTF-8");
    let data = format!("{project}/data");
    let preview = format!("import?project=p&meshes={data}/meshes&prints={data}/prints");
    let list = format!("import?project=new&list={data}/manifest.csv");
    let restore = format!("restore?backup={project}/backups/backup.sqlite");
    let more = [&preview, &list, &restore].map(String::as_str);
    for path in PAGES.into_iter().chain(more) {
        for language in ["en", "vi"] {
            let join = if path.contains('?') { '&' } else { '?' };
            tab.open(&format!("{home}{path}{join}language={language}"));
            tab.wait(SHOWN);
            let what = format!("{path} {language}");
            // Before all parts of the page are opened, too.
            fits_fingers(&tab, &what);
            fits_width(&tab, &what);
            fits_phone(&tab, &what);
        }
    }
}

#[test]
fn what_follows_an_action_fits_a_phone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "vi", "--listen", "127.0.0.1"]));
    let (tab, home) = enter(&browser, &page, PHONE);
    tab.use_fingers(PHONE);
    let chosen = "document.querySelectorAll('[data-pair]:checked').length > 3";
    let start = |name: &str, button: &str| {
        format!(
            "document.querySelector('#reviewer').value = '{name}', document.querySelector('{button}').click(), null"
        )
    };
    let press = |button: &str| format!("document.querySelector('{button}').click(), null");
    for (path, action, shown) in [
        ("p/p/pairs", press("#choose-page"), chosen),
        ("p/p/pairs?view=table", "null".to_owned(), chosen),
        (
            "p/p/export",
            press("form.action .primary"),
            "document.querySelector('[data-task=done]') && document.querySelector('.zip')",
        ),
        (
            "p/p/health",
            press("form.action button"),
            "document.querySelector('[data-task=done]')",
        ),
        (
            "p/p/review",
            start("minh", "[name=invite]"),
            "document.querySelector('.qr')",
        ),
        ("p/p/review", start("lan", "form.action .primary"), ITEM),
    ] {
        tab.open(&format!("{home}{path}"));
        tab.wait(SHOWN);
        tab.eval(&action);
        tab.wait(shown);
        // The guide of a first review lies over its page.
        tab.eval("document.querySelector('dialog[open]')?.close(), null");
        tab.screenshot(&format!("phone_{}", path.replace(['/', '?', '='], "_")));
        fits_phone(&tab, path);
    }
    for pair in ["upright-0000", "broken"] {
        tab.open(&format!("{home}p/p/pair/{pair}/3d/"));
        tab.wait("document.querySelector('.scan-canvas canvas') || document.getElementById('scan-viewer')?.textContent");
        fits_phone(&tab, pair);
    }
}
