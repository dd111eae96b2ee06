//! Scripts and styles of the page, embedded in the program. The page loads nothing from other hosts.

use crate::embedded::{EmbeddedAsset, SCRIPT, STYLE, embedded_asset};

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
    embedded_asset!("review", "main.js", SCRIPT),
    embedded_asset!("review", "config.js", SCRIPT),
    embedded_asset!("review", "details.js", SCRIPT),
    embedded_asset!("review", "end-page.js", SCRIPT),
    embedded_asset!("review", "guide.js", SCRIPT),
    embedded_asset!("review", "practice.js", SCRIPT),
    embedded_asset!("review", "queue.js", SCRIPT),
    embedded_asset!("review", "retry-queue.js", SCRIPT),
    embedded_asset!("review", "image-cache.js", SCRIPT),
    embedded_asset!("review", "render-worker.js", SCRIPT),
    embedded_asset!("review", "masks.js", SCRIPT),
    embedded_asset!("review", "viewer.js", SCRIPT),
    embedded_asset!("review", "viewport.js", SCRIPT),
    embedded_asset!("review", "keyboard.js", SCRIPT),
    embedded_asset!("review", "alignment-editor.js", SCRIPT),
    embedded_asset!("review", "scan-dialog.js", SCRIPT),
    embedded_asset!("review", "ui.js", SCRIPT),
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
