//! Who runs a project: locks of the operating system, which end with the process that holds them.
//!
//! `run.lock` is held by the one process that owns the run and tells its number. `run.members` is held in common by
//! every process that works, joined ones too: whoever gets it alone knows that no other worker lives.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::Project;

/// Name of the file that all who work hold in common.
const MEMBERS: &str = "run.members";

/// How often the lock of the members is asked for before it is believed that others have it: somebody who looks
/// whether anybody works has it for a moment.
const ASKED: u32 = 20;
const BETWEEN: Duration = Duration::from_millis(5);

/// The right to work on a project; ends when it is dropped or the process dies.
#[derive(Debug)]
pub struct RunLock {
    owner: Option<File>,
    members: File,
    /// Where the members' file lies.
    path: PathBuf,
    alone: bool,
}

/// Why the lock was not to be had.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process runs the project.
    #[error("the project is in use{}", .pid.map_or_else(String::new, |pid| format!(" by pid {pid}")))]
    InUse {
        /// Which, where the lock file tells.
        pid: Option<u32>,
    },
    /// The lock file cannot be used.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl RunLock {
    /// Takes the run of a project; with `join` also beside the process that has it.
    ///
    /// # Errors
    /// When another process has it and `join` is not set, or the files cannot be locked.
    pub fn acquire(project: &Project, join: bool) -> Result<Self, LockError> {
        let path = project.dir().join("run.lock");
        let mut file = open(&path)?;
        let owner = match file.try_lock() {
            Ok(()) => {
                write_over(&mut file, &std::process::id().to_string()).map_err(io(&path))?;
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
        let alone = owner.is_some() && nobody_else(&members);
        if !alone {
            members.lock_shared().map_err(io(&path))?;
        }
        Ok(Self {
            owner,
            members,
            path,
            alone,
        })
    }

    /// Whether a process works on the project now. Looks without keeping anybody out.
    pub fn is_held(project: &Project) -> bool {
        // A lock needs no right to write.
        match File::open(project.dir().join(MEMBERS)) {
            Ok(members) => matches!(members.try_lock(), Err(TryLockError::WouldBlock)),
            Err(_) => false,
        }
    }

    /// Whether no other process works on the project, until [`RunLock::admit`].
    pub const fn is_alone(&self) -> bool {
        self.alone
    }

    /// Whether this process owns the run and has not joined another's.
    pub const fn is_owner(&self) -> bool {
        self.owner.is_some()
    }

    /// Writes what those who join must agree to. Only while alone.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn set_terms(&mut self, terms: &str) -> Result<(), LockError> {
        write_over(&mut self.members, terms).map_err(io(&self.path))
    }

    /// What those who work already have agreed to; empty where nothing was written.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn terms(&mut self) -> Result<String, LockError> {
        let mut text = String::new();
        self.members
            .seek(SeekFrom::Start(0))
            .and_then(|_| self.members.read_to_string(&mut text))
            .map_err(io(&self.path))?;
        Ok(text)
    }

    /// Lets others join from here on.
    ///
    /// # Errors
    /// When the file cannot be locked in common.
    pub fn admit(&mut self) -> Result<(), LockError> {
        if self.alone {
            self.members.unlock().map_err(io(&self.path))?;
            self.members.lock_shared().map_err(io(&self.path))?;
            self.alone = false;
        }
        Ok(())
    }
}

/// Takes the members' lock for this process alone, if nobody else has it for longer than a look.
fn nobody_else(members: &File) -> bool {
    for _ in 0..ASKED {
        if members.try_lock().is_ok() {
            return true;
        }
        std::thread::sleep(BETWEEN);
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

fn write_over(file: &mut File, text: &str) -> std::io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    file.write_all(text.as_bytes())
}

/// The number in the file; `None` while its owner has not written it yet.
fn read_pid(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::{LockError, RunLock};
    use crate::store::Project;

    #[test]
    fn the_second_run_is_told_who_has_it_and_may_join() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        assert!(owner.is_owner() && owner.is_alone());
        let refused = RunLock::acquire(&project, false).expect_err("in use");
        let me = std::process::id();
        assert!(matches!(refused, LockError::InUse { pid: Some(pid) } if pid == me));
        owner.admit().expect("the lock in common");
        let joined = RunLock::acquire(&project, true).expect("joined");
        assert!(!joined.is_owner() && !joined.is_alone());
    }

    #[test]
    fn an_owner_beside_a_joined_process_is_not_alone() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut first = RunLock::acquire(&project, false).expect("the lock");
        first.admit().expect("the lock in common");
        let joined = RunLock::acquire(&project, true).expect("joined");
        drop(first);
        let second = RunLock::acquire(&project, false).expect("the lock");
        assert!(second.is_owner() && !second.is_alone());
        drop((second, joined));
        assert!(
            RunLock::acquire(&project, true)
                .expect("the lock")
                .is_alone()
        );
    }

    #[test]
    fn who_looks_sees_whether_anybody_works_and_disturbs_nobody() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        assert!(!RunLock::is_held(&project));
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        assert!(RunLock::is_held(&project));
        owner.admit().expect("the lock in common");
        assert!(RunLock::is_held(&project));
        drop(owner);
        assert!(!RunLock::is_held(&project));
    }

    #[test]
    fn who_joins_reads_the_terms_of_the_first() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut owner = RunLock::acquire(&project, false).expect("the lock");
        owner.set_terms("longer than the next").expect("written");
        owner.set_terms("in mm").expect("written");
        owner.admit().expect("the lock in common");
        let mut joined = RunLock::acquire(&project, true).expect("joined");
        assert_eq!(joined.terms().expect("read"), "in mm");
    }
}
