//! Conventions for every source file: names, lengths and documentation.

use std::collections::{BTreeMap, BTreeSet};

use crate::source_text::{crates, identifier, package_dir, rust_files, source_files};

/// Longest source file, tests included.
const MAX_LINES: usize = 450;

/// Names of types that are declared more than once. Remove a name here when it is unique; add none.
const REPEATED_TYPES: &[&str] = &[];

/// Names of associated types, which repeat by nature.
const ASSOCIATED_TYPES: &[&str] = &[
    "Err",
    "Error",
    "IntoIter",
    "Item",
    "Target",
    "Output",
    "Rejection",
];

/// Rooms whose public functions say in their first words what they do.
const NUMERIC_MODULES: &[&str] = &["/stages/", "/mesh/", "/raster/", "results/src/stats"];

/// Phrases that no documentation uses.
const BANNED_PHRASES: &[&str] = &[
    " tells ",
    " is told",
    " are told",
    " had of ",
    " so many ",
    " those that ",
    " laid on ",
    " for ever ",
    " for ever.",
    " looked at once",
    " in hand",
    " as it is ",
    " are had",
    " is had",
];

/// Files above the limit. Remove a file here when it is split; add none.
const LONG_FILES: &[&str] = &[];

/// Returns the type declared on a line, if it is not local to a function.
fn declared_type(line: &str) -> Option<String> {
    let indent = line.len() - line.trim_start().len();
    let mut text = line.trim_start();
    if let Some(rest) = text.strip_prefix("pub") {
        text = rest
            .strip_prefix('(')
            .and_then(|rest| rest.split_once(')'))
            .map_or(rest, |(_, rest)| rest)
            .trim_start();
    }
    let name = ["struct ", "enum ", "trait ", "type "]
        .iter()
        .find_map(|keyword| text.strip_prefix(keyword))?;
    (indent == 0).then(|| identifier(name))
}

#[test]
fn type_names_are_unique() {
    let mut places: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in source_files() {
        for name in file.production_code().lines().filter_map(declared_type) {
            places.entry(name).or_default().insert(file.name.clone());
        }
    }
    places.retain(|name, files| files.len() > 1 && !ASSOCIATED_TYPES.contains(&name.as_str()));
    let known: BTreeSet<&str> = REPEATED_TYPES.iter().copied().collect();
    places.retain(|name, _| !known.contains(name.as_str()));
    assert!(places.is_empty(), "declared more than once: {places:#?}");
}

#[test]
fn files_are_short_enough_to_read_at_once() {
    let mut long = BTreeSet::new();
    for dir in ["src", "crates", "tests", "benches"] {
        for path in rust_files(&package_dir().join(dir)) {
            let text = std::fs::read_to_string(&path).expect("readable source");
            if text.lines().count() > MAX_LINES {
                let name = path
                    .strip_prefix(package_dir())
                    .expect("a path below the package");
                long.insert(name.to_string_lossy().into_owned());
            }
        }
    }
    long.retain(|name| !LONG_FILES.contains(&name.as_str()));
    assert!(
        long.is_empty(),
        "files of more than {MAX_LINES} lines: {long:?}"
    );
}

#[test]
fn every_file_starts_with_its_purpose() {
    for dir in ["src", "crates", "tests", "benches"] {
        for path in rust_files(&package_dir().join(dir)) {
            let text = std::fs::read_to_string(&path).expect("readable source");
            assert!(text.starts_with("//! "), "{}", path.display());
        }
    }
}

