//! Lock files. The operating system releases the lock of a process that ends, so a file without a lock is stale.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read as _, Result, Write as _};
use std::path::{Path, PathBuf};

use mocban_system::platform::{is_without_locks, stat_link, stat_open};

/// Number of attempts to lock a file that other processes keep removing.
const ATTEMPTS: u32 = 100;

/// A locked file. Dropping it ends the lock and leaves the file.
#[derive(Debug)]
pub(super) struct LockFile {
    file: File,
    path: PathBuf,
}

/// The outcome of an attempt to lock a file.
#[derive(Debug)]
pub(super) enum LockAttempt {
    /// This process has the lock.
    Held(LockFile),
    /// Another process has the lock. Its pid is known if the process has written it to the file.
    Busy(Option<u32>),
    /// The file system has no locks.
    Unsupported,
}

impl LockFile {
    /// Tries to lock a file, which is created if it does not exist. Writes the pid of this process to the file.
    pub(super) fn create(path: &Path) -> Result<LockAttempt> {
        let mut options = OpenOptions::new();
        options.create(true).truncate(false).read(true).write(true);
        let mut attempt = attempt(&options, path)?;
        if let LockAttempt::Held(lock) = &mut attempt {
            // The pid only improves messages of other processes. The lock works without it.
            let pid = std::process::id().to_string();
            let _ = lock.file.set_len(0);
            let _ = lock.file.write_all(pid.as_bytes());
        }
        Ok(attempt)
    }

    /// Tries to lock an existing file.
    ///
    /// # Errors
    /// Returns an error if the file does not exist, or cannot be opened or locked.
    pub(super) fn existing(path: &Path) -> Result<LockAttempt> {
        // On a network file system, an exclusive lock needs the permission to write.
        attempt(OpenOptions::new().read(true).write(true), path)
    }

    /// Removes the file and ends the lock. A process that has already opened the file notices the removal.
    pub(super) fn remove(self) -> Result<()> {
        std::fs::remove_file(&self.path)
    }
}

fn attempt(options: &OpenOptions, path: &Path) -> Result<LockAttempt> {
    for _ in 0..ATTEMPTS {
        let mut file = options.open(path)?;
        match file.try_lock() {
            Ok(()) if is_at(&file, path)? => {
                let path = path.to_owned();
                return Ok(LockAttempt::Held(LockFile { file, path }));
            }
            // The previous owner removed the file after it was opened here.
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(LockAttempt::Busy(read_pid(&mut file))),
            Err(TryLockError::Error(error)) if is_without_locks(&error) => {
                return Ok(LockAttempt::Unsupported);
            }
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Ok(LockAttempt::Busy(None))
}

/// Returns whether an open file still has this path.
fn is_at(file: &File, path: &Path) -> Result<bool> {
    let open = stat_open(file)?;
    match stat_link(path) {
        Ok(found) => Ok(found.id == open.id),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Returns the pid in the file. Returns `None` if the file contains no pid yet.
fn read_pid(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::{LockAttempt, LockFile};

    #[test]
    fn one_process_holds_the_lock_and_others_learn_its_pid() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("lock");
        assert!(LockFile::existing(&path).is_err());
        let Ok(LockAttempt::Held(lock)) = LockFile::create(&path) else {
            unreachable!("nobody else knows the file");
        };
        let me = std::process::id();
        for attempt in [LockFile::create(&path), LockFile::existing(&path)] {
            assert!(matches!(attempt, Ok(LockAttempt::Busy(Some(pid))) if pid == me));
        }
        lock.remove().expect("removed");
        assert!(!path.exists());
        assert!(matches!(LockFile::create(&path), Ok(LockAttempt::Held(_))));
        // The lock ended when it was dropped; the file is stale.
        let stale = LockFile::existing(&path);
        assert!(matches!(stale, Ok(LockAttempt::Held(_))));
    }
}
