//! Staging folders: hidden folders next to an output, in which the output is written before it is renamed.
//!
//! Every process has its own staging folders, with a unique name and a locked file. A staging folder whose lock is free
//! belongs to a process that died; the next command that writes the same output removes the folder.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::lock_file::{LockAttempt, LockFile};
use super::parent_folder::parent_folder;
use mocban_system::platform::file_name_of;

/// End of the name of every staging folder.
const SUFFIX: &str = ".mocban-partial";
/// The locked file in a staging folder.
const LOCK: &str = "lock";
/// Longest part of an output's name, in bytes, that a hidden name contains. File systems allow 255 bytes per name.
const MAX_STEM: usize = 180;
/// Number of attempts to create a folder with a new name.
const ATTEMPTS: u32 = 1_000;

/// Makes the names of this process unique.
static NEXT: AtomicU64 = AtomicU64::new(0);

/// A hidden folder for an unfinished output. The folder and its content are removed when the value is dropped.
#[derive(Debug)]
pub struct StagingFolder {
    dir: PathBuf,
    /// `None` on a file system without locks.
    lock: Option<LockFile>,
    is_kept: bool,
}

impl StagingFolder {
    /// Creates an empty folder next to an output. Removes folders of dead processes that wrote the same output.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be created, or the output's name is too long.
    pub fn beside(target: &Path) -> Result<Self> {
        if let Err(error) = fs::symlink_metadata(target)
            && error.kind() == ErrorKind::InvalidFilename
        {
            return Err(error);
        }
        drop(Self::stale(target));
        for _ in 0..ATTEMPTS {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let ending = format!("{}-{number}{SUFFIX}", std::process::id());
            let dir = hidden_sibling(target, &ending);
            match fs::create_dir(&dir) {
                // An earlier process or one in another container has used this pid and number.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                created => created?,
            }
            let lock = match LockFile::create(&dir.join(LOCK)) {
                Ok(LockAttempt::Held(lock)) => Some(lock),
                Ok(LockAttempt::Unsupported) => None,
                // Another process removes the folder because it was not locked yet.
                Ok(LockAttempt::Busy(_)) => continue,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => {
                    let _ = fs::remove_dir(&dir);
                    return Err(error);
                }
            };
            let is_kept = false;
            return Ok(Self { dir, lock, is_kept });
        }
        let text = "other processes keep removing the folder for unfinished files";
        Err(Error::other(text))
    }

    /// Removes folders of dead processes that wrote this output. Returns how many there were.
    pub fn remove_stale(target: &Path) -> usize {
        Self::stale(target).len()
    }

    /// Returns the folders of dead processes that wrote this output. Dropping a folder removes it from the disk.
    pub(super) fn stale(target: &Path) -> Vec<Self> {
        let Ok(entries) = fs::read_dir(parent_folder(target)) else {
            return Vec::new();
        };
        let own = hidden_sibling(target, "");
        let prefix = own.file_name().unwrap_or_default();
        entries
            .flatten()
            .filter(|entry| is_staging_name(&entry.file_name(), prefix))
            .filter_map(|entry| Self::take_over(entry.path()))
            .collect()
    }

    /// Locks the folder of a dead process. Returns `None` if its process lives or the folder cannot be used.
    fn take_over(dir: PathBuf) -> Option<Self> {
        if !fs::symlink_metadata(&dir).is_ok_and(|meta| meta.is_dir()) {
            return None;
        }
        match LockFile::existing(&dir.join(LOCK)) {
            Ok(LockAttempt::Held(lock)) => Some(Self {
                dir,
                lock: Some(lock),
                is_kept: false,
            }),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                // The folder has no lock file: its process died, or is just starting and will then try another name.
                let _ = fs::remove_dir(&dir);
                None
            }
            Ok(LockAttempt::Busy(_) | LockAttempt::Unsupported) | Err(_) => None,
        }
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Leaves the folder on the disk. Its lock ends, so that the next command finds it stale.
    pub(super) fn keep(mut self) {
        self.is_kept = true;
    }

    /// Removes the folder with its content.
    ///
    /// # Errors
    /// Returns an error if something cannot be removed. The next command for the same output tries again.
    pub fn remove(mut self) -> Result<()> {
        self.is_kept = true;
        self.clear()
    }

    /// Removes the content, then the lock, then the folder, so that an interrupted removal leaves a stale folder.
    fn clear(&mut self) -> Result<()> {
        for entry in fs::read_dir(&self.dir)? {
            let entry = entry?;
            if entry.file_name() == LOCK {
                continue;
            }
            if entry.file_type()?.is_dir() {
                fs::remove_dir_all(entry.path())?;
            } else {
                fs::remove_file(entry.path())?;
            }
        }
        match self.lock.take() {
            Some(lock) => lock.remove()?,
            None => fs::remove_file(self.dir.join(LOCK))?,
        }
        match fs::remove_dir(&self.dir) {
            // Another process found the folder without its lock.
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            removed => removed,
        }
    }
}

