//! The imports among the files of a crate, as their text names them.

use std::collections::{BTreeMap, BTreeSet};

use crate::source_text::{SourceFile, paths_after, source_files};

/// The import graph of the files of a crate.
pub(crate) struct ImportGraph {
    pub(crate) files: Vec<SourceFile>,
    by_module: BTreeMap<Vec<String>, usize>,
    /// Names that a module re-exports, with the paths that they stand for.
    re_exports: BTreeMap<(Vec<String>, String), Vec<String>>,
}

impl ImportGraph {
    /// Returns the graph of each crate.
    pub(crate) fn of_all_crates() -> Vec<Self> {
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
        found.extend(below(&module, paths_after(code, "self::")));
        let mut prefix = String::from("super::");
        for depth in (0..module.len()).rev() {
            let paths = below(&module[..depth], paths_after(code, &prefix));
            let is_higher = |path: &Vec<String>| path.iter().any(|name| name == "super");
            found.extend(paths.into_iter().filter(|path| !is_higher(path)));
            prefix.push_str("super::");
        }
        for child in self.children(index) {
            let base = [module.clone(), vec![child.clone()]].concat();
            found.extend(below(&base, paths_after(code, &format!("{child}::"))));
        }
        let modules: BTreeSet<_> = found
            .iter()
            .filter_map(|path| self.as_module(path))
            .collect();
        for imported in modules {
            let name = imported.last().map_or("", String::as_str);
            found.extend(below(&imported, paths_after(code, &format!("{name}::"))));
        }
        found
    }

    /// Returns the module that a path names, unless it is that of the crate or the path names an item.
    fn as_module(&self, path: &[String]) -> Option<Vec<String>> {
        let path = match path {
            [module @ .., name] if name == "self" => module,
            path => path,
        };
        let is_module = !path.is_empty() && self.by_module.contains_key(path);
        is_module.then(|| path.to_vec())
    }

    /// Returns the file that defines what a path names. What no other module has is in `lib.rs`.
    fn file_of(&self, path: &[String]) -> Option<usize> {
        for length in (0..=path.len()).rev() {
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
    pub(crate) fn cycles(&self) -> Vec<BTreeSet<String>> {
        let imports: Vec<BTreeSet<usize>> = (0..self.files.len())
            .map(|index| self.imports(index))
            .collect();
        let name = |index: usize| self.files[index].name.clone();
        cycles(&imports, name)
    }

    /// Returns the groups of folders that import each other, a folder with its own folders as one. A file beside the
    /// folders counts as one, except `mod.rs` and `lib.rs`, which may import from all of them.
    pub(crate) fn folder_cycles(&self, parent: &[String]) -> Vec<BTreeSet<String>> {
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

/// Returns the graph of a crate whose files have these paths and texts.
fn graph_of(files: &[(&str, &str)]) -> ImportGraph {
    let files = files.iter();
    ImportGraph::new(
        files
            .map(|(path, text)| SourceFile::of_text(path, text))
            .collect(),
    )
}

#[test]
fn every_kind_of_import_is_found() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("a.rs", "use crate::b::c::One;", &["b/c.rs"]),
        (
            "a.rs",
            "use crate::b::{c::One, d::e};",
            &["b/c.rs", "b/d/e.rs"],
        ),
        ("a.rs", "fn f() { crate::b::c::run(); }", &["b/c.rs"]),
        ("a.rs", "use crate::LIMIT;", &["lib.rs"]),
        // Names that another module re-exports.
        ("b/c.rs", "use crate::Handle;", &["a.rs"]),
        (
            "b/c.rs",
            "use crate::{Handle, Item};",
            &["a.rs", "b/d/e.rs"],
        ),
        ("b/c.rs", "use super::d::Item;", &["b/d/e.rs"]),
        ("b/mod.rs", "use c::One;", &["b/c.rs"]),
        ("b/mod.rs", "use self::c::One;", &["b/c.rs"]),
        ("b/mod.rs", "fn f() { c::run(); }", &["b/c.rs"]),
        ("b/c.rs", "use super::Shared;", &["b/mod.rs"]),
        ("b/d/e.rs", "use super::super::c::One;", &["b/c.rs"]),
        // Through a module that is imported itself.
        (
            "a.rs",
            "use crate::b;\nfn f() { b::c::run(); }",
            &["b/c.rs", "b/mod.rs"],
        ),
        (
            "a.rs",
            "use crate::b::d::{self};\nfn f() { d::e::run(); }",
            &["b/d/e.rs", "b/d/mod.rs"],
        ),
        // No imports.
        ("a.rs", "\npub use crate::b::c::One;", &[]),
        ("a.rs", "pub(in crate::b) fn f() {}", &[]),
        ("a.rs", "// crate::b::c::One", &[]),
    ];
    for (changed, code, expected) in cases {
        let files = [
            (
                "lib.rs",
                "mod a;\nmod b;\n\npub use a::Handle;\npub use b::d::Item;\nconst LIMIT: u8 = 1;",
            ),
            ("a.rs", ""),
            ("b/mod.rs", ""),
            ("b/c.rs", ""),
            ("b/d/mod.rs", "mod e;\n\npub(crate) use self::e::Item;"),
            ("b/d/e.rs", ""),
        ];
        let files = files.map(|(path, text)| (path, if path == *changed { *code } else { text }));
        let graph = graph_of(&files);
        let index = files
            .iter()
            .position(|(path, _)| path == changed)
            .expect("a file");
        let imports = graph.imports(index).into_iter();
        let mut found: Vec<&str> = imports.map(|index| files[index].0).collect();
        found.sort_unstable();
        assert_eq!(found, *expected, "{changed}: {code}");
    }
}

#[test]
fn cycles_over_names_of_the_crate_and_of_a_folder_are_found() {
    let graph = graph_of(&[
        (
            "lib.rs",
            "mod handle;\nmod queue;\n\npub use handle::Handle;",
        ),
        ("handle.rs", "use crate::queue::writer::run;"),
        ("queue/mod.rs", ""),
        ("queue/requests.rs", "use crate::Handle;"),
        ("queue/writer.rs", ""),
    ]);
    assert!(graph.cycles().is_empty());
    let group = |names: [&str; 2]| BTreeSet::from(names.map(str::to_owned));
    assert_eq!(graph.folder_cycles(&[]), [group(["handle", "queue"])]);
    let graph = graph_of(&[
        ("lib.rs", "mod copy;"),
        (
            "copy/mod.rs",
            "mod rows;\nuse self::rows::read;\nstruct Table;",
        ),
        ("copy/rows.rs", "use super::Table;"),
    ]);
    assert_eq!(graph.cycles(), [group(["copy/mod.rs", "copy/rows.rs"])]);
}
