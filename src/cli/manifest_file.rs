//! Reads a manifest or two folders from disk for the pure parsers in `manifest`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;

use super::exit::Refusal;
use crate::domain::LengthUnit;
use crate::manifest::{ManifestError, ManifestRow, pair_folders, parse_csv, parse_jsonl};

/// Pairs to import: paths as they are reached from the working directory.
#[derive(Debug)]
pub(super) struct Listing {
    pub(super) rows: Vec<ManifestRow>,
    /// What a person should know, a line each.
    pub(super) remarks: Vec<String>,
    /// What a row's number counts: `pairs.csv: line`, or `pair` for folders.
    place: String,
}

/// A manifest that is refused as a whole.
#[derive(Debug, thiserror::Error)]
#[error("{} is refused, nothing was imported:\n{}", from.display(), indented(problems))]
pub(super) struct RefusedManifest {
    from: PathBuf,
    problems: ManifestError,
}

fn indented(problems: &ManifestError) -> String {
    let lines: Vec<String> = problems
        .to_string()
        .lines()
        .map(|line| format!("  {line}"))
        .collect();
    lines.join("\n")
}

impl Listing {
    /// Reads a CSV or JSON Lines file; the ending tells which, and where it does not, the first character.
    ///
    /// # Errors
    /// When it cannot be read or is refused.
    pub(super) fn from_file(file: &Path) -> anyhow::Result<Self> {
        let shown = file.display();
        if file.is_dir() {
            let text = format!("{shown} is a directory; give two of them by --meshes and --prints");
            return Err(Refusal::Usage(text).into());
        }
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {shown}"))?;
        let rows = if is_jsonl(file, &bytes) {
            parse_jsonl(&bytes)
        } else {
            parse_csv(&bytes)
        };
        let mut rows = rows.map_err(|problems| RefusedManifest {
            from: file.to_owned(),
            problems,
        })?;
        let folder = file.parent().unwrap_or(Path::new(""));
        for row in &mut rows {
            row.mesh = folder.join(&row.mesh);
            row.print = folder.join(&row.print);
        }
        Ok(Self {
            remarks: same_but_for_case(&rows).into_iter().collect(),
            rows,
            place: format!("{shown}: line"),
        })
    }

    /// Pairs two folders by file stem.
    ///
    /// # Errors
    /// When a folder cannot be listed, or two files of one folder have the same stem.
    pub(super) fn from_folders(
        meshes: &Path,
        prints: &Path,
        unit: Option<LengthUnit>,
    ) -> anyhow::Result<Self> {
        let found =
            pair_folders(&files(meshes)?, &files(prints)?).map_err(|problems| RefusedManifest {
                from: meshes.to_owned(),
                problems,
            })?;
        let mut rows = found.rows;
        for row in &mut rows {
            row.unit = unit;
        }
        let remarks = [
            remark("mesh without print", &found.meshes_alone),
            remark("print without mesh", &found.prints_alone),
            remark("file that is neither", &found.ignored),
        ];
        let remarks = remarks.into_iter().chain([same_but_for_case(&rows)]);
        Ok(Self {
            rows,
            remarks: remarks.flatten().collect(),
            place: "pair".to_owned(),
        })
    }

    /// A line for each file that is not there.
    pub(super) fn missing(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for row in &self.rows {
            for (what, path) in [("mesh", &row.mesh), ("print", &row.print)] {
                if !path.exists() {
                    lines.push(format!(
                        "{} {}: {what} {} of {} is not there",
                        self.place,
                        row.line,
                        path.display(),
                        row.name
                    ));
                }
            }
        }
        lines
    }
}

/// Ids that some disks cannot tell apart.
fn same_but_for_case(rows: &[ManifestRow]) -> Option<String> {
    let mut seen = BTreeMap::new();
    let mut alike = rows.iter().filter_map(|row| {
        let lower = row.name.as_str().to_ascii_lowercase();
        Some((seen.insert(lower, &row.name)?, &row.name))
    });
    let (first, second) = alike.next()?;
    let more = match alike.count() {
        0 => String::new(),
        more => format!(", as do {more} more"),
    };
    Some(format!(
        "ids {first} and {second} differ only in capitals{more}; an export to a disk that takes these for one name \
         (Windows, macOS, memory sticks) would mix their folders"
    ))
}

fn is_jsonl(file: &Path, bytes: &[u8]) -> bool {
    let ending = file.extension().and_then(|ending| ending.to_str());
    match ending.map(str::to_ascii_lowercase).as_deref() {
        Some("jsonl" | "ndjson" | "json") => true,
        Some("csv" | "tsv") => false,
        Some(_) | None => {
            let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            text.trim_ascii_start().starts_with(b"{")
        }
    }
}

/// Plain files of a folder; what is below its own folders is not looked at.
fn files(dir: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let shown = dir.display();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).with_context(|| format!("cannot list {shown}"))? {
        let path = entry
            .with_context(|| format!("cannot list {shown}"))?
            .path();
        if !path.is_dir() {
            files.push(path);
        }
    }
    Ok(files)
}

/// `3 meshes without print: a.stl, b.stl, ...`
fn remark(what: &str, paths: &[PathBuf]) -> Option<String> {
    const NAMED: usize = 5;
    let names: Vec<String> = paths
        .iter()
        .take(NAMED)
        .map(|path| path.display().to_string())
        .collect();
    let more = match paths.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!paths.is_empty()).then(|| format!("left out, {what}: {}{more}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Listing, is_jsonl};

    #[test]
    fn form_is_told_by_ending_then_by_content() {
        assert!(is_jsonl(Path::new("a.jsonl"), b""));
        assert!(!is_jsonl(Path::new("a.csv"), b"{"));
        assert!(is_jsonl(Path::new("a"), b"\xef\xbb\xbf {\"id\":1}"));
        assert!(!is_jsonl(Path::new("a.txt"), b"id,mesh,print"));
    }

    #[test]
    fn ids_that_differ_only_in_capitals_are_remarked() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\nA1,m,p\nb,m,p\na1,m,p\nB,m,p\n").expect("written");
        let remarks = Listing::from_file(&file).expect("valid").remarks;
        assert_eq!(remarks.len(), 1);
        assert!(
            remarks[0].starts_with("ids A1 and a1 differ only in capitals, as do 1 more"),
            "{remarks:?}"
        );
    }

    #[test]
    fn paths_are_relative_to_the_manifest_and_missing_files_are_named_by_line() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\na,a.stl,pairs.csv\n").expect("a small file");
        let listing = Listing::from_file(&file).expect("valid");
        assert_eq!(listing.rows[0].mesh, dir.path().join("a.stl"));
        let missing = listing.missing();
        assert_eq!(missing.len(), 1);
        assert!(
            missing[0].contains("pairs.csv: line 2: mesh "),
            "{missing:?}"
        );
        let refused = Listing::from_file(dir.path()).expect_err("a directory");
        assert!(refused.to_string().contains("--meshes"), "{refused}");
    }
}
