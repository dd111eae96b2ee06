//! Styles and scripts of the app, embedded in the program.

use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Response};

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// Name, content type and text of an asset.
const ASSETS: [(&str, &str, &str); 7] = [
    (
        "tokens.css",
        STYLE,
        include_str!("../../../../assets/app/tokens.css"),
    ),
    (
        "app.css",
        STYLE,
        include_str!("../../../../assets/app/app.css"),
    ),
    (
        "action.js",
        SCRIPT,
        include_str!("../../../../assets/app/action.js"),
    ),
    (
        "app.js",
        SCRIPT,
        include_str!("../../../../assets/app/app.js"),
    ),
    (
        "choose.js",
        SCRIPT,
        include_str!("../../../../assets/app/choose.js"),
    ),
    (
        "pair.js",
        SCRIPT,
        include_str!("../../../../assets/app/pair.js"),
    ),
    (
        "upload.js",
        SCRIPT,
        include_str!("../../../../assets/app/upload.js"),
    ),
];

pub(super) async fn asset(Path(name): Path<String>) -> Response {
    match ASSETS.iter().find(|(asset, ..)| *asset == name) {
        Some((_, kind, text)) => ([(header::CONTENT_TYPE, *kind)], *text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::ASSETS;
    use crate::local_server::assert_loads_nothing;

    #[test]
    fn assets_refer_to_no_other_host() {
        for (name, _, text) in ASSETS {
            assert_loads_nothing(name, text);
        }
    }
}
