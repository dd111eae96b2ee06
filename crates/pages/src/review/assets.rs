//! Scripts and styles of the page, embedded in the program. The page loads nothing from other hosts.

use crate::embedded::{EmbeddedAsset, SCRIPT, STYLE};

/// Name, content type and text of an asset.
macro_rules! asset {
    ($name:literal, $kind:ident) => {
        (
            $name,
            $kind,
            include_str!(concat!("../../../../assets/review/", $name)),
        )
    };
}

pub(super) const ASSETS: [EmbeddedAsset; 18] = [
    (
        "review.css",
        STYLE,
        concat!(
            include_str!("../../../../assets/app/tokens.css"),
            "\n",
            include_str!("../../../../assets/review/review.css")
        ),
    ),
    asset!("main.js", SCRIPT),
    asset!("config.js", SCRIPT),
    asset!("details.js", SCRIPT),
    asset!("end-page.js", SCRIPT),
    asset!("guide.js", SCRIPT),
    asset!("practice.js", SCRIPT),
    asset!("queue.js", SCRIPT),
    asset!("retry-queue.js", SCRIPT),
    asset!("image-cache.js", SCRIPT),
    asset!("render-worker.js", SCRIPT),
    asset!("masks.js", SCRIPT),
    asset!("viewer.js", SCRIPT),
    asset!("viewport.js", SCRIPT),
    asset!("keyboard.js", SCRIPT),
    asset!("alignment-editor.js", SCRIPT),
    asset!("scan-dialog.js", SCRIPT),
    asset!("ui.js", SCRIPT),
];

/// Returns the text of every script.
#[cfg(test)]
pub(super) fn scripts() -> impl Iterator<Item = &'static str> {
    let scripts = ASSETS.iter().filter(|(_, kind, _)| *kind == SCRIPT);
    scripts.map(|(_, _, text)| *text)
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
            let with_id = ["from \"./", "import(\"./", "Worker(\"assets/"].into_iter();
            for after in with_id.flat_map(|start| text.split(start).skip(1)) {
                let module = after.split('"').next().unwrap_or_default();
                assert!(find(&ASSETS, module).is_some(), "{name} imports {module}");
            }
        }
    }
}
