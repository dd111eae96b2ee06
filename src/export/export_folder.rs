//! An export folder that is replaced atomically.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file of lines; a folder with it is an export.
pub(super) const LINES: &str = "pairs.jsonl";
/// The folder with the files of the pairs.
pub(super) const PAIRS: &str = "pairs";
/// The log of verdicts.
pub(super) const VERDICTS: &str = "verdicts.jsonl";
/// The log of answers to attention checks.
pub(super) const ATTENTION_CHECKS: &str = "attention_checks.jsonl";
/// The log of manual alignments.
pub(super) const MANUAL_ALIGNMENTS: &str = "manual_alignments.jsonl";
/// Every entry of an export folder.
const KNOWN: [&str; 5] = [LINES, PAIRS, VERDICTS, ATTENTION_CHECKS, MANUAL_ALIGNMENTS];

/// A new folder next to its target. `finish` replaces the target with it. If it is dropped before, it is removed.
#[derive(Debug)]
pub(super) struct Folder {
    target: PathBuf,
    partial: PathBuf,
    finished: bool,
}

/// Why an export folder cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds something else.
    #[error("{path} holds {entry}, so it is not an earlier export; choose an empty or new folder")]
    NotAnExport {
        /// The folder.
        path: PathBuf,
        /// An entry that no export writes.
        entry: String,
    },
    /// The folder has no name, like `/`.
    #[error("{0} cannot be replaced by an export; name a folder")]
    NoName(PathBuf),
    /// An operation on the file system failed.
    #[error("{path}: {source}")]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Folder {
    /// Creates an empty folder next to `target`, which must be new, empty or an earlier export.
    ///
    /// # Errors
    /// Returns an error if the target holds anything else, or the folder cannot be created.
    pub(super) fn begin(target: &Path) -> Result<Self, FolderError> {
        refuse_foreign(target)?;
        let (parent, name) = place(target)?;
        fs::create_dir_all(&parent).map_err(at(&parent))?;
        let old = parent.join(hidden(&name, "old"));
        if old.exists() && !target.exists() {
            // An earlier process died between its two renames.
            fs::rename(&old, target).map_err(at(&old))?;
        }
        let partial = parent.join(hidden(&name, "partial"));
        remove(&partial)?;
        fs::create_dir(&partial).map_err(at(&partial))?;
        Ok(Self {
            target: parent.join(name),
            partial,
            finished: false,
        })
    }

    /// Returns the folder to write to.
    pub(super) fn path(&self) -> &Path {
        &self.partial
    }

    /// Returns whether finishing would replace an earlier export.
    pub(super) fn replaces(&self) -> bool {
        self.target.join(LINES).exists()
    }

    /// Syncs the folder to disk and replaces the target with it.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be synced or renamed; an earlier export is then kept. Also returns an
    /// error if the replaced export cannot be removed; the target is then the new export.
    pub(super) fn finish(mut self) -> Result<(), FolderError> {
        sync(&self.partial).map_err(at(&self.partial))?;
        if self.target.exists() && exchange(&self.partial, &self.target) {
            self.finished = true;
            return remove(&self.partial);
        }
        let (parent, name) = place(&self.target)?;
        let old = parent.join(hidden(&name, "old"));
        remove(&old)?;
        let replaced = self.target.exists();
        if replaced {
            fs::rename(&self.target, &old).map_err(at(&self.target))?;
        }
        if let Err(source) = fs::rename(&self.partial, &self.target) {
            if replaced {
                fs::rename(&old, &self.target).map_err(at(&old))?;
            }
            return Err(at(&self.target)(source));
        }
        self.finished = true;
        remove(&old)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.finished {
            // The next export to the same target removes what is left.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

/// Syncs the file system of a folder to disk.
#[cfg(target_os = "linux")]
fn sync(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(fs::File::open(folder)?)?)
}

#[cfg(not(target_os = "linux"))]
fn sync(folder: &Path) -> io::Result<()> {
    fs::File::open(folder)?.sync_all()
}

/// Swaps two folders atomically. Returns `false` on failure, for example if the file system does not support it.
#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn exchange(_one: &Path, _other: &Path) -> bool {
    false
}

