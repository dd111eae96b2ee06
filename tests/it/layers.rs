//! Checks the dependencies of the crates, and that neither files nor folders import each other in cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::source_text::{SourceFile, package_dir, paths_after, source_files};

/// Dependencies that only these crates may have.
const ONLY_IN: &[(&str, &[&str])] = &[
    ("anyhow", &[]),
    ("clap", &["mocban"]),
    ("fax", &["core"]),
    ("flate2", &["core", "lists"]),
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

/// The import graph of the files of a crate.
struct ImportGraph {
    files: Vec<SourceFile>,
    by_module: BTreeMap<Vec<String>, usize>,
    /// Names that a module re-exports, with the paths that they stand for.
    re_exports: BTreeMap<(Vec<String>, String), Vec<String>>,
}

impl ImportGraph {
    /// Returns the graph of each crate.
    fn of_all_crates() -> Vec<Self> {
        let mut crates: BTreeMap<String, Vec<SourceFile>> = BTreeMap::new();
        for file in source_files() {
            if !file.is_test && file.name != "src/main.rs" {
                crates
                    .entry(file.crate_name.clone())
                    .or_default()
                    .push(file);
            }
        }
        crates.into_values().map(Self::new).collect()
    }

    fn new(files: Vec<SourceFile>) -> Self {
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
        let name = |index: usize| self.files[index].name.clone();
        cycles(&imports, name)
    }

    /// Returns the groups of folders that import each other, a folder with its own folders as one. A file beside the
    /// folders counts as one, except `mod.rs` and `lib.rs`, which may import from all of them.
    fn folder_cycles(&self, parent: &[String]) -> Vec<BTreeSet<String>> {
        let child_of = |index: usize| {
            let module = self.files[index].module();
            (module.len() > parent.len() && module.starts_with(parent))
                .then(|| module[parent.len()].clone())
        };
        let children: Vec<String> = (0..self.files.len())
            .filter_map(child_of)
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect();
        let position = |child: &String| children.binary_search(child).expect("a child");
        let mut imports = vec![BTreeSet::new(); children.len()];
        for index in 0..self.files.len() {
            let Some(from) = child_of(index).as_ref().map(position) else {
                continue;
            };
            let targets = self.imports(index).into_iter().filter_map(child_of);
            let others = targets
                .map(|child| position(&child))
                .filter(|to| *to != from);
            imports[from].extend(others);
        }
        let name = |index: usize| [parent, &[children[index].clone()]].concat().join("/");
        cycles(&imports, name)
    }
}

/// Returns the groups of nodes that reach each other.
fn cycles(imports: &[BTreeSet<usize>], name: impl Fn(usize) -> String) -> Vec<BTreeSet<String>> {
    let starts = 0..imports.len();
    let reached: Vec<BTreeSet<usize>> = starts.map(|start| reachable(imports, start)).collect();
    let mut groups = BTreeSet::new();
    for (index, from_here) in reached.iter().enumerate() {
        if from_here.contains(&index) {
            let group = from_here
                .iter()
                .filter(|other| reached[**other].contains(&index));
            groups.insert(group.map(|other| name(*other)).collect::<BTreeSet<_>>());
        }
    }
    groups.into_iter().collect()
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
    let graphs = ImportGraph::of_all_crates();
    let cycles: Vec<_> = graphs.iter().flat_map(ImportGraph::cycles).collect();
    assert!(cycles.is_empty(), "import cycles: {cycles:#?}");
}

/// Folders whose children may import each other in cycles. Remove a folder when its cycle is broken; add none.
const CYCLIC_FOLDERS: &[&str] = &[];

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
            if !CYCLIC_FOLDERS.contains(&name.as_str()) {
                let cycles = graph.folder_cycles(&parent);
                found.extend(cycles.into_iter().map(|cycle| (name.clone(), cycle)));
            }
        }
    }
    assert!(found.is_empty(), "import cycles: {found:#?}");
}

/// Most words of the entrance to the code, and most lines of the page of a crate.
const MAX_ENTRANCE_WORDS: usize = 1500;
const MAX_PAGE_LINES: usize = 60;

/// Returns the names between backticks in a text.
fn quoted_names(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

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
        for name in quoted_names(&text) {
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
        for name in quoted_names(&page)
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
