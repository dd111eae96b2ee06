//! Checks the dependencies of the crates, and that neither files nor folders import each other in cycles.

use std::collections::BTreeSet;
use std::path::Path;

use crate::import_graph::ImportGraph;
use crate::source_text::{SourceFile, code_spans, package_dir, paths_after, source_files};

/// Dependencies that only these crates may have.
const ONLY_IN: &[(&str, &[&str])] = &[
    ("anyhow", &[]),
    ("axum", &["mocban", "pages"]),
    ("clap", &["mocban"]),
    ("fax", &["core"]),
    ("flate2", &["core", "lists"]),
    ("hyper", &["pages"]),
    ("hyper-util", &["pages"]),
    ("indicatif", &["mocban"]),
    ("pulldown-cmark", &["mocban"]),
    ("toml", &["mocban", "config"]),
    ("tracing-subscriber", &["mocban"]),
    ("moxcms", &["core"]),
    ("numpy", &["python"]),
    ("object_store", &["store"]),
    ("pulp", &["core"]),
    ("pyo3", &["python"]),
    ("quick-xml", &["lists"]),
    ("rustfft", &["fft"]),
    ("sqlx", &["catalog"]),
    ("tiff", &["export"]),
    ("weezl", &["core"]),
    ("zune-jpeg", &["core"]),
];

/// Crates without files, processes, clocks and async code.
const PURE_CRATES: &[&str] = &["core", "fft", "lists", "align"];
const IMPURE: &[&str] = &[
    "tokio::",
    "std::fs",
    "std::process",
    "std::env",
    "SystemTime",
    "Instant::now",
];

/// Returns the dependencies of a crate outside tests, from its `Cargo.toml`.
fn dependencies(crate_name: &str) -> BTreeSet<String> {
    let dir = match crate_name {
        "mocban" => package_dir(),
        _ => package_dir().join("crates").join(crate_name),
    };
    let manifest = std::fs::read_to_string(dir.join("Cargo.toml")).expect("a manifest");
    let manifest: toml::Table = manifest.parse().expect("a manifest in TOML");
    let names = |table: &toml::Table| {
        let section = table.get("dependencies").and_then(toml::Value::as_table);
        section.map(|section| section.keys().cloned().collect::<Vec<_>>())
    };
    let mut found: BTreeSet<String> = names(&manifest).unwrap_or_default().into_iter().collect();
    if let Some(targets) = manifest.get("target").and_then(toml::Value::as_table) {
        let tables = targets.values().filter_map(toml::Value::as_table);
        found.extend(tables.filter_map(names).flatten());
    }
    found
}

#[test]
fn dependencies_stay_in_their_crates() {
    let crates: BTreeSet<String> = source_files().into_iter().map(|f| f.crate_name).collect();
    let mut wrong = Vec::new();
    for name in &crates {
        let has = dependencies(name);
        for (dependency, allowed) in ONLY_IN {
            if has.contains(*dependency) && !allowed.contains(&name.as_str()) {
                wrong.push(format!("{name} may not depend on {dependency}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn pure_crates_use_neither_files_nor_clocks() {
    let mut wrong = Vec::new();
    for file in source_files() {
        let code = file.production_code();
        for name in IMPURE {
            if PURE_CRATES.contains(&file.crate_name.as_str()) && code.contains(name) {
                wrong.push(format!("{} may not use {name}", file.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_progress_and_screen_draw() {
    for file in source_files() {
        let draws = !paths_after(&file.production_code(), "indicatif::").is_empty();
        assert!(
            !draws
                || [
                    "src/cli/output/busy.rs",
                    "src/cli/output/progress.rs",
                    "src/cli/output/screen.rs"
                ]
                .contains(&file.name.as_str()),
            "{}",
            file.name
        );
    }
}

#[test]
fn files_do_not_import_each_other_in_cycles() {
    let graphs = ImportGraph::of_all_crates();
    let cycles: Vec<_> = graphs.iter().flat_map(ImportGraph::cycles).collect();
    assert!(cycles.is_empty(), "import cycles: {cycles:#?}");
}

#[test]
fn folders_do_not_import_each_other_in_cycles() {
    let mut found = Vec::new();
    for graph in ImportGraph::of_all_crates() {
        let parents: BTreeSet<Vec<String>> = (graph.files.iter())
            .map(SourceFile::module)
            .flat_map(|module| (0..module.len()).map(move |length| module[..length].to_vec()))
            .collect();
        for parent in parents {
            let name = format!("{}:{}", graph.files[0].crate_name, parent.join("/"));
            let cycles = graph.folder_cycles(&parent);
            found.extend(cycles.into_iter().map(|cycle| (name.clone(), cycle)));
        }
    }
    assert!(found.is_empty(), "import cycles: {found:#?}");
}

/// Most words of the entrance to the code, and most lines of the page of a crate.
const MAX_ENTRANCE_WORDS: usize = 1500;
const MAX_PAGE_LINES: usize = 60;

#[test]
fn files_named_in_the_entrance_exist() {
    let mut missing = Vec::new();
    for page in ["docs/architecture.md", "CONTRIBUTING.md"] {
        let text = std::fs::read_to_string(package_dir().join(page)).expect("a page");
        let words = text.split_whitespace().count();
        assert!(
            page == "CONTRIBUTING.md" || words <= MAX_ENTRANCE_WORDS,
            "{words} words"
        );
        for name in code_spans(&text) {
            let is_path = ["crates/", "src/", "tests/", "docs/"]
                .iter()
                .any(|top| name.starts_with(top));
            let is_pattern = name.contains(['*', '{', ' ']);
            if is_path && !is_pattern && !package_dir().join(name).exists() {
                missing.push(format!("{page}: {name}"));
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

#[test]
fn each_crate_begins_with_a_short_page_that_names_its_files_and_its_invariant() {
    let files = source_files();
    let pages = files
        .iter()
        .filter(|file| file.name.ends_with("src/lib.rs"));
    for file in pages.filter(|file| file.crate_name != "mocban") {
        let page: Vec<&str> = file
            .text
            .lines()
            .take_while(|line| line.starts_with("//!"))
            .collect();
        assert!(
            page.len() <= MAX_PAGE_LINES,
            "{}: {} lines",
            file.name,
            page.len()
        );
        let page = page.join("\n");
        assert!(page.contains("**Invariant:**"), "{}", file.name);
        for name in code_spans(&page)
            .into_iter()
            .filter(|name| Path::new(name).extension().is_some_and(|end| end == "rs"))
        {
            let exists = files.iter().any(|other| {
                // A name with its folder may be that of another crate.
                let may_be_meant = other.crate_name == file.crate_name || name.contains('/');
                other.name == name || may_be_meant && other.name.ends_with(&format!("/{name}"))
            });
            assert!(exists, "{}: {name} does not exist", file.name);
        }
    }
}
