//! Reads a manifest or two folders from disk for the pure parsers in `manifest`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::exit::Refusal;
use super::files;
use crate::domain::{ContentHash, LengthUnit, PairName};
use crate::manifest::{Ids, ManifestError, ManifestRow, pair_folders, read_csv, read_jsonl};

/// Pairs to import, known to be sound. A list is kept as it is written and its rows are made one after another.
#[derive(Debug)]
pub(super) struct Listing {
    source: Source,
    /// The ids of all its pairs.
    pub(super) ids: Ids,
    /// What a person should know, a line each.
    pub(super) remarks: Vec<String>,
    /// What a row's number counts: `pairs.csv: line`, or `pair` for folders.
    place: String,
}

/// Where the rows come from.
#[derive(Debug)]
enum Source {
    /// A list, and the folder that its paths are relative to.
    List {
        bytes: Vec<u8>,
        read: Reader,
        folder: PathBuf,
    },
    /// Two folders.
    Folders(Vec<ManifestRow>),
}

type Reader = fn(&[u8], &mut dyn FnMut(ManifestRow)) -> Result<Ids, ManifestError>;

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
        let bytes = files::read(file)?;
        let read: Reader = if is_jsonl(file, &bytes) {
            read_jsonl
        } else {
            read_csv
        };
        let mut capitals = Capitals::default();
        let ids = read(&bytes, &mut |row| capitals.note(&row.name)).map_err(|problems| {
            RefusedManifest {
                from: file.to_owned(),
                problems,
            }
        })?;
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self {
            source: Source::List {
                bytes,
                read,
                folder,
            },
            ids,
            remarks: capitals.remark().into_iter().collect(),
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
        let mut capitals = Capitals::default();
        for row in &rows {
            capitals.note(&row.name);
        }
        let remarks = remarks.into_iter().chain([capitals.remark()]);
        Ok(Self {
            ids: rows.iter().map(|row| &row.name).collect(),
            source: Source::Folders(rows),
            remarks: remarks.flatten().collect(),
            place: "pair".to_owned(),
        })
    }

    /// Gives each row, with paths as they are reached from the working directory, and a line for each of its files
    /// that is not there.
    pub(super) fn rows(self, mut each: impl FnMut(ManifestRow, Vec<String>)) {
        let place = self.place;
        let mut each = |row: ManifestRow| {
            let missing = missing(&place, &row);
            each(row, missing);
        };
        match self.source {
            Source::Folders(rows) => rows.into_iter().for_each(each),
            Source::List {
                bytes,
                read,
                folder,
            } => {
                let read = read(&bytes, &mut |mut row| {
                    row.mesh = folder.join(&row.mesh);
                    row.print = folder.join(&row.print);
                    each(row);
                });
                read.expect("the same bytes were read before");
            }
        }
    }
}

/// Finds ids that some disks cannot tell apart.
#[derive(Debug, Default)]
struct Capitals {
    /// The beginnings of hashes of the ids without capitals: a list may have millions.
    seen: HashSet<[u8; 8]>,
    first: Option<PairName>,
    more: usize,
}

impl Capitals {
    fn note(&mut self, name: &PairName) {
        let hash = ContentHash::of(name.as_str().to_ascii_lowercase().as_bytes());
        let is_new = self
            .seen
            .insert(std::array::from_fn(|at| hash.as_bytes()[at]));
        match (is_new, &self.first) {
            (true, _) => {}
            (false, None) => self.first = Some(name.clone()),
            (false, Some(_)) => self.more += 1,
        }
    }

    fn remark(self) -> Option<String> {
        let name = self.first?;
        let more = match self.more {
            0 => String::new(),
            more => format!(", as do {more} more ids"),
        };
        Some(format!(
            "id {name} differs from another only in capitals{more}; an export to a disk that takes these for one name \
             (Windows, macOS, memory sticks) would mix their folders"
        ))
    }
}

fn missing(place: &str, row: &ManifestRow) -> Vec<String> {
    let files = [("mesh", &row.mesh), ("print", &row.print)].into_iter();
    let missing = files.filter(|(_, path)| !path.exists());
    let line = |(what, path): (&str, &PathBuf)| {
        let (path, line, name) = (path.display(), row.line, &row.name);
        format!("{place} {line}: {what} {path} of {name} is not there")
    };
    missing.map(line).collect()
}

/// Whether a file holds JSON Lines, by its ending, and where that does not tell, by its first character.
pub(super) fn is_jsonl(file: &Path, bytes: &[u8]) -> bool {
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
fn files(dir: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let mut files = files::list(dir)?;
    files.retain(|path| !path.is_dir());
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
            remarks[0].starts_with("id a1 differs from another only in capitals, as do 1 more ids"),
            "{remarks:?}"
        );
    }

    #[test]
    fn paths_are_relative_to_the_manifest_and_missing_files_are_named_by_line() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\na,a.stl,pairs.csv\n").expect("a small file");
        let listing = Listing::from_file(&file).expect("valid");
        let (mut meshes, mut missing) = (Vec::new(), Vec::new());
        listing.rows(|row, lines| {
            meshes.push(row.mesh);
            missing.extend(lines);
        });
        assert_eq!(meshes, [dir.path().join("a.stl")]);
        assert_eq!(missing.len(), 1);
        assert!(
            missing[0].contains("pairs.csv: line 2: mesh "),
            "{missing:?}"
        );
        let refused = Listing::from_file(dir.path()).expect_err("a directory");
        assert!(refused.to_string().contains("--meshes"), "{refused}");
    }
}
