//! An export folder that appears whole or not at all.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::pair_files::PAIRS;

/// The list of lines; a folder with it is an export.
pub(super) const LINES: &str = "pairs.jsonl";

/// The verdict log, as it was when the export was made.
pub(super) const VERDICTS: &str = "verdicts.jsonl";
/// The log of answers to planted faults and repeats.
pub(super) const CONTROLS: &str = "controls.jsonl";
/// The log of alignments by hand.
pub(super) const ALIGNMENTS: &str = "alignments.jsonl";
/// All that lies in an export.
const KNOWN: [&str; 5] = [LINES, PAIRS, VERDICTS, CONTROLS, ALIGNMENTS];

/// A folder being filled beside the one it will become. Dropped unfinished, it is removed.
#[derive(Debug)]
pub(super) struct Folder {
    target: PathBuf,
    partial: PathBuf,
    finished: bool,
}

/// Why a folder cannot be filled.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It holds something else.
    #[error("{path} holds {entry}, so it is not an earlier export; choose an empty or new folder")]
    NotAnExport {
        /// The folder.
        path: PathBuf,
        /// Something in it that no export writes.
        entry: String,
    },
    /// It has no name of its own, as `/` has none.
    #[error("{0} cannot be replaced by an export; name a folder")]
    NoName(PathBuf),
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Folder {
    /// Makes an empty folder beside `target`, which must be new, empty or an earlier export.
    ///
    /// # Errors
    /// When the target holds something else, or the folder cannot be made.
    pub(super) fn begin(target: &Path) -> Result<Self, FolderError> {
        refuse_foreign(target)?;
        let (parent, name) = place(target)?;
        fs::create_dir_all(&parent).map_err(at(&parent))?;
        let old = parent.join(hidden(&name, "old"));
        if old.exists() && !target.exists() {
            // A process died between its two renames.
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

    /// Where to write.
    pub(super) fn path(&self) -> &Path {
        &self.partial
    }

    /// Whether an earlier export is there, which finishing would replace.
    pub(super) fn replaces(&self) -> bool {
        self.target.join(LINES).exists()
    }

    /// Puts the folder in the place of the target, once all of it is on disk.
    ///
    /// # Errors
    /// When it cannot be renamed; an earlier export then stays.
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
            // What is left is hidden and removed by the next export to the same place.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

/// Brings everything below a folder to disk.
#[cfg(target_os = "linux")]
fn sync(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(fs::File::open(folder)?)?)
}

#[cfg(not(target_os = "linux"))]
fn sync(folder: &Path) -> io::Result<()> {
    fs::File::open(folder)?.sync_all()
}

/// Swaps two folders in one step, so that at no moment neither is there; `false` where the file system cannot.
#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn exchange(_one: &Path, _other: &Path) -> bool {
    false
}

/// The folder a target lies in, and its name there.
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

fn at(path: &Path) -> impl Fn(io::Error) -> FolderError {
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
    fn an_earlier_export_is_replaced_whole() {
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
    fn an_export_that_lost_its_place_half_way_gets_it_back() {
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
    fn a_folder_of_something_else_is_refused_untouched() {
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
