//! The manifest of an export, `export.json`, by which an earlier export is recognized.
//!
//! It lists the path of every file below the folder, with `*` in place of ids of pairs. An export replaces a folder only
//! if the folder's manifest lists all its files, and none was changed (see `checksums.rs`), so that nothing else is ever lost.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::format::ExportFormat;
use super::options::ExportOptions;
use mocban_core::domain::PairName;

/// Name of the manifest.
pub const MANIFEST: &str = "export.json";
/// Version of the manifest.
const VERSION: u32 = 1;
/// Longest manifest that is read, in bytes.
const MAX_BYTES: u64 = 16 << 20;

/// How an export was made, and its files.
#[derive(Debug, Serialize)]
pub(super) struct ExportManifest<'a> {
    mocban_export: u32,
    program: &'a str,
    formats: &'a [ExportFormat],
    options: &'a ExportOptions,
    settings: &'a Value,
    pairs: PairCounts,
    files: &'a BTreeSet<String>,
}

/// Numbers of pairs in an export.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PairCounts {
    /// Pairs with a result.
    pub done: u64,
    /// Exported pairs without a result.
    pub without_result: u64,
    /// Pairs that were left out because they were not chosen, or no result of theirs was selected.
    pub left_out: u64,
    /// Stored rows of any kind that are damaged, so that nothing of them is exported.
    #[serde(skip_serializing_if = "is_zero")]
    pub set_apart: u64,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes a reference"
)]
const fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// The part of a manifest by which its files are recognized.
#[derive(Debug, Deserialize)]
struct FileList {
    mocban_export: u32,
    files: BTreeSet<String>,
}

impl<'a> ExportManifest<'a> {
    /// Returns the manifest of an export with these files.
    pub(super) const fn new(
        program: &'a str,
        formats: &'a [ExportFormat],
        options: &'a ExportOptions,
        pairs: PairCounts,
        files: &'a BTreeSet<String>,
    ) -> Self {
        Self {
            mocban_export: VERSION,
            program,
            formats,
            options,
            settings: &options.settings,
            pairs,
            files,
        }
    }

    /// Returns the manifest as text.
    pub(super) fn text(&self) -> String {
        let text = serde_json::to_string_pretty(self);
        text.expect("a manifest holds only names, numbers and lists") + "\n"
    }
}

/// Returns a file or folder below `dir` that no export wrote, or `None` if `dir` is empty or an earlier export.
pub(super) fn foreign_entry(dir: &Path) -> io::Result<Option<PathBuf>> {
    let files = listed_files(&dir.join(MANIFEST))?.unwrap_or_default();
    let patterns: Vec<Vec<&str>> = files.iter().map(|file| file.split('/').collect()).collect();
    let mut folders = vec![(dir.to_owned(), Vec::new())];
    while let Some((folder, names)) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let entry = entry?;
            let Ok(name) = entry.file_name().into_string() else {
                return Ok(Some(entry.path()));
            };
            let mut below: Vec<String> = names.clone();
            below.push(name);
            let kind = entry.file_type()?;
            let is_known = if kind.is_dir() {
                let is_part = |pattern: &&[&str]| below.len() < pattern.len();
                patterns
                    .iter()
                    .map(Vec::as_slice)
                    .filter(is_part)
                    .any(|pattern| matches(&pattern[..below.len()], &below))
            } else {
                kind.is_file() && patterns.iter().any(|pattern| matches(pattern, &below))
            };
            if !is_known {
                return Ok(Some(entry.path()));
            }
            if kind.is_dir() {
                folders.push((entry.path(), below));
            }
        }
    }
    Ok(None)
}

/// Returns the paths that a manifest lists, or `None` if the file does not exist or is not a manifest.
fn listed_files(path: &Path) -> io::Result<Option<BTreeSet<String>>> {
    if !is_regular_file(path)? {
        return Ok(None);
    }
    let mut text = Vec::new();
    fs::File::open(path)?
        .take(MAX_BYTES)
        .read_to_end(&mut text)?;
    let list: Option<FileList> = serde_json::from_slice(&text).ok();
    Ok(list
        .filter(|list| list.mocban_export == VERSION)
        .map(|list| list.files))
}

/// Returns whether there is a regular file at a path. A link is none.
pub(super) fn is_regular_file(path: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        found => Ok(found?.is_file()),
    }
}

/// Returns whether a path has the form of a pattern, in which `*` stands for the id of a pair.
fn matches(pattern: &[&str], path: &[String]) -> bool {
    pattern.len() == path.len()
        && pattern
            .iter()
            .zip(path)
            .all(|(wanted, name)| match wanted.split_once('*') {
                None => wanted == name,
                Some((before, after)) => {
                    let id = name
                        .strip_prefix(before)
                        .and_then(|rest| rest.strip_suffix(after));
                    id.is_some_and(|id| PairName::of_file_name(id).is_some())
                }
            })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::{MANIFEST, foreign_entry};

    const FILES: &str = r#"{"mocban_export":1,"files":["export.json","pairs.jsonl","pairs/*/print.png",
        "pairs/*/relief/overlay.png","train/*.mask.png"]}"#;

    fn write(dir: &Path, name: &str, text: &str) {
        let path = dir.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
        fs::write(path, text).expect("written");
    }

    /// Returns the foreign file of a folder with these files.
    fn found(manifest: &str, files: &[&str]) -> Option<String> {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in files {
            write(dir.path(), name, "");
        }
        if !manifest.is_empty() {
            write(dir.path(), MANIFEST, manifest);
        }
        let found = foreign_entry(dir.path()).expect("readable")?;
        let below = found.strip_prefix(dir.path()).expect("below");
        Some(below.to_string_lossy().replace('\\', "/"))
    }

    #[test]
    fn exports_are_recognized() {
        assert_eq!(found("", &[]), None);
        assert_eq!(found(FILES, &[]), None);
        let all = [
            "pairs.jsonl",
            "pairs/a/print.png",
            "pairs/chữ số 1%3F/relief/overlay.png",
            "train/a.mask.png",
        ];
        assert_eq!(found(FILES, &all), None);
    }

    #[test]
    fn files_that_the_manifest_does_not_list_are_foreign() {
        for (manifest, file, foreign) in [
            ("", "pairs.jsonl", "pairs.jsonl"),
            ("{}", "pairs.jsonl", ""),
            ("the pairs\n", "pairs.jsonl", ""),
            (FILES, "thesis.tex", "thesis.tex"),
            (FILES, "pairs/a/notes.txt", "pairs/a/notes.txt"),
            (FILES, "pairs/a/mine/overlay.png", "pairs/a/mine"),
            (FILES, "pairs/a/print.png/x", "pairs/a/print.png"),
            (FILES, "pairs/a:b/print.png", "pairs/a:b"),
            (FILES, "train/.mask.png", "train/.mask.png"),
            (FILES, "train/a.mask.png.orig", "train/a.mask.png.orig"),
        ] {
            let found = found(manifest, &[file]).expect(file);
            // Without a valid manifest, the manifest is foreign too, and either may be found first.
            assert!(found == foreign || foreign.is_empty(), "{file}: {found}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_a_file_is_foreign_and_never_read() {
        for name in [MANIFEST, "pairs.jsonl"] {
            let dir = tempfile::tempdir().expect("a temporary directory");
            if name != MANIFEST {
                write(dir.path(), MANIFEST, FILES);
            }
            std::os::unix::fs::symlink("/dev/zero", dir.path().join(name)).expect("a link");
            let found = foreign_entry(dir.path()).expect("readable");
            assert_eq!(found, Some(dir.path().join(name)));
        }
    }
}
