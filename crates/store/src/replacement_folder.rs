//! An output folder that is replaced as a whole.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::create_folders::create_folders;
use super::parent_folder::{parent_folder, sync_folder};
use super::staging::StagingFolder;
use super::target_lock::{TargetLock, TargetLockError};
use mocban_core::domain::explained_by_cause;
use mocban_system::platform::{canonicalize, exchange, rename, sync_tree};

/// The new content in the staging folder.
const NEW: &str = "new";
/// The earlier content in the staging folder. Only used if the file system cannot exchange two folders.
const EARLIER: &str = "earlier";

/// A folder that is filled next to its target and then replaces the target. It is removed if it is dropped unfinished.
#[derive(Debug)]
pub struct ReplacementFolder {
    target: PathBuf,
    new: PathBuf,
    staging: StagingFolder,
    lock: TargetLock,
}

/// Why a folder cannot be replaced.
#[derive(Debug, thiserror::Error)]
pub enum ReplaceError {
    /// The folder has no name, like `/`.
    #[error("{0} cannot be replaced; name a folder")]
    NoName(PathBuf),
    /// Another process writes the folder, or its lock cannot be used.
    #[error("{0}")]
    Lock(#[from] TargetLockError),
    /// An operation on the file system failed. The target is unchanged.
    #[error("{path}: {source}")]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The target is complete, but its new name may be lost in a power cut.
    #[error("{path} is complete, but the disk did not confirm its name: {source}")]
    NotDurable {
        /// The target.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The target could not be replaced, and its earlier content could not be moved back.
    #[error(
        "{path}: {source}; the earlier folder is {earlier}, and the next call of this command restores it"
    )]
    Displaced {
        /// The target.
        path: PathBuf,
        /// Why.
        source: io::Error,
        /// Where the earlier content is.
        earlier: PathBuf,
    },
}

explained_by_cause! { ReplaceError: Lock }

/// A staging folder that `ReplacementFolder::finish` could not remove, with the reason.
pub type Leftover = Option<(PathBuf, io::Error)>;

impl ReplacementFolder {
    /// Creates an empty folder next to `target`. Restores the target if an earlier process died while it replaced it.
    ///
    /// # Errors
    /// Returns an error if another process writes the target, or the folder cannot be created.
    pub fn begin(target: &Path) -> Result<Self, ReplaceError> {
        let (parent, name) = place(target)?;
        create_folders(&parent).map_err(at(&parent))?;
        let target = parent.join(name);
        let lock = TargetLock::acquire(&target)?;
        recover_locked(&target)?;
        let staging = StagingFolder::beside(&target).map_err(at(&target))?;
        let new = staging.path().join(NEW);
        fs::create_dir(&new).map_err(at(&target))?;
        Ok(Self {
            target,
            new,
            staging,
            lock,
        })
    }

    /// Restores the target if an earlier process died while it replaced it, and removes what that process left. Returns
    /// whether there was such a process.
    ///
    /// # Errors
    /// Returns an error if another process writes the target, or the target cannot be restored.
    pub fn recover(target: &Path) -> Result<bool, ReplaceError> {
        let (parent, name) = place(target)?;
        let target = parent.join(name);
        let _lock = TargetLock::acquire(&target)?;
        recover_locked(&target)
    }

    /// Returns the folder to write to.
    pub fn path(&self) -> &Path {
        &self.new
    }

    /// Returns the target, as an absolute path.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Syncs the folder to disk and replaces the target with it.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be synced or renamed. The target is then unchanged, with two exceptions:
    /// after `NotDurable` it is already replaced, and `Displaced` names the path of its earlier content.
    pub fn finish(self) -> Result<Leftover, ReplaceError> {
        let Self {
            target,
            new,
            staging,
            lock,
        } = self;
        sync_tree(&new).map_err(at(&target))?;
        if !exists(&target).map_err(at(&target))? {
            rename(&new, &target).map_err(at(&target))?;
        } else if !exchange(&new, &target) {
            let earlier = staging.path().join(EARLIER);
            rename(&target, &earlier).map_err(at(&target))?;
            if let Err(source) = rename(&new, &target) {
                if rename(&earlier, &target).is_ok() {
                    return Err(at(&target)(source));
                }
                staging.keep();
                return Err(ReplaceError::Displaced {
                    path: target,
                    source,
                    earlier,
                });
            }
        }
        let synced = sync_folder(&parent_folder(&target));
        let staged = staging.path().to_owned();
        let removed = staging.remove();
        drop(lock);
        match synced {
            Ok(()) => Ok(removed.err().map(|error| (staged, error))),
            Err(source) => Err(ReplaceError::NotDurable {
                path: target,
                source,
            }),
        }
    }
}

