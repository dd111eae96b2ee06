//! Locks that show which processes work on a project. The operating system releases the locks of a process that ends.
//!
//! The process that owns the run locks `run.lock` and writes its pid into the file. Every working process holds a
//! shared lock on `run.members`. A process that gets an exclusive lock on `run.members` knows that no other process
//! works.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::Project;
use super::input_error::InputError;
use super::open_file::open_regular;
use mocban_system::platform::unlock;

/// Name of the file on which every working process holds a shared lock.
const MEMBERS: &str = "run.members";

/// Attempts to get the exclusive lock. [`RunLock::is_held`] of another process may hold the lock for a moment, which a busy
/// machine makes longer. Without the exclusive lock, a run would wait for the leases of dead workers to end.
const ATTEMPTS: u32 = 200;
const RETRY_AFTER: Duration = Duration::from_millis(5);

/// The right to work on a project. It ends when the value is dropped or the process dies.
#[derive(Debug)]
pub struct RunLock {
    /// The locked `run.lock`, in the process that owns the run.
    #[cfg_attr(
        not(test),
        expect(dead_code, reason = "the lock is held until this is dropped")
    )]
    owner: Option<File>,
    members: File,
    /// Path of `members`.
    path: PathBuf,
    is_exclusive: bool,
}

/// Why the lock could not be acquired.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process runs the project.
    #[error("the project is in use{}", .pid.map_or_else(String::new, |pid| format!(" by pid {pid}")))]
    InUse {
        /// Its pid, if the lock file holds it.
        pid: Option<u32>,
    },
    /// A lock file cannot be used.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl RunLock {
    /// Acquires the right to work on a project. If `join` is set, another process may already own the run.
    ///
    /// # Errors
    /// Returns an error if another process owns the run and `join` is not set, or if a lock file cannot be used.
    pub fn acquire(project: &Project, join: bool) -> Result<Self, LockError> {
        let path = project.dir().join("run.lock");
        let mut file = open(&path)?;
        let owner = match file.try_lock() {
            Ok(()) => {
                replace_text(&mut file, &std::process::id().to_string()).map_err(io(&path))?;
                Some(file)
            }
            Err(TryLockError::WouldBlock) if join => None,
            Err(TryLockError::WouldBlock) => {
                let pid = read_pid(&mut file);
                return Err(LockError::InUse { pid });
            }
            Err(TryLockError::Error(source)) => return Err(LockError::Io { path, source }),
        };
        let path = project.dir().join(MEMBERS);
        let members = open(&path)?;
        let is_exclusive = owner.is_some() && try_exclusive(&members);
        if !is_exclusive {
            members.lock_shared().map_err(io(&path))?;
        }
        Ok(Self {
            owner,
            members,
            path,
            is_exclusive,
        })
    }

    /// Returns whether a process is working on the project, or this cannot be found out. A process may start right after
    /// the check.
    pub fn is_held(project: &Project) -> bool {
        // A lock needs no permission to write.
        match open_regular(&project.dir().join(MEMBERS)) {
            Ok((members, _)) => matches!(members.try_lock(), Err(TryLockError::WouldBlock)),
            Err(error) => !matches!(error, InputError::NotThere(_)),
        }
    }

    /// Returns whether this process excludes all others from the project. [`RunLock::downgrade`] lets others join.
    pub const fn is_exclusive(&self) -> bool {
        self.is_exclusive
    }

    /// Writes this run's settings. Joining processes compare them with their own. Call this function only while the
    /// lock is exclusive.
    pub fn set_settings(&mut self, settings: &str) -> Result<(), LockError> {
        replace_text(&mut self.members, settings).map_err(io(&self.path))
    }

    /// Returns the working processes' settings, or an empty text if none were written.
    pub fn settings(&mut self) -> Result<String, LockError> {
        let mut text = String::new();
        self.members
            .seek(SeekFrom::Start(0))
            .and_then(|_| self.members.read_to_string(&mut text))
            .map_err(io(&self.path))?;
        Ok(text)
    }

    /// Lets other processes join from now on.
    pub fn downgrade(&mut self) -> Result<(), LockError> {
        if self.is_exclusive {
            unlock(&self.members).map_err(io(&self.path))?;
            self.members.lock_shared().map_err(io(&self.path))?;
            self.is_exclusive = false;
        }
        Ok(())
    }
}

/// Tries to lock the file exclusively. Repeats the attempt, because [`RunLock::is_held`] takes the lock for a moment.
fn try_exclusive(members: &File) -> bool {
    for _ in 0..ATTEMPTS {
        if members.try_lock().is_ok() {
            return true;
        }
        std::thread::sleep(RETRY_AFTER);
    }
    false
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> LockError {
    let path = path.to_owned();
    move |source| LockError::Io { path, source }
}

fn open(path: &Path) -> Result<File, LockError> {
    OpenOptions::new()
        .create(true)
        .truncate(false)
        .read(true)
        .write(true)
        .open(path)
        .map_err(io(path))
}

fn replace_text(file: &mut File, text: &str) -> std::io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text.as_bytes())
}

/// Returns the pid in the file. Returns `None` if the file contains no pid yet.
fn read_pid(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::{LockError, RunLock};
    use crate::Project;

    #[test]
    fn a_second_run_is_refused_with_the_owners_pid_and_may_join() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        assert!(owner.owner.is_some() && owner.is_exclusive());
        let refused = RunLock::acquire(&project, false).expect_err("in use");
        let me = std::process::id();
        assert!(matches!(refused, LockError::InUse { pid: Some(pid) } if pid == me));
        owner.downgrade().expect("a shared lock");
        let joined = RunLock::acquire(&project, true).expect("joined");
        assert!(joined.owner.is_none() && !joined.is_exclusive());
    }

    #[test]
    fn an_owner_beside_a_joined_process_has_no_exclusive_lock() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut first = RunLock::acquire(&project, false).expect("the lock");
        first.downgrade().expect("a shared lock");
        let joined = RunLock::acquire(&project, true).expect("joined");
        drop(first);
        let second = RunLock::acquire(&project, false).expect("the lock");
        assert!(second.owner.is_some() && !second.is_exclusive());
        drop((second, joined));
        assert!(
            RunLock::acquire(&project, true)
                .expect("the lock")
                .is_exclusive()
        );
    }

    #[test]
    fn it_is_seen_whether_a_process_works_without_keeping_any_out() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        assert!(!RunLock::is_held(&project));
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        assert!(RunLock::is_held(&project));
        owner.downgrade().expect("a shared lock");
        assert!(RunLock::is_held(&project));
        drop(owner);
        assert!(!RunLock::is_held(&project));
        let members = dir.path().join(super::MEMBERS);
        std::fs::remove_file(&members).expect("removed");
        std::fs::create_dir(&members).expect("no file");
        assert!(RunLock::is_held(&project), "nobody knows");
    }

    #[test]
    fn joining_process_reads_the_fingerprints_of_the_first() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        owner.set_settings("longer than the next").expect("written");
        owner.set_settings("in mm").expect("written");
        owner.downgrade().expect("a shared lock");
        let mut joined = RunLock::acquire(&project, true).expect("joined");
        assert_eq!(joined.settings().expect("read"), "in mm");
    }
}
