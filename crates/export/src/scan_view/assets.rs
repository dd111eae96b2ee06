//! Scripts and styles of the 3D view, embedded in the program.

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// Name, content type and text of an asset.
macro_rules! asset {
    ($name:literal, $kind:ident) => {
        (
            $name,
            $kind,
            include_str!(concat!("../../../../assets/scan-viewer/", $name)),
        )
    };
}

/// The part of three.js that the view needs; see `assets/scan-viewer/three.md`.
pub(super) const THREE: (&str, &str, &str) = asset!("three.min.js", SCRIPT);
pub(super) const CSS: (&str, &str, &str) = asset!("scan-viewer.css", STYLE);
/// The modules of the view. Each imports only earlier ones, and their top-level names differ.
pub(super) const MODULES: [(&str, &str, &str); 8] = [
    asset!("scan-messages.js", SCRIPT),
    asset!("scan-data.js", SCRIPT),
    asset!("scan-shaders.js", SCRIPT),
    asset!("scan-orbit.js", SCRIPT),
    asset!("scan-grid.js", SCRIPT),
    asset!("scan-scene.js", SCRIPT),
    asset!("scan-panel.js", SCRIPT),
    asset!("scan-viewer.js", SCRIPT),
];

/// Returns content type and text of an asset.
pub fn find(name: &str) -> Option<(&'static str, &'static str)> {
    let mut all = [THREE, CSS].into_iter().chain(MODULES);
    let (_, kind, text) = all.find(|(asset, ..)| *asset == name)?;
    Some((kind, text))
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::{CSS, MODULES, THREE};

    #[test]
    fn assets_refer_to_no_other_host() {
        for (name, _, text) in [THREE, CSS].into_iter().chain(MODULES) {
            // The XML namespace of created elements is not fetched.
            let text = text.replace("http://www.w3.org/1999/xhtml", "");
            for outside in [
                "http:",
                "https:",
                "//cdn",
                "@import",
                "eval(",
                "sourceMappingURL",
            ] {
                assert!(!text.contains(outside), "{name} has {outside}");
            }
        }
    }

    #[test]
    fn modules_import_only_earlier_modules() {
        let mut earlier = BTreeSet::from([THREE.0]);
        for (name, _, text) in MODULES {
            for after in text.split(" \"./").skip(1) {
                let module = after.split('"').next().unwrap_or_default();
                assert!(earlier.contains(module), "{name} imports {module}");
            }
            earlier.insert(name);
        }
    }

    #[test]
    fn top_level_names_differ() {
        let mut places = BTreeMap::new();
        for (name, _, text) in MODULES {
            for line in text.lines() {
                let line = line.strip_prefix("export ").unwrap_or(line);
                let kinds = ["const ", "let ", "function ", "async function ", "class "];
                let Some(rest) = kinds.iter().find_map(|kind| line.strip_prefix(kind)) else {
                    continue;
                };
                let declared: String = rest
                    .chars()
                    .take_while(|c| c.is_alphanumeric() || *c == '_')
                    .collect();
                let earlier = places.insert(declared.clone(), name);
                assert_eq!(earlier, None, "{declared} in {name}");
            }
        }
        assert!(places.len() > 20, "{places:?}");
    }
}
