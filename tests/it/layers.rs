//! Checks that top-level modules import only what the table in `src/lib.rs` allows, and that no imports form cycles.

use std::collections::{BTreeMap, BTreeSet};

use crate::source_text::{SourceFile, identifier, package_dir, paths_after, source_files};

/// Crates that only these modules may name.
const ONLY_IN: &[(&str, &[&str])] = &[
    ("sqlx", &["catalog"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("pulldown_cmark", &["documentation"]),
    ("indicatif", &["cli"]),
    ("anyhow", &["cli"]),
    ("toml", &["cli", "config"]),
    ("pulp", &["simd"]),
    ("quick_xml", &["labels"]),
    (
        "nalgebra",
        &["block", "stages", "demo", "mesh", "raster", "report"],
    ),
];

/// Modules without files, processes, clocks and async code.
const PURE_MODULES: &[&str] = &["domain", "raster", "mesh", "stages"];
const IMPURE: &[&str] = &[
    "tokio::",
    "std::fs",
    "std::process",
    "std::env",
    "SystemTime",
    "Instant::now",
];

/// Imports that only the unit tests of a module may use, beyond the table.
const TEST_IMPORTS: &[(&str, &[&str])] = &[];

/// Files that may take part in import cycles. Remove a file when its cycle is broken; add none.
const CYCLIC_FILES: &[&str] = &[];

/// Returns the files that belong to modules.
fn module_files() -> Vec<SourceFile> {
    let mut files = source_files();
    files.retain(|file| file.module != "main" && file.module != "lib");
    files
}

/// Returns the table of top-level modules in `src/lib.rs`: each module with the modules that it may import.
fn table() -> BTreeMap<String, BTreeSet<String>> {
    let lib = std::fs::read_to_string(package_dir().join("src/lib.rs")).expect("readable source");
    let modules: Vec<(String, String)> = lib
        .lines()
        .filter_map(|line| line.strip_prefix("//! | `"))
        .map(|line| {
            let cells: Vec<&str> = line.split('|').collect();
            (identifier(line), cells[2].trim().to_owned())
        })
        .collect();
    let all: BTreeSet<String> = modules.iter().map(|(module, _)| module.clone()).collect();
    modules
        .into_iter()
        .map(|(module, cell)| {
            let named = cell.split(',').map(|name| name.trim().replace('`', ""));
            let allowed = match cell.as_str() {
                "all" => all.clone(),
                _ => named.filter(|name| !name.is_empty()).collect(),
            };
            (module, allowed)
        })
        .collect()
}

/// Returns the first names of the paths after a prefix.
fn names_after(code: &str, prefix: &str) -> BTreeSet<String> {
    let paths = paths_after(code, prefix).into_iter();
    paths.filter_map(|path| path.into_iter().next()).collect()
}

/// Returns the modules that a part of the code of a file names.
fn imported_modules(file: &SourceFile, code: &str) -> BTreeSet<String> {
    let mut used = names_after(code, "crate::");
    if file.module().len() == 1 {
        used.extend(names_after(code, "super::"));
    }
    used
}

#[test]
fn every_module_is_in_the_code_map() {
    let modules: BTreeSet<String> = module_files().into_iter().map(|file| file.module).collect();
    let mapped: BTreeSet<String> = table().into_keys().collect();
    assert_eq!(modules, mapped);
}

#[test]
fn modules_import_only_what_the_table_allows() {
    let table = table();
    let mut wrong = Vec::new();
    for file in module_files() {
        for name in imported_modules(&file, &file.production_code()) {
            let is_foreign = table.contains_key(&name) && name != file.module;
            if is_foreign && !table[&file.module].contains(&name) {
                wrong.push(format!(
                    "{}: {} may not import {name}",
                    file.name, file.module
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn unit_tests_import_only_what_the_table_and_its_exceptions_allow() {
    let table = table();
    let exceptions: BTreeMap<&str, &[&str]> = TEST_IMPORTS.iter().copied().collect();
    let mut wrong = BTreeSet::new();
    let mut unused: BTreeSet<(String, String)> = TEST_IMPORTS
        .iter()
        .flat_map(|(module, names)| {
            names
                .iter()
                .map(|name| ((*module).to_owned(), (*name).to_owned()))
        })
        .collect();
    for file in module_files() {
        let extra = exceptions
            .get(file.module.as_str())
            .copied()
            .unwrap_or_default();
        for name in imported_modules(&file, &file.test_code()) {
            let is_foreign = table.contains_key(&name) && name != file.module;
            if !is_foreign || table[&file.module].contains(&name) {
                continue;
            }
            unused.remove(&(file.module.clone(), name.clone()));
            if !extra.contains(&name.as_str()) {
                wrong.insert(format!(
                    "{}: tests of {} may not import {name}",
                    file.name, file.module
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(unused.is_empty(), "no longer needed: {unused:?}");
}

#[test]
fn crates_stay_in_their_modules() {
    let mut wrong = Vec::new();
    for file in module_files() {
        let code = file.production_code();
        for (name, modules) in ONLY_IN {
            let is_named = !names_after(&code, &format!("{name}::")).is_empty();
            if is_named && !modules.contains(&file.module.as_str()) {
                wrong.push(format!("{}: {} may not use {name}", file.name, file.module));
            }
        }
        for name in IMPURE {
            if PURE_MODULES.contains(&file.module.as_str()) && code.contains(name) {
                wrong.push(format!("{}: {} may not use {name}", file.name, file.module));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_progress_and_screen_draw() {
    for file in module_files() {
        let draws = !names_after(&file.production_code(), "indicatif::").is_empty();
        assert!(
            !draws
                || ["cli/busy.rs", "cli/progress.rs", "cli/screen.rs"]
                    .contains(&file.name.as_str()),
            "{}",
            file.name
        );
    }
}

/// The import graph of the crate's files.
struct ImportGraph {
    files: Vec<SourceFile>,
    by_module: BTreeMap<Vec<String>, usize>,
    /// Names that a module re-exports, with the paths that they stand for.
    re_exports: BTreeMap<(Vec<String>, String), Vec<String>>,
}

impl ImportGraph {
    fn new() -> Self {
        let mut files = source_files();
        files.retain(|file| !file.is_test && file.name != "main.rs");
        let by_module = files
            .iter()
            .enumerate()
            .map(|(index, file)| (file.module(), index))
            .collect();
        let mut graph = Self {
            files,
            by_module,
            re_exports: BTreeMap::new(),
        };
        for index in 0..graph.files.len() {
            let module = graph.files[index].module();
            for path in graph.re_exported_paths(index) {
                if let Some(name) = path.last() {
                    graph
                        .re_exports
                        .insert((module.clone(), name.clone()), path);
                }
            }
        }
        graph
    }

    /// Returns the modules that a file declares.
    fn children(&self, index: usize) -> Vec<String> {
        let module = self.files[index].module();
        let is_child =
            |other: &&Vec<String>| other.len() == module.len() + 1 && other.starts_with(&module);
        self.by_module
            .keys()
            .filter(is_child)
            .filter_map(|child| child.last().cloned())
            .collect()
    }

    /// Returns the absolute paths in `pub use` declarations.
    fn re_exported_paths(&self, index: usize) -> Vec<Vec<String>> {
        let code = self.files[index].production_code();
        let declarations = code.split("\npub").skip(1).filter_map(|text| {
            let text = text
                .strip_prefix("(crate)")
                .or_else(|| text.strip_prefix("(super)"))
                .unwrap_or(text);
            let declaration = text.strip_prefix(" use ")?;
            Some(format!("use {};", declaration.split(';').next()?))
        });
        declarations
            .flat_map(|declaration| self.absolute_paths(index, &declaration))
            .collect()
    }

    /// Returns the paths that a piece of a file's code uses, as paths from the crate root.
    fn absolute_paths(&self, index: usize, code: &str) -> Vec<Vec<String>> {
        let module = self.files[index].module();
        let below = |base: &[String], paths: Vec<Vec<String>>| {
            let join = |path| [base.to_vec(), path].concat();
            paths.into_iter().map(join).collect::<Vec<_>>()
        };
        let mut found = below(&[], paths_after(code, "crate::"));
        let mut prefix = String::from("super::");
        for depth in (0..module.len()).rev() {
            let paths = paths_after(code, &prefix);
            found.extend(
                below(&module[..depth], paths)
                    .into_iter()
                    .filter(|path| path.last().is_none_or(|name| name != "super")),
            );
            prefix.push_str("super::");
        }
        for child in self.children(index) {
            let base = [module.clone(), vec![child.clone()]].concat();
            found.extend(below(&base, paths_after(code, &format!("{child}::"))));
        }
        found
    }

    /// Returns the file that defines what a path names.
    fn file_of(&self, path: &[String]) -> Option<usize> {
        for length in (1..=path.len()).rev() {
            let (module, rest) = path.split_at(length);
            let Some(index) = self.by_module.get(module) else {
                continue;
            };
            let target = rest
                .first()
                .and_then(|name| self.re_exports.get(&(module.to_vec(), name.clone())));
            return match target {
                Some(target) if target != path => self.file_of(target).or(Some(*index)),
                Some(_) | None => Some(*index),
            };
        }
        None
    }

    /// Returns the files that a file imports from. A re-export is no import, because it does not use the item.
    fn imports(&self, index: usize) -> BTreeSet<usize> {
        let code = without_visibility_paths(&self.files[index].production_code());
        let mut used = String::new();
        for (at, text) in code.split("\npub").enumerate() {
            let visible = text
                .strip_prefix("(crate)")
                .or_else(|| text.strip_prefix("(super)"))
                .unwrap_or(text);
            let body = if at > 0 && visible.starts_with(" use ") {
                visible.split_once(';').map_or("", |(_, rest)| rest)
            } else {
                text
            };
            used.push_str(body);
            used.push('\n');
        }
        let paths = self.absolute_paths(index, &used);
        let files = paths.iter().filter_map(|path| self.file_of(path));
        files.filter(|file| *file != index).collect()
    }

    /// Returns the groups of files that import each other.
    fn cycles(&self) -> Vec<BTreeSet<String>> {
        let imports: Vec<BTreeSet<usize>> = (0..self.files.len())
            .map(|index| self.imports(index))
            .collect();
        let reached: Vec<BTreeSet<usize>> = (0..imports.len())
            .map(|start| reachable(&imports, start))
            .collect();
        let mut groups = BTreeSet::new();
        for (index, from_here) in reached.iter().enumerate() {
            if from_here.contains(&index) {
                let group = from_here
                    .iter()
                    .filter(|other| reached[**other].contains(&index));
                groups.insert(
                    group
                        .map(|other| self.files[*other].name.clone())
                        .collect::<BTreeSet<_>>(),
                );
            }
        }
        groups.into_iter().collect()
    }
}

/// Replaces `pub(in path)` by `pub(crate)`, because the path of a visibility is not an import.
fn without_visibility_paths(code: &str) -> String {
    let mut parts = code.split("pub(in ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push_str("pub(crate");
        text.push_str(part.find(')').map_or("", |end| &part[end..]));
    }
    text
}

/// Returns the nodes reachable from a node over at least one edge.
fn reachable(edges: &[BTreeSet<usize>], start: usize) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut open: Vec<usize> = edges[start].iter().copied().collect();
    while let Some(node) = open.pop() {
        if found.insert(node) {
            open.extend(&edges[node]);
        }
    }
    found
}

#[test]
fn files_do_not_import_each_other_in_cycles() {
    let is_known = |name: &String| CYCLIC_FILES.iter().any(|known| name.starts_with(known));
    let mut cycles = ImportGraph::new().cycles();
    cycles.retain(|cycle| !cycle.iter().all(is_known));
    assert!(cycles.is_empty(), "import cycles: {cycles:#?}");
}

/// Largest number of files in the walkthrough of one pair in `src/lib.rs`, and of their lines without unit tests.
const MAX_WALK_FILES: usize = 18;
const MAX_WALK_LINES: usize = 4500;

/// Returns the files at the start of list items below a heading in `src/lib.rs`. Paths are relative to `src`.
fn listed_files(heading: &str) -> Vec<String> {
    let lib = std::fs::read_to_string(package_dir().join("src/lib.rs")).expect("readable source");
    let heading = format!("//! ## {heading}");
    let section = lib.lines().skip_while(|line| **line != heading).skip(1);
    section
        .take_while(|line| !line.starts_with("//! ## "))
        .filter_map(|line| {
            let (mark, file) = line.strip_prefix("//! ")?.split_once("`src/")?;
            let number = mark
                .strip_suffix(". ")
                .and_then(|number| number.parse::<u8>().ok());
            let is_item = mark == "- " || number.is_some();
            is_item.then(|| file.split('`').next().unwrap_or_default().to_owned())
        })
        .collect()
}

#[test]
fn the_way_of_one_pair_is_listed_and_short() {
    let files = source_files();
    let listed = listed_files("One pair, from manifest row to report cell");
    let lines: usize = listed
        .iter()
        .map(|name| {
            let file = files.iter().find(|file| file.name == *name);
            file.unwrap_or_else(|| panic!("src/{name} does not exist"))
                .production_lines()
        })
        .sum();
    assert!(
        (1..=MAX_WALK_FILES).contains(&listed.len()),
        "{} files",
        listed.len()
    );
    assert!(lines <= MAX_WALK_LINES, "{lines} lines");
}

#[test]
fn files_that_name_a_threshold_metric_are_listed() {
    let variants =
        ["NlSsim", "Density", "Ensemble", "Relief"].map(|name| format!("ThresholdMetric::{name}"));
    let names_metric = |file: &&SourceFile| {
        let code = file.production_code();
        let imports_variants = code.contains("ThresholdMetric::{");
        variants.iter().any(|variant| code.contains(variant))
            || imports_variants
            || code.contains("enum ThresholdMetric")
    };
    let files = source_files();
    let found: BTreeSet<String> = files
        .iter()
        .filter(names_metric)
        .map(|file| file.name.clone())
        .collect();
    let listed: BTreeSet<String> = listed_files("A new threshold metric").into_iter().collect();
    assert_eq!(found, listed);
}
