//! A page that shows the 3D view of a scan without a server. It holds its scripts and data and loads nothing.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use maud::{DOCTYPE, PreEscaped, html};

use super::assets::{CSS, MODULES, THREE};

/// Permits only the content of the page itself.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob: data:";
/// Starts the view with the data of the page.
const START: &str = "\
const text = document.getElementById(\"scan-data\").textContent.trim();
const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
await mountScanViewer(document.getElementById(\"scan-viewer\"), bytes.buffer, { language: preferredLanguage() });
";

/// Returns the page as HTML. `data` is an encoded view, as `ScanView::to_bytes` returns it.
pub(crate) fn standalone_page(title: &str, data: &[u8]) -> String {
    let modules: String = MODULES.iter().map(|(_, _, text)| inlined(text)).collect();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(CSS.2)) }
            }
            body.scan-page {
                main #scan-viewer {}
                noscript { p { "This page needs JavaScript. It loads nothing from other places." } }
                script #scan-data type="text/plain" { (PreEscaped(BASE64_STANDARD.encode(data))) }
                script { (PreEscaped(THREE.2)) }
                script type="module" { (PreEscaped(modules)) (PreEscaped(START)) }
            }
        }
    };
    page.into_string()
}

/// Returns a module without its imports and exports, so that several modules can be joined.
fn inlined(module: &str) -> String {
    let mut text = String::with_capacity(module.len());
    for line in module.lines().filter(|line| !line.starts_with("import ")) {
        text.push_str(line.strip_prefix("export ").unwrap_or(line));
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{inlined, standalone_page};
    use crate::scan_view::assets::{CSS, MODULES, THREE};

    #[test]
    fn modules_are_joined_without_imports_and_exports() {
        let module = "import { a } from \"./a.js\";\nexport const b = a;\nconst c = b;\n";
        assert_eq!(inlined(module), "const b = a;\nconst c = b;\n");
        for (name, _, text) in MODULES {
            // Imports and exports of several lines would not be recognized.
            for line in text.lines().filter(|line| line.starts_with("import ")) {
                assert!(line.ends_with(';'), "{name}: {line}");
            }
            assert!(
                !text.contains("export {") && !text.contains("export default"),
                "{name}"
            );
        }
    }

    #[test]
    fn no_asset_ends_its_element() {
        for (name, _, text) in [THREE, CSS].into_iter().chain(MODULES) {
            assert!(
                !text.contains("</script") && !text.contains("</style"),
                "{name}"
            );
            assert!(!text.contains("<!--"), "{name}");
        }
        let page = standalone_page("<b>", &[1, 2, 255]);
        assert!(page.contains("<title>&lt;b&gt;</title>") && page.contains(">AQL/</script>"));
    }
}
