//! Styles and scripts of the app, embedded in the program.

use axum::extract::Path;
use axum::response::Response;

use crate::embedded::{self, EmbeddedAsset, SCRIPT, STYLE, embedded_asset};

const ASSETS: [EmbeddedAsset; 10] = [
    embedded_asset!("app", "tokens.css", STYLE),
    embedded_asset!("app", "app.css", STYLE),
    embedded_asset!("app", "action.js", SCRIPT),
    embedded_asset!("app", "app.js", SCRIPT),
    embedded_asset!("app", "choose.js", SCRIPT),
    embedded_asset!("app", "columns.js", SCRIPT),
    embedded_asset!("app", "import-files.js", SCRIPT),
    embedded_asset!("app", "pair.js", SCRIPT),
    embedded_asset!("app", "typed.js", SCRIPT),
    embedded_asset!("app", "upload.js", SCRIPT),
];

pub(super) async fn asset(Path(name): Path<String>) -> Response {
    embedded::asset(&ASSETS, &name)
}

#[cfg(test)]
mod tests {
    use super::ASSETS;
    use crate::embedded::find;
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
                assert!(find(&ASSETS, module).is_some(), "{name} imports {module}");
            }
        }
    }
}
