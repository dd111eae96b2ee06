//! The checksums of the files in an export or another folder of outputs, by which files that somebody edited or added are found
//! before they are replaced.
//!
//! `b3sum --check` reads them: each line has the BLAKE3 hash of a file and its path.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufRead as _, BufReader, Read as _};
use std::path::{Component, Path, PathBuf};

use rayon::prelude::*;

use super::export_folder::{FolderError, SharedFile, at};
use super::manifest::is_regular_file;
use mocban_core::domain::ContentHash;
use mocban_core::domain::cancel::poll;

/// Name of the file with the checksums.
pub const CHECKSUMS: &str = "checksums.txt";
/// Files whose checksums are computed at a time.
const PART: usize = 256;
/// Longest line that is read, in bytes.
const MAX_LINE: u64 = 8 << 10;

/// Writes the checksums of all files below a folder.
///
/// # Errors
/// Returns an error if a file cannot be read, or if the checksums cannot be written.
pub fn write_checksums(root: &Path) -> Result<(), FolderError> {
    let mut lines = SharedFile::create(root, CHECKSUMS)?;
    visit_files(root, &mut |names: &[String]| {
        for part in names.chunks(PART) {
            poll();
            let line = |below: &String| -> Result<String, FolderError> {
                let path = root.join(below);
                let hash = hash_of(&path).map_err(at(&path))?;
                Ok(format!("{}  {below}\n", hash.to_hex()))
            };
            let text: Result<Vec<String>, FolderError> = part.par_iter().map(line).collect();
            lines.append(text?.concat().as_bytes())?;
        }
        Ok(())
    })?;
    lines.flush()
}

/// Refuses an earlier export in which somebody edited a file, or to which somebody added one. Exports of earlier versions have
/// no checksums and are not refused. Files that were removed are no loss.
///
/// # Errors
/// Returns an error that names the file, or if a file cannot be read.
pub fn refuse_edited(target: &Path) -> Result<(), FolderError> {
    match edited_file(target)? {
        Some(EditedFile::Changed(path)) => Err(FolderError::Changed(path)),
        Some(EditedFile::Added(path)) => Err(FolderError::NotAnExport(path)),
        None => Ok(()),
    }
}

/// A file that would be lost if the export were replaced.
#[derive(Debug, PartialEq, Eq)]
enum EditedFile {
    /// It has another content than the export.
    Changed(PathBuf),
    /// The export has no such file.
    Added(PathBuf),
}

/// Returns a file of an earlier export that somebody edited or added. `None` if there is none, or if there are no checksums.
fn edited_file(dir: &Path) -> Result<Option<EditedFile>, FolderError> {
    let path = dir.join(CHECKSUMS);
    if !is_regular_file(&path).map_err(at(&path))? {
        return Ok(None);
    }
    let mut known = 0;
    let mut list = ChecksumList::open(&path)?;
    while let Some(part) = list.next_part()? {
        poll();
        let states: Result<Vec<ListedFileState>, FolderError> =
            part.par_iter().map(|file| file.state(dir)).collect();
        for (file, state) in part.iter().zip(states?) {
            match state {
                ListedFileState::Changed => {
                    return Ok(Some(EditedFile::Changed(dir.join(&file.below))));
                }
                ListedFileState::Same => known += 1,
                ListedFileState::Removed => {}
            }
        }
    }
    if list.is_damaged {
        return Ok(Some(EditedFile::Changed(path)));
    }
    let mut found = 0;
    visit_files(dir, &mut |names: &[String]| {
        found += names.len();
        Ok(())
    })?;
    if found == known {
        return Ok(None);
    }
    added_file(dir, &path).map(|added| added.map(EditedFile::Added))
}

/// Returns the first file below a folder that its checksums do not list.
fn added_file(dir: &Path, checksums: &Path) -> Result<Option<PathBuf>, FolderError> {
    let mut known = BTreeSet::new();
    let mut list = ChecksumList::open(checksums)?;
    while let Some(part) = list.next_part()? {
        known.extend(part.into_iter().map(|file| file.below));
    }
    let mut added = None;
    visit_files(dir, &mut |names: &[String]| {
        if added.is_none() {
            let name = names.iter().find(|name| !known.contains(*name));
            added = name.map(|name| dir.join(name));
        }
        Ok(())
    })?;
    Ok(added)
}

/// Visits the paths of the files below a folder, sorted, one folder at a time. Leaves out the checksums.
fn visit_files(
    root: &Path,
    visit: &mut dyn FnMut(&[String]) -> Result<(), FolderError>,
) -> Result<(), FolderError> {
    let mut folders = vec![String::new()];
    while let Some(folder) = folders.pop() {
        let path = root.join(&folder);
        let (mut files, mut inner) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(&path).map_err(at(&path))? {
            let entry = entry.map_err(at(&path))?;
            let below = format!("{folder}{}", entry.file_name().to_string_lossy());
            if entry.file_type().map_err(at(&path))?.is_dir() {
                inner.push(format!("{below}/"));
            } else if below != CHECKSUMS {
                files.push(below);
            }
        }
        files.sort_unstable();
        inner.sort_unstable_by(|a, b| b.cmp(a));
        folders.append(&mut inner);
        visit(&files)?;
    }
    Ok(())
}

fn hash_of(path: &Path) -> io::Result<ContentHash> {
    ContentHash::of_source(File::open(path)?)
}

