//! A folder that gets a free name when it is whole.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::create_folders::create_folders;
use super::parent_folder::sync_folder;
use super::staging::{StagingFolder, is_staging_of};
use mocban_system::platform::{rename, sync_tree};

/// The output that the names of staging folders are made of, because the name of the new folder is chosen at the end.
const TARGET: &str = "new";
/// The new content in the staging folder.
const NEW: &str = "new";
/// Number of names that are tried.
const ATTEMPTS: u32 = 10_000;

/// A folder that is filled under a hidden name. It is removed if it is dropped before it has its name.
#[derive(Debug)]
pub struct NewFolder {
    parent: PathBuf,
    content: PathBuf,
    staging: StagingFolder,
}

impl NewFolder {
    /// Creates an empty folder in `parent`, which is created if there is none. Removes what dead processes left there.
    pub fn begin(parent: &Path) -> io::Result<Self> {
        create_folders(parent)?;
        let staging = StagingFolder::beside(&parent.join(TARGET))?;
        let content = staging.path().join(NEW);
        fs::create_dir(&content)?;
        Ok(Self {
            parent: parent.to_owned(),
            content,
            staging,
        })
    }

    /// Removes what dead processes left in `parent`. Returns the number of their folders.
    pub fn remove_unfinished(parent: &Path) -> usize {
        StagingFolder::remove_stale(&parent.join(TARGET))
    }

    /// Returns whether a name is that of a folder that a killed process leaves in the parent.
    pub fn is_unfinished(name: &OsStr) -> bool {
        is_staging_of(Path::new(TARGET), name)
    }

    /// Returns the folder to write to.
    pub fn path(&self) -> &Path {
        &self.content
    }

    /// Returns a folder for files that do not stay.
    pub fn scratch(&self) -> &Path {
        self.staging.path()
    }

    /// Syncs the folder to disk and gives it a name, or the name with a number if something has it already. If it holds one
    /// folder and nothing else, that folder gets the name. Returns its path.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be synced or renamed. It is then removed.
    pub fn place(self, name: &str) -> io::Result<PathBuf> {
        sync_tree(&self.content)?;
        let from = only_folder(&self.content)?.unwrap_or_else(|| self.content.clone());
        for number in 1..=ATTEMPTS {
            let name = match number {
                1 => name.to_owned(),
                _ => format!("{name}-{number}"),
            };
            let target = self.parent.join(name);
            match fs::symlink_metadata(&target) {
                Ok(_) => continue,
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
            match rename(&from, &target) {
                // Another process has used the name meanwhile. A rename replaces no folder that holds something.
                Err(_) if target.symlink_metadata().is_ok() => {}
                Err(error) => return Err(error),
                Ok(()) => {
                    if let Err(error) = sync_folder(&self.parent) {
                        // Without its name, the folder is removed.
                        let _ = rename(&target, &from);
                        return Err(error);
                    }
                    return Ok(target);
                }
            }
        }
        let text = format!("{name} and {ATTEMPTS} names like it are taken");
        Err(io::Error::new(ErrorKind::AlreadyExists, text))
    }
}

/// Returns the folder that is alone in a folder.
fn only_folder(folder: &Path) -> io::Result<Option<PathBuf>> {
    let mut entries = fs::read_dir(folder)?;
    let first = entries.next().transpose()?;
    Ok(match (first, entries.next()) {
        (Some(only), None) if only.file_type()?.is_dir() => Some(only.path()),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::NewFolder;
    use std::fs;
    use std::path::Path;

    fn filled(parent: &Path, file: &str) -> NewFolder {
        let folder = NewFolder::begin(parent).expect("a folder");
        let path = folder.path().join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("created");
        fs::write(path, file).expect("written");
        folder
    }

    fn names(parent: &Path) -> Vec<String> {
        let entries = fs::read_dir(parent).expect("a folder").flatten();
        let mut names: Vec<_> = entries
            .map(|entry| entry.file_name().into_string().expect("UTF-8"))
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_taken_name_gets_a_number_and_nothing_is_replaced() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let parent = dir.path().join("uploads");
        for file in ["1.stl", "2.stl", "a/b/3.stl"] {
            filled(&parent, file).place("quét").expect("placed");
        }
        fs::write(parent.join("file"), "kept").expect("written");
        filled(&parent, "4.stl").place("file").expect("placed");
        assert_eq!(
            names(&parent),
            ["file", "file-2", "quét", "quét-2", "quét-3"]
        );
        assert_eq!(names(&parent.join("quét")), ["1.stl"]);
        assert_eq!(names(&parent.join("quét-3")), ["b"], "without `a`");
    }

    #[test]
    fn unfinished_folders_are_removed_by_this_process_and_by_the_next() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let parent = dir.path().join("uploads");
        drop(filled(&parent, "1.stl"));
        assert_eq!(names(&parent), [""; 0]);
        let alive = filled(&parent, "1.stl");
        // A process that died: its folder has no lock.
        let dead = parent.join(".new.1-7.mocban-partial");
        fs::create_dir_all(dead.join("new")).expect("a folder");
        fs::write(dead.join("lock"), "1").expect("written");
        assert!(dead.file_name().is_some_and(NewFolder::is_unfinished));
        assert_eq!(NewFolder::remove_unfinished(&parent), 1);
        assert!(!dead.exists() && alive.path().exists());
        assert_eq!(NewFolder::remove_unfinished(&dir.path().join("none")), 0);
    }
}
