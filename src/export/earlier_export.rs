//! Recognizes an earlier export by its names and its content, so that an export never replaces anything else.

use std::collections::BTreeSet;
use std::fs::{self, DirEntry, File};
use std::io::{BufRead as _, BufReader, Read as _, Result};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::file_names::{ATTENTION_CHECKS, LINES, MANUAL_ALIGNMENTS, PAIRS, VERDICTS};
use crate::domain::ThresholdMetric;

/// Files of lines, each with keys that every line has.
const FILES: [(&str, &[&str]); 4] = [
    (LINES, &["id", "metric", "status", "result_hash"]),
    (
        VERDICTS,
        &["pair", "metric", "result_hash", "verdict", "reviewer"],
    ),
    (
        ATTENTION_CHECKS,
        &["pair", "result_hash", "check", "verdict"],
    ),
    (
        MANUAL_ALIGNMENTS,
        &["pair", "reviewer", "print_from_mesh", "mesh_hash"],
    ),
];

/// Names, without extensions, of the images that an export writes for a pair or for a metric of a pair.
const IMAGES: [&str; 10] = [
    "print",
    "print_mask",
    "depth",
    "depth_mask",
    "aligned_depth",
    "aligned_mask",
    "canvas_depth_mask",
    "canvas_print_mask",
    "stroke_map",
    "overlay",
];

/// Longest first line that is read, in bytes.
const MAX_LINE: u64 = 16 << 20;

/// Returns a file or folder below `dir` that no export writes, or `None` if `dir` is empty or an earlier export.
///
/// # Errors
/// Returns an error if a folder or file cannot be read.
pub(super) fn foreign_entry(dir: &Path) -> Result<Option<PathBuf>> {
    let mut empty_files = BTreeSet::new();
    let mut names = BTreeSet::new();
    for entry in entries(dir)? {
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_dir = entry.file_type()?.is_dir();
        let known = FILES.iter().find(|(file, _)| name == *file);
        match known {
            Some((_, keys)) if entry.file_type()?.is_file() => match first_line(&entry.path())? {
                None => {
                    empty_files.insert(name.clone());
                }
                Some(line) if has_keys(&line, keys) => {}
                Some(_) => return Ok(Some(entry.path())),
            },
            None if name == PAIRS && is_dir => {}
            Some(_) | None => return Ok(Some(entry.path())),
        }
        names.insert(name);
    }
    // Without lines there are no pairs, so all other content is foreign.
    let has_lines = names.contains(LINES) && !empty_files.contains(LINES);
    if !has_lines {
        let foreign = |name: &&String| *name != LINES && !empty_files.contains(*name);
        if let Some(name) = names.iter().find(foreign) {
            return Ok(Some(dir.join(name)));
        }
        if !names.is_empty() && !names.contains(LINES) {
            return Ok(names.first().map(|name| dir.join(name)));
        }
    }
    if !names.contains(PAIRS) {
        return Ok(None);
    }
    for pair in entries(&dir.join(PAIRS))? {
        if !pair.file_type()?.is_dir() {
            return Ok(Some(pair.path()));
        }
        if let Some(foreign) = foreign_in_pair(&pair.path())? {
            return Ok(Some(foreign));
        }
    }
    Ok(None)
}

/// Returns an entry of a pair's folder that no export writes.
fn foreign_in_pair(pair: &Path) -> Result<Option<PathBuf>> {
    for entry in entries(pair)? {
        if !entry.file_type()?.is_dir() {
            if !is_image(&entry)? {
                return Ok(Some(entry.path()));
            }
            continue;
        }
        let name = entry.file_name();
        let is_metric = ThresholdMetric::ALL
            .iter()
            .any(|metric| name == metric.name());
        if !is_metric {
            return Ok(Some(entry.path()));
        }
        for image in entries(&entry.path())? {
            if !is_image(&image)? {
                return Ok(Some(image.path()));
            }
        }
    }
    Ok(None)
}

