//! Styles and scripts of the app, embedded in the program.

use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Response};

use mocban_export::scan_view;

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// Name, content type and text of an asset.
const ASSETS: [(&str, &str, &str); 9] = [
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
        "columns.js",
        SCRIPT,
        include_str!("../../../../assets/app/columns.js"),
    ),
    (
        "import-files.js",
        SCRIPT,
        include_str!("../../../../assets/app/import-files.js"),
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
    match find(&name) {
        Some((kind, text)) => ([(header::CONTENT_TYPE, kind)], text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

/// Returns content type and text of an asset of the app or of the 3D view.
fn find(name: &str) -> Option<(&'static str, &'static str)> {
    let own = ASSETS.iter().find(|(asset, ..)| *asset == name);
    let own = own.map(|(_, kind, text)| (*kind, *text));
    own.or_else(|| scan_view::assets::find(name))
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

    #[test]
    fn every_imported_module_exists() {
        for (name, _, text) in ASSETS {
            for after in text.split(" from \"./").skip(1) {
                let module = after.split('"').next().unwrap_or_default();
                assert!(super::find(module).is_some(), "{name} imports {module}");
            }
        }
    }
}
