//! HTML of the page.

use maud::{Markup, html};

use crate::local_server::document;
use crate::review::Language;

/// Language of the page before its script translates it, unless one is given.
const DEFAULT_LANGUAGE: Language = Language::English;

/// Returns the language for the script. Without one, it chooses the language of the browser.
fn chosen(language: Option<Language>) -> Markup {
    html! { @if let Some(language) = language { meta name="page-language" content=(language.name()); } }
}

/// Returns the link to the page in the app from which a view was opened, if there is one.
fn back_link(name: &str, back: Option<&str>) -> Markup {
    html! { @if let Some(back) = back { nav.scan-back { a href=(back) { "← " (name) } } } }
}

/// Says that the page needs its script, which also chooses the language.
fn no_script() -> Markup {
    html! {
        noscript {
            p { "This page needs JavaScript. All of it is served by your own computer." }
            p lang="vi" { "Trang này cần JavaScript. Mọi thứ đều do máy tính của bạn cung cấp." }
        }
    }
}

/// Returns the page of a pair, with a link to `back`. Its script loads the data and creates the controls.
pub(crate) fn view(pair: &str, language: Option<Language>, back: Option<&str>) -> String {
    let head = html! {
        (chosen(language))
        link rel="stylesheet" href="assets/scan-viewer.css";
        script type="module" src="assets/view.js" {}
    };
    let body = html! {
        body.scan-page {
            (back_link(pair, back))
            main #scan-viewer {}
            (no_script())
        }
    };
    let language = language.unwrap_or(DEFAULT_LANGUAGE);
    document(language.name(), pair, &head, &body).into_string()
}

/// Returns the page of a block, with a link to `back`. Its script loads the data and creates the controls.
pub(super) fn block(name: &str, language: Option<Language>, back: Option<&str>) -> String {
    // The script asks for this picture only when it knows the characters.
    let first = html! { link rel="preload" as="image" href="layer/page"; };
    block_page(name, language, back, "assets/block-view.js", &first)
}

/// Returns the page on which the alignment of a block is corrected, with a link to `back`.
pub(super) fn correction(name: &str, language: Option<Language>, back: Option<&str>) -> String {
    block_page(name, language, back, "assets/block-correct.js", &html! {})
}

/// Returns the page on which the boxes of a block are changed, with a link to `back`.
pub(super) fn boxes(name: &str, language: Option<Language>, back: Option<&str>) -> String {
    block_page(name, language, back, "assets/block-boxes.js", &html! {})
}

/// Returns a page of a block whose head also has `more`.
fn block_page(
    name: &str,
    language: Option<Language>,
    back: Option<&str>,
    script: &str,
    more: &Markup,
) -> String {
    let head = html! {
        (chosen(language))
        link rel="stylesheet" href="assets/scan-viewer.css";
        link rel="stylesheet" href="assets/block-view.css";
        (more)
        script type="module" src=(script) {}
    };
    let body = html! {
        body.scan-page {
            (back_link(name, back))
            main #block-view { p.block-line.block-busy { "…" } }
            dialog #scan .scan-dialog {}
            (no_script())
        }
    };
    let language = language.unwrap_or(DEFAULT_LANGUAGE);
    document(language.name(), name, &head, &body).into_string()
}

#[cfg(test)]
mod tests {
    use super::{Language, block, boxes, correction, view};

    #[test]
    fn pages_load_only_from_this_server() {
        for page in pages(None) {
            assert!(!page.contains("//"), "{page}");
        }
        assert!(view("a<b", None, None).contains("<title>a&lt;b</title>"));
    }

    fn pages(language: Option<Language>) -> [String; 4] {
        let pages = [view, block, boxes, correction];
        pages.map(|page| page("a<b", language, None))
    }

    #[test]
    fn a_page_of_the_app_leads_back() {
        let link = r#"<nav class="scan-back"><a href="../">← a&lt;b</a></nav>"#;
        for page in [view, block, boxes, correction] {
            let shown = page("a<b", None, Some("../"));
            assert!(shown.contains(link), "{shown}");
            assert!(!page("a<b", None, None).contains("scan-back"));
        }
    }

    #[test]
    fn a_given_language_is_named_to_the_script() {
        for page in pages(Some(Language::Vietnamese)) {
            assert!(page.contains(r#"<html lang="vi">"#), "{page}");
            let given = r#"<meta name="page-language" content="vi">"#;
            assert!(page.contains(given), "{page}");
        }
        for page in pages(None) {
            assert!(!page.contains("page-language"), "{page}");
        }
    }
}
