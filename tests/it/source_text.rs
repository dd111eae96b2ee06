//! Reads the source files of all crates for the tests that check their structure.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A source file below `src` or `crates/*/src`.
pub(crate) struct SourceFile {
    /// Path relative to the folder of the repository, with forward slashes.
    pub(crate) name: String,
    /// Folder of the crate below `crates`; `mocban` for the root.
    pub(crate) crate_name: String,
    /// Path relative to the `src` of the crate, with forward slashes.
    path: String,
    /// The whole text.
    pub(crate) text: String,
    /// Whether the file is compiled for tests only.
    pub(crate) is_test: bool,
}

impl SourceFile {
    /// Returns a file with this path below the `src` of a crate, to test a check.
    pub(crate) fn of_text(path: &str, text: &str) -> Self {
        Self {
            name: path.to_owned(),
            crate_name: "sample".to_owned(),
            path: path.to_owned(),
            text: text.to_owned(),
            is_test: false,
        }
    }

    /// Returns the code without comments and unit tests. Returns an empty text if the file contains only tests.
    pub(crate) fn production_code(&self) -> String {
        if self.is_test {
            return String::new();
        }
        without_comments(&self.text[..test_module_start(&self.text)])
    }

    /// Returns the module's path from the crate root. The path of `lib.rs` and `main.rs` is empty.
    pub(crate) fn module(&self) -> Vec<String> {
        let name = self.path.trim_end_matches(".rs");
        let mut parts: Vec<String> = name.split('/').map(str::to_owned).collect();
        if matches!(
            parts.last().map(String::as_str),
            Some("mod" | "lib" | "main")
        ) {
            parts.pop();
        }
        parts
    }
}

/// Returns the directory of the package.
pub(crate) fn package_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Lists all Rust files below a directory.
pub(crate) fn rust_files(dir: &Path) -> Vec<PathBuf> {
    files_with_extension(dir, "rs")
}