/// Returns whether a path names anything, also a link without target.
fn exists(path: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(path) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Returns the parent and the name of a target.
fn place(target: &Path) -> Result<(PathBuf, OsString), ReplaceError> {
    let whole = match canonicalize(target) {
        Ok(whole) => whole,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            std::path::absolute(target).map_err(at(target))?
        }
        Err(error) => return Err(at(target)(error)),
    };
    match (whole.parent(), whole.file_name()) {
        (Some(parent), Some(name)) => Ok((parent.to_owned(), name.to_owned())),
        (None, _) | (_, None) => Err(ReplaceError::NoName(target.to_owned())),
    }
}

/// Returns a function that adds the path to an I/O error.
fn at(path: &Path) -> impl Fn(io::Error) -> ReplaceError {
    let path = path.to_owned();
    move |source| ReplaceError::Io {
        path: path.clone(),
        source,
    }
}

/// Does the work of [`ReplacementFolder::recover`] while the lock of the target is held.
fn recover_locked(target: &Path) -> Result<bool, ReplaceError> {
    let stale = StagingFolder::stale(target);
    let restored = stale.iter().try_for_each(|folder| restore(folder, target));
    if let Err(error) = restored {
        // One of them may hold the only copy.
        stale.into_iter().for_each(StagingFolder::keep);
        return Err(error);
    }
    Ok(!stale.is_empty())
}

/// Moves the earlier content back if it is in this folder and nothing has taken its place.
fn restore(folder: &StagingFolder, target: &Path) -> Result<(), ReplaceError> {
    let earlier = folder.path().join(EARLIER);
    let is_displaced = exists(&earlier).and_then(|is| Ok(is && !exists(target)?));
    if is_displaced.map_err(at(target))? {
        rename(&earlier, target).map_err(at(&earlier))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{EARLIER, ReplaceError, ReplacementFolder, StagingFolder, TargetLockError};
    use std::fs;
    use std::path::Path;

    fn write(target: &Path, text: &str) -> ReplacementFolder {
        let folder = ReplacementFolder::begin(target).expect("the target is free");
        fs::write(folder.path().join("text"), text).expect("written");
        folder
    }

    fn text(target: &Path) -> String {
        fs::read_to_string(target.join("text")).expect("read")
    }

    fn count(dir: &Path) -> usize {
        fs::read_dir(dir).expect("a folder").count()
    }

    #[test]
    fn an_earlier_folder_is_replaced_completely() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("deep/out");
        for round in ["one", "two"] {
            let left = write(&target, round).finish().expect("renamed");
            assert!(left.is_none());
            assert_eq!(text(&target), round);
        }
        assert_eq!(count(&target), 1);
        assert_eq!(count(&dir.path().join("deep")), 1);
    }

    #[test]
    fn an_unfinished_folder_leaves_the_earlier_one() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        write(&target, "one").finish().expect("renamed");
        drop(write(&target, "two"));
        assert_eq!(text(&target), "one");
        assert_eq!(count(dir.path()), 1);
    }

    #[test]
    fn a_second_writer_is_refused_and_disturbs_nothing() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        let first = write(&target, "one");
        let second = ReplacementFolder::begin(&target).expect_err("in use");
        let in_use = matches!(second, ReplaceError::Lock(TargetLockError::InUse { .. }));
        assert!(in_use, "{second}");
        first.finish().expect("renamed");
        assert_eq!(text(&target), "one");
        assert_eq!(count(dir.path()), 1);
    }

    #[test]
    fn a_folder_of_a_process_that_died_between_two_renames_is_restored() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        let dead = StagingFolder::beside(&target).expect("a folder");
        fs::create_dir(dead.path().join(EARLIER)).expect("a folder");
        fs::write(dead.path().join(EARLIER).join("text"), "one").expect("written");
        dead.keep();
        drop(ReplacementFolder::begin(&target).expect("the target is free"));
        assert_eq!(text(&target), "one");
        assert_eq!(count(dir.path()), 1);
    }

    #[test]
    fn what_a_dead_process_left_is_removed_without_a_new_folder() {
        let dir = tempfile::tempdir().expect("a folder");
        let target = dir.path().join("out");
        write(&target, "one").finish().expect("renamed");
        let recover = || ReplacementFolder::recover(&target);
        assert!(!recover().expect("the target is free"));
        let dead = StagingFolder::beside(&target).expect("a folder");
        fs::write(dead.path().join("half"), "two").expect("written");
        dead.keep();
        assert!(recover().expect("the target is free"));
        assert_eq!(text(&target), "one");
        assert_eq!(count(dir.path()), 1);
        let writer = write(&target, "three");
        recover().expect_err("in use");
        writer.finish().expect("renamed");
        assert_eq!(text(&target), "three");
    }
}
