//! A lock on an output, so that only one process at a time replaces the output.

use std::path::{Path, PathBuf};

use super::lock_file::{LockAttempt, LockFile};
use super::staging::hidden_sibling;
use mocban_core::domain::{ErrorCode, Explained};

/// The right to replace an output. It ends when the value is dropped or the process dies.
#[derive(Debug)]
pub struct TargetLock {
    /// `None` on a file system without locks. Outputs are still replaced as a whole; the last writer wins.
    lock: Option<LockFile>,
}

/// Why an output cannot be replaced now.
#[derive(Debug, thiserror::Error)]
pub enum TargetLockError {
    /// Another process writes the same output.
    #[error(
        "{path} is being written by another process{}; wait until that process has ended, or choose another name",
        .pid.map_or_else(String::new, |pid| format!(" (pid {pid})"))
    )]
    InUse {
        /// The output.
        path: PathBuf,
        /// The pid of the other process, if its lock file holds the pid.
        pid: Option<u32>,
    },
    /// The lock file cannot be used.
    #[error("{path}: {source}")]
    Io {
        /// The output.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl Explained for TargetLockError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::InUse { .. } => ErrorCode::OutputInUse,
            Self::Io { .. } => ErrorCode::Unexpected,
        }
    }
}

impl TargetLock {
    /// Acquires the right to replace an output by locking a hidden file next to it. The output need not exist.
    ///
    /// # Errors
    /// Returns an error if another process has the lock, or the lock file cannot be used.
    pub fn acquire(target: &Path) -> Result<Self, TargetLockError> {
        let path = target.to_owned();
        let lock_path = hidden_sibling(target, "mocban-lock");
        match LockFile::create(&lock_path) {
            Ok(LockAttempt::Held(lock)) => Ok(Self { lock: Some(lock) }),
            Ok(LockAttempt::Unsupported) => {
                // Without locks, the file has no use.
                let _ = std::fs::remove_file(lock_path);
                Ok(Self { lock: None })
            }
            Ok(LockAttempt::Busy(pid)) => Err(TargetLockError::InUse { path, pid }),
            Err(source) => Err(TargetLockError::Io { path, source }),
        }
    }
}

impl Drop for TargetLock {
    fn drop(&mut self) {
        if let Some(lock) = self.lock.take() {
            // If the file cannot be removed, its lock still ends, so the next command can lock it again.
            let _ = lock.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{TargetLock, TargetLockError};

    #[test]
    fn second_writer_is_refused_until_the_first_has_ended() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let target = dir.path().join("out");
        let first = TargetLock::acquire(&target).expect("nobody writes");
        let second = TargetLock::acquire(&target).expect_err("in use");
        let me = std::process::id();
        assert!(matches!(second, TargetLockError::InUse { pid: Some(pid), .. } if pid == me));
        TargetLock::acquire(&dir.path().join("other")).expect("another output");
        drop(first);
        drop(TargetLock::acquire(&target).expect("nobody writes"));
        assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 0);
    }
}