/// Returns the public functions of a text, each with the first line of its documentation.
fn documented_functions(text: &str) -> Vec<(String, String)> {
    let mut first_line = None;
    let mut found = Vec::new();
    for line in text.lines().map(str::trim_start) {
        if let Some(doc) = line.strip_prefix("///") {
            first_line.get_or_insert_with(|| doc.trim().to_owned());
        } else if line.starts_with("#[") {
            // An attribute stands between the documentation and the function.
        } else {
            let signature = line
                .strip_prefix("pub ")
                .map(|rest| rest.trim_start_matches("const "));
            if let (Some(name), Some(doc)) = (
                signature.and_then(|text| text.strip_prefix("fn ")),
                &first_line,
            ) {
                found.push((identifier(name), doc.clone()));
            }
            first_line = None;
        }
    }
    found
}

#[test]
fn docs_of_numeric_functions_start_with_a_verb() {
    let mut missing = Vec::new();
    for file in source_files() {
        if file.is_test
            || !NUMERIC_MODULES
                .iter()
                .any(|module| file.name.contains(module))
        {
            continue;
        }
        for (name, doc) in documented_functions(&file.text) {
            let first: String = doc.chars().take_while(|c| !c.is_whitespace()).collect();
            if !first.ends_with('s') || !first.starts_with(char::is_uppercase) {
                missing.push(format!("{}: {name}: {doc}", file.name));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "{} functions:\n{}",
        missing.len(),
        missing.join("\n")
    );
}

#[test]
fn docs_use_plain_terms() {
    let mut found = Vec::new();
    for file in source_files() {
        for (number, line) in file.text.lines().enumerate() {
            let doc = line.trim_start();
            if !doc.starts_with("///") && !doc.starts_with("//!") {
                continue;
            }
            for phrase in BANNED_PHRASES {
                if format!("{doc} ").contains(phrase) {
                    found.push(format!("{}:{}:{phrase}: {doc}", file.name, number + 1));
                }
            }
        }
    }
    assert!(
        found.is_empty(),
        "{} occurrences:\n{}",
        found.len(),
        found.join("\n")
    );
}

#[test]
fn the_container_image_is_built_with_every_included_folder() {
    let ignored = package_dir().join("deploy/Dockerfile.dockerignore");
    let ignored = std::fs::read_to_string(ignored).expect("a list");
    let mut folders = BTreeSet::new();
    for file in source_files() {
        let included = file.text.split("\"../").skip(1);
        let path = included.map(|text| text.trim_start_matches("../"));
        folders.extend(path.filter_map(|path| Some(path.split_once('/')?.0.to_owned())));
    }
    let known = ["assets", "config", "docs", "migrations"];
    assert!(
        known.iter().all(|folder| folders.contains(*folder)),
        "{folders:?}"
    );
    // Only unit tests include files of `tests`.
    let is_needed = |folder: &&String| package_dir().join(folder).is_dir() && *folder != "tests";
    for folder in folders.iter().filter(is_needed) {
        let is_copied = ignored.lines().any(|line| line == format!("!{folder}"));
        assert!(is_copied, "{folder} is not copied into the image");
    }
}

/// Returns whether documentation has an example that would run.
fn has_example(text: &str) -> bool {
    let lines = text.lines().map(str::trim_start);
    let docs = lines.filter_map(|line| line.strip_prefix("///").or(line.strip_prefix("//!")));
    let fences = docs.map(str::trim).filter(|line| line.starts_with("```"));
    // Every second fence ends a block.
    fences
        .step_by(2)
        .any(|fence| matches!(fence, "```" | "```rust"))
}

#[test]
fn crates_whose_examples_do_not_run_have_none() {
    let mut checked = 0;
    for (name, src) in crates() {
        let manifest = src.with_file_name("Cargo.toml");
        let manifest = std::fs::read_to_string(manifest).expect("a manifest");
        if !manifest.lines().any(|line| line == "doctest = false") {
            continue;
        }
        checked += 1;
        for path in rust_files(&src) {
            let text = std::fs::read_to_string(&path).expect("readable source");
            assert!(!has_example(&text), "{name}: {}", path.display());
        }
    }
    assert!(checked > 0 && has_example("/// ```text\n/// a\n/// ```\n/// ```\n"));
}
