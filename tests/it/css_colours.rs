//! Style sheets take their colours from custom properties, so that a colour is changed, and has its dark form, in one place.

use crate::source_text::{files_with_extension, package_dir, slashed};

/// Style sheets that give custom properties a colour, and why they do not only use those of the app.
const WITH_COLOURS: [(&str, &str); 7] = [
    ("app/tokens.css", "the colours of the app and of reviews"),
    (
        "block-view/block-view.css",
        "marks on pictures, equal in both themes",
    ),
    (
        "documentation/documentation.css",
        "a web site without the app",
    ),
    (
        "local-server/session.css",
        "pages without a session get no other file",
    ),
    (
        "report/report.css",
        "the style of a file of its own, with colours of curves",
    ),
    (
        "review/review.css",
        "strokes and ink as the pictures show them",
    ),
    (
        "scan-viewer/scan-viewer.css",
        "part of exported pages, which have no other file",
    ),
];

/// Style sheets and colours that are no custom property, and why.
const LITERALS: [(&str, &str, &str); 4] = [
    (
        "app/app.css",
        "#fff",
        "QR codes need a light ground in the dark theme, too",
    ),
    ("app/app.css", "#000", "and dark modules"),
    (
        "review/review.css",
        "rgb(0 0 0 / 35%)",
        "in older browsers, a backdrop has no custom properties",
    ),
    (
        "block-view/block-view.css",
        "",
        "marks on pictures, equal in both themes",
    ),
];

/// Beginnings of colours.
const FUNCTIONS: [&str; 8] = [
    "rgb(", "rgba(", "hsl(", "hsla(", "hwb(", "oklch(", "oklab(", "color(",
];
/// Colours by name that somebody might type.
const NAMES: [&str; 12] = [
    "white", "black", "red", "green", "blue", "gray", "grey", "orange", "yellow", "silver", "navy",
    "brown",
];

/// Returns a style sheet without comments.
fn without_comments(text: &str) -> String {
    let mut parts = text.split("/*");
    let first = parts.next().into_iter();
    let others = parts.map(|part| part.split_once("*/").expect("the end of a comment").1);
    first.chain(others).collect()
}

/// Returns the properties and their values.
fn declarations(text: &str) -> Vec<(&str, &str)> {
    let parts = text.split_inclusive(['{', '}', ';']);
    let parts = parts.filter(|part| !part.ends_with('{'));
    let pairs = parts.filter_map(|part| part.split_once(':'));
    pairs
        .map(|(name, value)| (name.trim(), value.trim_end_matches(['}', ';']).trim()))
        .collect()
}

/// Returns whether a value has a colour that is no custom property.
fn has_literal_colour(value: &str) -> bool {
    let is_hex = |word: &str| {
        let digits = word.strip_prefix('#').unwrap_or_default();
        matches!(digits.len(), 3 | 4 | 6 | 8) && digits.chars().all(|c| c.is_ascii_hexdigit())
    };
    let mut words = value.split([' ', ',', '(', ')']);
    FUNCTIONS.iter().any(|function| value.contains(*function))
        || words.any(|word| is_hex(word) || NAMES.contains(&word))
}

#[test]
fn colours_are_custom_properties() {
    let assets = package_dir().join("assets");
    let sheets = files_with_extension(&assets, "css");
    assert!(sheets.len() >= WITH_COLOURS.len(), "{sheets:?}");
    let (mut wrong, mut defining, mut used) = (Vec::new(), Vec::new(), [false; LITERALS.len()]);
    for path in &sheets {
        let name = slashed(path, &assets);
        let text = without_comments(&std::fs::read_to_string(path).expect("UTF-8"));
        for (property, value) in declarations(&text) {
            if !has_literal_colour(value) {
                continue;
            }
            if property.starts_with("--") {
                defining.push(name.clone());
                continue;
            }
            let is_allowed =
                |(file, colour, _): &(&str, &str, &str)| *file == name && value.contains(*colour);
            match LITERALS.iter().position(is_allowed) {
                Some(index) => used[index] = true,
                None => wrong.push(format!("{name}: {property}: {value}")),
            }
        }
    }
    assert!(wrong.is_empty(), "no custom property: {wrong:#?}");
    assert_eq!(
        used,
        [true; LITERALS.len()],
        "an exception that nothing needs"
    );
    defining.sort();
    defining.dedup();
    assert_eq!(defining, WITH_COLOURS.map(|(name, _)| name));
}

#[test]
fn literal_colours_are_recognized() {
    for value in [
        "#fff",
        "1px solid #0003",
        "rgb(0 0 0 / 35%)",
        "linear-gradient(red, var(--x))",
    ] {
        assert!(has_literal_colour(value), "{value}");
    }
    for value in [
        "var(--red)",
        "url(#mark)",
        "transparent",
        "white-space",
        "0 2px 8px var(--shadow)",
    ] {
        assert!(!has_literal_colour(value), "{value}");
    }
    let text = without_comments("/* a: #fff; */ a:hover { color: red; --x: #000 }");
    assert_eq!(declarations(&text), [("color", "red"), ("--x", "#000")]);
}