/// A line of the checksums.
#[derive(Debug)]
struct ListedFile {
    hash: ContentHash,
    /// Its path below the folder.
    below: String,
}

/// What became of a listed file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ListedFileState {
    Same,
    Changed,
    Removed,
}

impl ListedFile {
    /// Parses a line. Returns `None` if it has no checksum of a file below the folder.
    fn of(line: &[u8]) -> Option<Self> {
        let line = std::str::from_utf8(line).ok()?;
        let (hash, below) = line.trim_end_matches(['\r', '\n']).split_once("  ")?;
        let mut parts = Path::new(below).components();
        let is_below = parts.all(|part| matches!(part, Component::Normal(_)));
        (is_below && !below.is_empty()).then_some(Self {
            hash: hash.parse().ok()?,
            below: below.to_owned(),
        })
    }

    fn state(&self, dir: &Path) -> Result<ListedFileState, FolderError> {
        let path = dir.join(&self.below);
        let is_file = is_regular_file(&path).map_err(at(&path))?;
        Ok(if !is_file {
            ListedFileState::Removed
        } else if hash_of(&path).map_err(at(&path))? == self.hash {
            ListedFileState::Same
        } else {
            ListedFileState::Changed
        })
    }
}

/// Reads the checksums of an export, some lines at a time.
struct ChecksumList {
    path: PathBuf,
    lines: BufReader<File>,
    /// Whether a line had no checksum. The rest is then not read.
    is_damaged: bool,
}

impl ChecksumList {
    fn open(path: &Path) -> Result<Self, FolderError> {
        Ok(Self {
            path: path.to_owned(),
            lines: BufReader::new(File::open(path).map_err(at(path))?),
            is_damaged: false,
        })
    }

    /// Returns the next files; `None` at the end.
    fn next_part(&mut self) -> Result<Option<Vec<ListedFile>>, FolderError> {
        let mut part = Vec::new();
        while part.len() < PART && !self.is_damaged {
            let mut line = Vec::new();
            let mut limited = self.lines.by_ref().take(MAX_LINE);
            let read = limited.read_until(b'\n', &mut line);
            if read.map_err(at(&self.path))? == 0 {
                break;
            }
            match ListedFile::of(&line) {
                Some(file) => part.push(file),
                None => self.is_damaged = true,
            }
        }
        Ok((!part.is_empty()).then_some(part))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::{CHECKSUMS, EditedFile, edited_file, refuse_edited, write_checksums};

    const FILES: [&str; 4] = ["export.json", "pairs/b/a.png", "pairs/a.png", "a b.txt"];

    /// Returns a folder with checksums.
    fn export() -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a folder");
        for name in FILES {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
            fs::write(path, name).expect("written");
        }
        write_checksums(dir.path()).expect("written");
        dir
    }

    fn edited(dir: &Path) -> Option<EditedFile> {
        edited_file(dir).expect("readable")
    }

    #[test]
    fn checksums_are_sorted_and_equal_for_equal_files() {
        let [one, other] = [export(), export()]
            .map(|dir| fs::read_to_string(dir.path().join(CHECKSUMS)).expect("checksums"));
        assert_eq!(one, other);
        let names = one
            .lines()
            .map(|line| line.split_once("  ").expect("a line").1);
        let names: Vec<&str> = names.collect();
        assert_eq!(
            names,
            ["a b.txt", "export.json", "pairs/a.png", "pairs/b/a.png"]
        );
    }

    #[test]
    fn edited_and_added_files_are_found_and_removed_ones_are_no_loss() {
        let dir = export();
        let file = |name: &str| dir.path().join(name);
        assert_eq!(edited(dir.path()), None);
        fs::write(file("pairs/a.png"), "pairs/a.pnG").expect("written");
        let changed = EditedFile::Changed(file("pairs/a.png"));
        assert_eq!(edited(dir.path()), Some(changed));
        fs::remove_file(file("pairs/a.png")).expect("removed");
        assert_eq!(edited(dir.path()), None);
        fs::write(file("pairs/mine.png"), "mine").expect("written");
        let added = EditedFile::Added(file("pairs/mine.png"));
        assert_eq!(edited(dir.path()), Some(added));
        let refused = refuse_edited(dir.path()).expect_err("an added file");
        assert!(
            refused
                .to_string()
                .contains("mine.png is not part of an export"),
            "{refused}"
        );
        fs::remove_file(file(CHECKSUMS)).expect("removed");
        assert_eq!(edited(dir.path()), None);
        refuse_edited(&file("nowhere")).expect("no folder");
    }

    #[test]
    fn damaged_checksums_are_a_changed_file_and_name_nothing_elsewhere() {
        let dir = export();
        let path = dir.path().join(CHECKSUMS);
        let whole = fs::read_to_string(&path).expect("checksums");
        let hash = &whole[..64];
        for line in [
            "my notes\n".to_owned(),
            format!("{hash}  ../a\n"),
            format!("{hash}  /etc/hosts\n"),
            format!("{hash}  \n"),
            "0".repeat(100_000),
        ] {
            fs::write(&path, format!("{whole}{line}")).expect("written");
            let changed = Some(EditedFile::Changed(path.clone()));
            assert_eq!(edited(dir.path()), changed, "{line:.80}");
        }
    }
}
