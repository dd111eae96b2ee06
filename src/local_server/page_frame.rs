//! HTML that all pages share: the frame of a document, and the pages of the start address.

use maud::{DOCTYPE, Markup, html};

/// Returns a whole document. `body` is the `body` element.
pub fn document(language: &str, title: &str, head: &Markup, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang=(language) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                (head)
            }
            (body)
        }
    }
}

/// Returns the page at the start address. It sends the browser on to the main page; `text` is a link to it.
pub fn forward_page(language: &str, title: &str, text: &str) -> Markup {
    let head = html! { meta http-equiv="refresh" content="0;url=/"; };
    document(
        language,
        title,
        &head,
        &html! { body { p { a href="/" { (text) } } } },
    )
}

/// Returns the page for a one-time token that was used before.
pub fn used_token_page(language: &str, title: &str, text: &str) -> Markup {
    document(
        language,
        title,
        &html! {},
        &html! { body { h1 { (text) } } },
    )
}
