//! HTML of the page.

use maud::html;

use crate::local_server::document;

/// Language of the page before its script translates it.
const LANGUAGE: &str = "en";

/// Returns the page of a pair. Its script loads the data and creates the controls.
pub(super) fn view(pair: &str) -> String {
    let head = html! {
        link rel="stylesheet" href="assets/scan-viewer.css";
        script type="module" src="assets/view.js" {}
    };
    let body = html! {
        body.scan-page {
            main #scan-viewer {}
            noscript { p { "This page needs JavaScript. All of it is served by your own computer." } }
        }
    };
    document(LANGUAGE, pair, &head, &body).into_string()
}

/// Returns the page of a block. Its script loads the data and creates the controls.
pub(super) fn block(name: &str) -> String {
    block_page(name, "assets/block-view.js")
}

/// Returns the page on which the alignment of a block is corrected.
pub(super) fn correction(name: &str) -> String {
    block_page(name, "assets/block-correct.js")
}

fn block_page(name: &str, script: &str) -> String {
    let head = html! {
        link rel="stylesheet" href="assets/scan-viewer.css";
        link rel="stylesheet" href="assets/block-view.css";
        script type="module" src=(script) {}
    };
    let body = html! {
        body.scan-page {
            main #block-view {}
            dialog #scan .scan-dialog {}
            noscript { p { "This page needs JavaScript. All of it is served by your own computer." } }
        }
    };
    document(LANGUAGE, name, &head, &body).into_string()
}

#[cfg(test)]
mod tests {
    use super::{block, correction, view};

    #[test]
    fn pages_load_only_from_this_server() {
        for page in [view("a<b"), block("a<b"), correction("a<b")] {
            assert!(!page.contains("//"), "{page}");
        }
        assert!(view("a<b").contains("<title>a&lt;b</title>"));
    }
}
