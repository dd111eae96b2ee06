//! Styles and scripts of the app, embedded in the program.

use axum::extract::Path;
use axum::response::Response;

use crate::embedded::{self, EmbeddedAsset, SCRIPT, STYLE};

/// Builds an asset from its name and content type.
macro_rules! asset {
    ($name:literal, $kind:ident) => {
        (
            $name,
            $kind,
            include_str!(concat!("../../../../assets/app/", $name)),
        )
    };
}

const ASSETS: [EmbeddedAsset; 9] = [
    asset!("tokens.css", STYLE),
    asset!("app.css", STYLE),
    asset!("action.js", SCRIPT),
    asset!("app.js", SCRIPT),
    asset!("choose.js", SCRIPT),
    asset!("columns.js", SCRIPT),
    asset!("import-files.js", SCRIPT),
    asset!("pair.js", SCRIPT),
    asset!("upload.js", SCRIPT),
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