impl Drop for StagingFolder {
    fn drop(&mut self) {
        if !self.is_kept {
            // The next command for the same output removes what is left.
            let _ = self.clear();
        }
    }
}

/// Returns the path of a hidden file or folder next to an output: `.NAME.ENDING`. A long name is shortened, and its
/// hash then keeps the hidden name unique.
pub(super) fn hidden_sibling(target: &Path, ending: &str) -> PathBuf {
    let name = target.file_name().unwrap_or_default();
    let mut hidden = OsString::from(".");
    if name.len() <= MAX_STEM {
        hidden.push(name);
    } else {
        let mut end = MAX_STEM;
        let bytes = name.as_encoded_bytes();
        // Bytes of the form 10xxxxxx continue a character of UTF-8.
        while end > 0 && bytes[end] & 0xc0 == 0x80 {
            end -= 1;
        }
        hidden.push(file_name_of(&bytes[..end]));
        hidden.push(format!("-{}", &blake3::hash(bytes).to_hex()[..8]));
    }
    hidden.push(".");
    hidden.push(ending);
    parent_folder(target).join(hidden)
}

/// Returns whether a name is that of a staging folder of an output.
pub(super) fn is_staging_of(target: &Path, name: &OsStr) -> bool {
    let own = hidden_sibling(target, "");
    is_staging_name(name, own.file_name().unwrap_or_default())
}

/// Returns whether a name is that of a staging folder: the prefix, a pid, a number and the suffix.
fn is_staging_name(name: &OsStr, prefix: &OsStr) -> bool {
    let unique = name
        .as_encoded_bytes()
        .strip_prefix(prefix.as_encoded_bytes())
        .and_then(|rest| rest.strip_suffix(SUFFIX.as_bytes()));
    let is_number = |text: &[u8]| !text.is_empty() && text.iter().all(u8::is_ascii_digit);
    unique.is_some_and(|unique| {
        let mut parts = unique.splitn(2, |byte| *byte == b'-');
        parts.next().is_some_and(is_number) && parts.next().is_some_and(is_number)
    })
}

#[cfg(test)]
mod tests {
    use super::{LOCK, StagingFolder, hidden_sibling};
    use std::fs;
    use std::path::Path;

    fn count(dir: &Path) -> usize {
        fs::read_dir(dir).expect("a folder").count()
    }

    #[test]
    fn folders_of_living_processes_stay_and_those_of_dead_ones_are_removed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let target = dir.path().join("out");
        let (alive, dead) = (
            StagingFolder::beside(&target),
            StagingFolder::beside(&target),
        );
        let (alive, dead) = (alive.expect("a folder"), dead.expect("a folder"));
        assert_ne!(alive.path(), dead.path());
        fs::write(dead.path().join("half"), "half").expect("written");
        let left = dead.path().to_owned();
        dead.keep();
        // A process that died before it created its lock.
        fs::create_dir(hidden_sibling(&target, "1-0.mocban-partial")).expect("a folder");
        let foreign = [
            ".out.mine.mocban-partial",
            ".out.txt.1-0.mocban-partial",
            ".out.1-0.mocban-part",
        ];
        for name in foreign {
            fs::create_dir(dir.path().join(name)).expect("a folder");
        }
        assert!(left.join(LOCK).is_file());
        let next = StagingFolder::beside(&target).expect("a folder");
        assert!(!left.exists());
        assert!(alive.path().exists() && next.path().exists());
        assert_eq!(count(dir.path()), 2 + foreign.len());
        alive.remove().expect("removed");
        drop(next);
        assert_eq!(count(dir.path()), foreign.len());
    }

    #[test]
    fn hidden_names_fit_the_file_system_and_differ() {
        let name =
            |letter: &str| hidden_sibling(Path::new(&letter.repeat(83)), "1-1.mocban-partial");
        let (long, other) = (name("字字字"), name("字字音"));
        let length = |path: &Path| path.file_name().expect("a name").len();
        assert!(length(&long) < 230 && length(&other) < 230);
        assert!(long.to_str().is_some());
        let same_start = |end: &str| format!("{}{end}", "a".repeat(250));
        let [one, two] = ["1", "2"].map(|end| hidden_sibling(Path::new(&same_start(end)), ""));
        assert_ne!(one, two);
        let dir = tempfile::tempdir().expect("a temporary directory");
        let longest = dir.path().join("a".repeat(255));
        drop(StagingFolder::beside(&longest).expect("a folder"));
        if cfg!(unix) {
            let too_long = StagingFolder::beside(&dir.path().join("a".repeat(256)));
            let error = too_long.expect_err("no such file can exist").to_string();
            assert!(error.contains("name too long"), "{error}");
        }
        assert_eq!(count(dir.path()), 0);
    }
}