/// Lists all files with an extension below a directory.
pub(crate) fn files_with_extension(dir: &Path, wanted: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut dirs = vec![dir.to_owned()];
    while let Some(dir) = dirs.pop() {
        for entry in std::fs::read_dir(dir).expect("a readable directory") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                dirs.push(path);
            } else if path
                .extension()
                .is_some_and(|extension| extension == wanted)
            {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// Returns the names of all crates, each with its `src`.
pub(crate) fn crates() -> Vec<(String, PathBuf)> {
    let mut found = vec![("mocban".to_owned(), package_dir().join("src"))];
    for entry in std::fs::read_dir(package_dir().join("crates")).expect("a readable directory") {
        let dir = entry.expect("a readable entry").path();
        let name = dir.file_name().expect("a name").to_string_lossy();
        found.push((name.into_owned(), dir.join("src")));
    }
    found.sort();
    found
}

/// Reads the source files of all crates.
pub(crate) fn source_files() -> Vec<SourceFile> {
    let read = |(name, src): &(String, PathBuf)| crate_files(name, src);
    crates().iter().flat_map(read).collect()
}

/// Reads the source files of a crate.
fn crate_files(crate_name: &str, src: &Path) -> Vec<SourceFile> {
    let texts: Vec<(String, String)> = rust_files(src)
        .into_iter()
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("readable source");
            (slashed(&path, src), text)
        })
        .collect();
    let test_modules: BTreeSet<String> = texts
        .iter()
        .flat_map(|(path, text)| test_modules(path, text))
        .collect();
    texts
        .into_iter()
        .map(|(path, text)| {
            let stem = path.trim_end_matches(".rs");
            let is_below = |module: &String| {
                let rest = stem.strip_prefix(module.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            };
            SourceFile {
                name: slashed(&src.join(&path), &package_dir()),
                crate_name: crate_name.to_owned(),
                is_test: test_modules.iter().any(is_below),
                path,
                text,
            }
        })
        .collect()
}

/// Returns a path relative to a folder, with forward slashes.
pub(crate) fn slashed(path: &Path, folder: &Path) -> String {
    let path = path.strip_prefix(folder).expect("a path below the folder");
    path.to_string_lossy().replace('\\', "/")
}

/// Returns the modules declared as `mod NAME;` for tests only, as file paths below `src` without an extension.
fn test_modules(name: &str, text: &str) -> Vec<String> {
    let stem = name.trim_end_matches(".rs");
    let dir = ["/mod", "lib", "main"]
        .iter()
        .find_map(|suffix| stem.strip_suffix(suffix))
        .unwrap_or(stem);
    let marks = ["#[cfg(test)]\n", FOR_TESTS];
    let after_marks = marks.iter().flat_map(|mark| text.split(mark).skip(1));
    after_marks
        .filter_map(|after| {
            let module = after
                .lines()
                .next()?
                .strip_suffix(';')?
                .rsplit(' ')
                .next()?;
            Some(format!("{dir}/{module}").trim_start_matches('/').to_owned())
        })
        .collect()
}

/// The mark of modules that tests of other crates use.
const FOR_TESTS: &str = "#[cfg(any(test, feature = \"test-helpers\"))]\n";

/// Returns the offset of the inline test module. Returns the length of the text if there is none.
fn test_module_start(text: &str) -> usize {
    let found = text
        .match_indices("#[cfg(test)]\n")
        .find(|(at, attribute)| {
            let line = text[at + attribute.len()..]
                .lines()
                .next()
                .unwrap_or_default();
            line.contains("mod ") && line.ends_with('{')
        });
    found.map_or(text.len(), |(at, _)| at)
}

fn without_comments(text: &str) -> String {
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    text.lines().filter(is_code).collect::<Vec<_>>().join("\n")
}

/// Returns what stands between backticks in a text.
pub(crate) fn code_spans(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Returns the leading identifier of a text.
pub(crate) fn identifier(text: &str) -> String {
    let is_part = |c: &char| c.is_alphanumeric() || *c == '_';
    text.chars().take_while(is_part).collect()
}

/// Returns every path that follows `prefix` and expands groups in braces: `crate::{a::B, c}` gives `a::B` and `c`.
pub(crate) fn paths_after(code: &str, prefix: &str) -> Vec<Vec<String>> {
    code.match_indices(prefix)
        .filter(|(at, _)| {
            let before = code[..*at].chars().next_back();
            !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
        })
        .flat_map(|(at, _)| expand_paths(&code[at + prefix.len()..]))
        .collect()
}

/// Expands the path or the group of paths at the start of a text.
fn expand_paths(text: &str) -> Vec<Vec<String>> {
    let text = text.trim_start();
    if let Some(group) = text.strip_prefix('{') {
        return group_members(group)
            .iter()
            .flat_map(|member| expand_paths(member))
            .collect();
    }
    let name = identifier(text);
    if name.is_empty() {
        return vec![Vec::new()];
    }
    let Some(rest) = text[name.len()..].strip_prefix("::") else {
        return vec![vec![name]];
    };
    expand_paths(rest)
        .into_iter()
        .map(|tail| [vec![name.clone()], tail].concat())
        .collect()
}

/// Splits the inside of a brace group, up to the closing brace, at commas that are not in inner groups.
fn group_members(text: &str) -> Vec<String> {
    let mut depth = 0;
    let mut members = vec![String::new()];
    for c in text.chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => {
                members.push(String::new());
                continue;
            }
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        members.last_mut().expect("at least one member").push(c);
    }
    members.retain(|member| !member.trim().is_empty());
    members
}

#[test]
fn paths_are_found_after_a_prefix_and_in_groups() {
    let code = "use crate::{domain::{Stage, PairName}, mesh};\nlet x = crate::raster::Grid; mycrate::no();";
    let found: Vec<String> = paths_after(code, "crate::")
        .iter()
        .map(|path| path.join("::"))
        .collect();
    assert_eq!(
        found,
        ["domain::Stage", "domain::PairName", "mesh", "raster::Grid"]
    );
}
