//! The language of open reviews, blocks and pages that move follows the one that was chosen last, on whatever page.

use serde_json::json;

use crate::app::{act, app, html, open_app, text, with_project};
use crate::app_browser::{enter, on_page};
use crate::app_controls::SHOWN;
use crate::block_view::finished_block;
use crate::browser::Browser;
use crate::page::{Page, read_project};

#[track_caller]
fn has_language(page: &Page, path: &str, language: &str) {
    let html = html(page, path);
    let tag = format!("<html lang=\"{language}\"");
    assert!(html.contains(&tag), "{path} {language}: {html}");
}

#[test]
fn a_language_chosen_in_a_review_is_that_of_all_pages_until_another_is_chosen() {
    let (_dir, page) = with_project();
    let form = json!({"reviewer": "lan", "metric": "density", "sample": "", "order": "random"});
    let reply = act(&page, "/p/p/actions/review", &form, |_| {}).json();
    let address = format!("/p/p/{}", reply["go"].as_str().expect("a page"));
    for [in_review, elsewhere] in [["vi", "en"], ["en", "vi"]] {
        let chosen = page.get(&format!("{address}?lang={in_review}"));
        assert_eq!(chosen.status, 303);
        assert_eq!(chosen.header("location"), Some("./"));
        has_language(&page, &address, in_review);
        has_language(&page, "/p/p/pairs", in_review);
        has_language(&page, &format!("/p/p/?language={elsewhere}"), elsewhere);
        has_language(&page, &address, elsewhere);
    }
}

#[test]
fn an_open_block_follows_the_language_that_was_chosen_since() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let view = "/p/p/block/b1/view/";
    for language in ["vi", "en", "vi"] {
        has_language(&page, &format!("/p/p/?language={language}"), language);
        for path in [view.to_owned(), format!("{view}correct")] {
            let html = text(&page.get(&path));
            let tag = format!("<html lang=\"{language}\"");
            let given = format!("name=\"page-language\" content=\"{language}\"");
            for part in [tag, given] {
                assert!(html.contains(&part), "{path}: {part}: {html}");
            }
        }
        assert_eq!(page.get(&format!("{view}block.json")).status, 200);
    }
    let chosen = page.get(&format!("{view}correct?lang=en"));
    assert_eq!(chosen.header("location"), Some("correct"));
    has_language(&page, view, "en");
}

#[test]
fn a_page_that_moves_is_read_again_in_the_language_chosen_in_another_tab() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1280, 800]);
    tab.open(&format!("{home}p/p/"));
    let in_language = |language| {
        format!("document.body?.dataset.ready && document.documentElement.lang === '{language}'")
    };
    tab.wait(&in_language("en"));
    // As another tab does.
    tab.eval(&format!("fetch('{home}?language=vi'), null"));
    tab.wait(&in_language("vi"));
}

#[test]
fn what_was_typed_stays_on_the_way_back_and_in_the_other_language() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    let typed = |language: &str| {
        format!(
            "{SHOWN} && document.documentElement.lang === '{language}' && document.querySelector('#reviewer')?.value === 'lan'"
        )
    };
    tab.open(&format!("{home}p/p/review"));
    tab.wait(SHOWN);
    tab.click("#reviewer", false);
    tab.text("lan");
    tab.click("header a[hreflang]", false);
    tab.wait(&typed("vi"));
    tab.click("nav a[href$='/blocks']", false);
    tab.wait(&on_page("/blocks"));
    tab.eval("history.back(), null");
    tab.wait(&typed("vi"));
    // A link to the page shows it as it is made.
    tab.click("nav a[href$='/blocks']", false);
    tab.wait(&on_page("/blocks"));
    tab.click("nav a[href$='/review']", false);
    tab.wait(&on_page("/review"));
    // What was typed would be restored when the page has loaded.
    tab.wait("performance.getEntriesByType('navigation')[0].loadEventEnd > 0");
    assert_eq!(tab.eval("document.querySelector('#reviewer').value"), "");
}

#[test]
fn a_typed_setting_stays_alone_in_the_other_language_and_on_the_way_back() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    let field = |index: usize| {
        format!("document.querySelectorAll('form.setting input[name=value]')[{index}].value")
    };
    tab.open(&format!("{home}p/p/settings"));
    tab.wait(SHOWN);
    let other = tab.eval(&field(1));
    tab.eval(&format!("{} = 'typed', null", field(0)));
    tab.click("header a[hreflang]", false);
    let in_vietnamese = format!("{SHOWN} && document.documentElement.lang === 'vi'");
    tab.wait(&format!("{in_vietnamese} && {} === 'typed'", field(0)));
    assert_eq!(tab.eval(&field(1)), other);
    // Another page with the same path.
    tab.eval("setTimeout(() => { location.search = '?key=run.jobs'; }), null");
    tab.wait(&format!("{SHOWN} && location.search.includes('run.jobs')"));
    tab.eval("history.back(), null");
    tab.wait(&format!(
        "{SHOWN} && !location.search.includes('run.jobs') && {} === 'typed'",
        field(0)
    ));
    assert_eq!(tab.eval(&field(1)), other);
}
