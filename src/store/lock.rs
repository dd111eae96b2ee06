//! Who runs a project: locks of the operating system, which end with the process that holds them.
//!
//! `run.lock` is held by the one process that owns the run and tells its number. `run.members` is held in common by
//! every process that works, joined ones too: whoever gets it alone knows that no other worker lives.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use super::Project;

/// Name of the file that all who work hold in common.
const MEMBERS: &str = "run.members";

/// The right to work on a project; ends when it is dropped or the process dies.
#[derive(Debug)]
pub struct RunLock {
    owner: Option<File>,
    members: File,
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
                write_pid(&mut file).map_err(io(&path))?;
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
        let alone = owner.is_some() && members.try_lock().is_ok();
        if !alone {
            members.lock_shared().map_err(io(&path))?;
        }
        Ok(Self {
            owner,
            members,
            alone,
        })
    }

    /// Whether a process works on the project now. Looks without keeping anybody out: a run that begins in this very
    /// moment goes on, it only takes some seconds longer to find out that it is alone.
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

    /// Lets others join from here on.
    ///
    /// # Errors
    /// When the file cannot be locked in common.
    pub fn admit(&mut self) -> Result<(), LockError> {
        if self.alone {
            let path = Path::new(MEMBERS);
            self.members.unlock().map_err(io(path))?;
            self.members.lock_shared().map_err(io(path))?;
            self.alone = false;
        }
        Ok(())
    }
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

fn write_pid(file: &mut File) -> std::io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    write!(file, "{}", std::process::id())
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
        assert!(RunLock::is_held(&project));
        let refused = RunLock::acquire(&project, false).expect_err("in use");
        let me = std::process::id();
        assert!(matches!(refused, LockError::InUse { pid: Some(pid) } if pid == me));
        owner.admit().expect("the lock in common");
        let joined = RunLock::acquire(&project, true).expect("joined");
        assert!(!joined.is_owner() && !joined.is_alone());
        assert!(RunLock::is_held(&project));
        drop((owner, joined));
        assert!(!RunLock::is_held(&project));
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
}