/// Returns whether an entry is a regular file with the name of an exported image, with any extension.
fn is_image(entry: &DirEntry) -> Result<bool> {
    let name = PathBuf::from(entry.file_name());
    let stem = name.file_stem().unwrap_or_default();
    Ok(entry.file_type()?.is_file() && IMAGES.iter().any(|known| stem == *known))
}

fn entries(dir: &Path) -> Result<Vec<DirEntry>> {
    fs::read_dir(dir)?.collect()
}

/// Returns the first line of a regular file, or `None` if the file is empty.
fn first_line(file: &Path) -> Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    BufReader::new(File::open(file)?.take(MAX_LINE)).read_until(b'\n', &mut line)?;
    Ok((!line.is_empty()).then_some(line))
}

/// Returns whether a line is a JSON object with all these keys.
fn has_keys(line: &[u8], keys: &[&str]) -> bool {
    let parsed: Option<Map<String, Value>> = serde_json::from_slice(line).ok();
    parsed.is_some_and(|object| keys.iter().all(|key| object.contains_key(*key)))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::foreign_entry;

    const LINE: &str = r#"{"id":"a","metric":"nl_ssim","status":"done","result_hash":null}"#;
    const VERDICT: &str =
        r#"{"pair":"a","metric":"nl_ssim","result_hash":"0","verdict":"pass","reviewer":"lan"}"#;

    fn write(dir: &Path, name: &str, text: &str) {
        let path = dir.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
        fs::write(path, text).expect("written");
    }

    /// Returns the foreign file of a folder with these files.
    fn found(files: &[(&str, &str)]) -> Option<String> {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for (name, text) in files {
            write(dir.path(), name, text);
        }
        let found = foreign_entry(dir.path()).expect("readable")?;
        let below = found.strip_prefix(dir.path()).expect("below");
        Some(below.to_string_lossy().into_owned())
    }

    #[test]
    fn exports_are_recognized() {
        assert_eq!(found(&[]), None);
        assert_eq!(found(&[("pairs.jsonl", ""), ("verdicts.jsonl", "")]), None);
        let full = [
            ("pairs.jsonl", LINE),
            ("verdicts.jsonl", VERDICT),
            ("pairs/a/print.jpg", ""),
            ("pairs/a/depth.json", ""),
            ("pairs/a/relief/overlay.png", ""),
        ];
        assert_eq!(found(&full), None);
    }

    #[test]
    fn foreign_files_with_the_names_of_an_export_are_recognized() {
        let verdicts = "verdicts.jsonl";
        for (files, foreign) in [
            (&[(verdicts, VERDICT)][..], verdicts),
            (&[(verdicts, "")], verdicts),
            (&[(verdicts, VERDICT), ("pairs.jsonl", "")], verdicts),
            (&[(verdicts, "guilty\n"), ("pairs.jsonl", LINE)], verdicts),
            (&[("pairs.jsonl", "{\"id\":1}\n")], "pairs.jsonl"),
            (&[("pairs.jsonl", "the pairs\n")], "pairs.jsonl"),
            (&[("pairs/a/print.png", "")], "pairs"),
            (&[("pairs.jsonl/a", "")], "pairs.jsonl"),
            (&[("pairs.jsonl", LINE), ("pairs/a.txt", "")], "pairs/a.txt"),
            (
                &[("pairs.jsonl", LINE), ("pairs/a/notes.txt", "")],
                "pairs/a/notes.txt",
            ),
            (
                &[("pairs.jsonl", LINE), ("pairs/a/mine/overlay.png", "")],
                "pairs/a/mine",
            ),
        ] {
            assert_eq!(found(files).as_deref(), Some(foreign), "{files:?}");
        }
    }

    #[test]
    fn a_pipe_in_place_of_a_file_is_foreign_and_never_read() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        std::os::unix::fs::symlink("/dev/zero", dir.path().join("pairs.jsonl")).expect("a link");
        assert!(foreign_entry(dir.path()).expect("readable").is_some());
    }
}
