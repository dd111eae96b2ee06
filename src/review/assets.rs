//! The page's script and style, built in: nothing comes from outside.

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const ICON: &str = "image/svg+xml";

/// Name, type and text.
const ASSETS: [(&str, &str, &str); 14] = [
    (
        "review.css",
        STYLE,
        include_str!("../../assets/review/review.css"),
    ),
    (
        "icon.svg",
        ICON,
        include_str!("../../assets/review/icon.svg"),
    ),
    (
        "main.js",
        SCRIPT,
        include_str!("../../assets/review/main.js"),
    ),
    (
        "boot.js",
        SCRIPT,
        include_str!("../../assets/review/boot.js"),
    ),
    (
        "deck.js",
        SCRIPT,
        include_str!("../../assets/review/deck.js"),
    ),
    (
        "outbox.js",
        SCRIPT,
        include_str!("../../assets/review/outbox.js"),
    ),
    (
        "pictures.js",
        SCRIPT,
        include_str!("../../assets/review/pictures.js"),
    ),
    (
        "painter.js",
        SCRIPT,
        include_str!("../../assets/review/painter.js"),
    ),
    (
        "masks.js",
        SCRIPT,
        include_str!("../../assets/review/masks.js"),
    ),
    (
        "stage.js",
        SCRIPT,
        include_str!("../../assets/review/stage.js"),
    ),
    (
        "lens.js",
        SCRIPT,
        include_str!("../../assets/review/lens.js"),
    ),
    (
        "keys.js",
        SCRIPT,
        include_str!("../../assets/review/keys.js"),
    ),
    (
        "correction.js",
        SCRIPT,
        include_str!("../../assets/review/correction.js"),
    ),
    (
        "screen.js",
        SCRIPT,
        include_str!("../../assets/review/screen.js"),
    ),
];

/// Type and text of an asset.
pub(super) fn find(name: &str) -> Option<(&'static str, &'static str)> {
    let found = ASSETS.iter().find(|(known, ..)| *known == name);
    found.map(|(_, kind, text)| (*kind, *text))
}

#[cfg(test)]
mod tests {
    use super::ASSETS;

    #[test]
    fn nothing_in_the_page_comes_from_outside() {
        for (name, _, text) in ASSETS {
            // The name of the form that an icon is in is no address to fetch.
            let text = text.replace("http://www.w3.org/2000/svg", "");
            for outside in ["http:", "https:", "//cdn", "@import", "eval("] {
                assert!(!text.contains(outside), "{name} has {outside}");
            }
        }
    }

    #[test]
    fn every_module_that_is_imported_is_there() {
        for (name, _, text) in ASSETS {
            let named = ["from \"./", "Worker(\"/assets/"].into_iter();
            for after in named.flat_map(|start| text.split(start).skip(1)) {
                let module = after.split('"').next().unwrap_or_default();
                assert!(super::find(module).is_some(), "{name} imports {module}");
            }
        }
    }
}
