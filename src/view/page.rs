//! HTML of the page.

use maud::{DOCTYPE, Markup, html};

/// Shown if the one-time address was used before.
const REFUSED: &str =
    "This address has already been used. Run the view command again to get a new one.";

/// Returns a whole document.
fn document(title: &str, head: &Markup, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                (head)
            }
            (body)
        }
    };
    page.into_string()
}

/// Returns the page of a pair. Its script loads the data and creates the controls.
pub(super) fn view(pair: &str) -> String {
    let head = html! {
        link rel="stylesheet" href="/assets/scan-viewer.css";
        link rel="icon" href="data:,";
        script type="module" src="/assets/view.js" {}
    };
    let body = html! {
        body.scan-page {
            main #scan-viewer {}
            noscript { p { "This page needs JavaScript. All of it is served by your own computer." } }
        }
    };
    document(pair, &head, &body)
}

/// Returns the page at the start address. It sends the browser on to the view.
pub(super) fn forward() -> String {
    let head = html! { meta http-equiv="refresh" content="0;url=/"; };
    let body = html! { body { p { a href="/" { "3D view" } } } };
    document("mocban", &head, &body)
}

/// Returns the page for a one-time token that was used before.
pub(super) fn token_used() -> String {
    let body = html! { body { h1 { (REFUSED) } } };
    document("mocban", &html! {}, &body)
}

#[cfg(test)]
mod tests {
    use super::{forward, token_used, view};

    #[test]
    fn pages_load_only_from_this_server() {
        for page in [view("a<b"), forward(), token_used()] {
            assert!(!page.contains("//"), "{page}");
        }
        assert!(view("a<b").contains("<title>a&lt;b</title>"));
    }
}