/// Returns the parent and the name of a target.
fn place(target: &Path) -> Result<(PathBuf, std::ffi::OsString), FolderError> {
    let whole = match fs::canonicalize(target) {
        Ok(whole) => whole,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            std::path::absolute(target).map_err(at(target))?
        }
        Err(error) => return Err(at(target)(error)),
    };
    match (whole.parent(), whole.file_name()) {
        (Some(parent), Some(name)) => Ok((parent.to_owned(), name.to_owned())),
        (None, _) | (_, None) => Err(FolderError::NoName(target.to_owned())),
    }
}

fn hidden(name: &OsStr, what: &str) -> String {
    format!(".{}.mocban-{what}", name.to_string_lossy())
}

fn remove(path: &Path) -> Result<(), FolderError> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(at(path)(error)),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Refuses a folder that holds anything an export does not write.
fn refuse_foreign(target: &Path) -> Result<(), FolderError> {
    let entries = match fs::read_dir(target) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(at(target)(error)),
    };
    for entry in entries {
        let name = entry.map_err(at(target))?.file_name();
        if !KNOWN.iter().any(|known| name == *known) {
            return Err(not_an_export(target, &name));
        }
    }
    if target.join(PAIRS).exists() && !target.join(LINES).exists() {
        return Err(not_an_export(target, OsStr::new(PAIRS)));
    }
    Ok(())
}

fn not_an_export(target: &Path, entry: &OsStr) -> FolderError {
    FolderError::NotAnExport {
        path: target.to_owned(),
        entry: entry.to_string_lossy().into_owned(),
    }
}

/// Returns a conversion of errors of operations on a file or folder.
pub(super) fn at(path: &Path) -> impl Fn(io::Error) -> FolderError {
    let path = path.to_owned();
    move |source| FolderError::Io {
        path: path.clone(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::{Folder, FolderError, LINES};
    use std::fs;

    fn names(dir: &std::path::Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(dir)
            .expect("the folder is there")
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    #[test]
    fn an_earlier_export_is_replaced_completely() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("deep/out");
        for text in ["one", "two"] {
            let folder = Folder::begin(&target).expect("the target is free");
            fs::write(folder.path().join(LINES), text).expect("written");
            folder.finish().expect("renamed");
        }
        assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), "two");
        assert_eq!(names(&dir.path().join("deep")), ["out"]);
    }

    #[test]
    fn an_unfinished_export_leaves_the_earlier_one() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        let first = Folder::begin(&target).expect("the target is free");
        fs::write(first.path().join(LINES), "one").expect("written");
        first.finish().expect("renamed");
        drop(Folder::begin(&target).expect("an export may be replaced"));
        assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), "one");
        assert_eq!(names(dir.path()), ["out"]);
    }

    #[test]
    fn an_export_interrupted_between_renames_is_restored() {
        let dir = tempfile::tempdir().expect("a folder");
        let (target, old) = (dir.path().join("out"), dir.path().join(".out.mocban-old"));
        fs::create_dir(&old).expect("made");
        fs::write(old.join(LINES), "one").expect("written");
        let folder = Folder::begin(&target).expect("the target is free");
        assert!(folder.replaces());
        drop(folder);
        assert_eq!(fs::read_to_string(target.join(LINES)).expect("read"), "one");
        assert_eq!(names(dir.path()), ["out"]);
    }

    #[test]
    fn a_foreign_folder_is_refused_and_unchanged() {
        let dir = tempfile::tempdir().expect("a folder");
        fs::write(dir.path().join(LINES), "").expect("written");
        fs::write(dir.path().join("thesis.tex"), "").expect("written");
        let refused = Folder::begin(dir.path());
        assert!(
            matches!(refused, Err(FolderError::NotAnExport { entry, .. }) if entry == "thesis.tex")
        );
        assert_eq!(names(dir.path()).len(), 2);
        let file = Folder::begin(&dir.path().join("thesis.tex"));
        assert!(matches!(file, Err(FolderError::Io { .. })));
    }
}
