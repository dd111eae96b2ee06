//! Finds the process that holds the catalog's write lock.

use std::fmt;
use std::path::{Path, PathBuf};

use mocban_system::platform::{DeviceNumber, device_number};

/// Offset of the byte in the `-shm` file that a writer locks (see "WAL-index locks" in SQLite's file format).
const WRITE_LOCK: &str = "120";

/// A process that holds the write lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LockOwner {
    /// Its process id.
    pub pid: u32,
    /// Whether the process is stopped by a signal. A stopped process keeps the lock until it is continued.
    pub is_stopped: bool,
}

impl fmt::Display for LockOwner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pid, is_stopped } = self;
        write!(f, "pid {pid}")?;
        if *is_stopped {
            write!(f, ", which is stopped (`kill -CONT {pid}` lets it go on)")?;
        }
        Ok(())
    }
}

/// Returns the process that holds the write lock, or `None` if no such process is found, as on systems other than Linux. Does not open the catalog's
/// files, because closing them again would drop the locks of this process's own connections.
pub fn lock_owner(catalog: &Path) -> Option<LockOwner> {
    let DeviceNumber {
        major,
        minor,
        inode,
    } = device_number(&sidecar(catalog, "-shm"))?;
    let file = format!("{major:02x}:{minor:02x}:{inode}");
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    let pid = locks.lines().find_map(|line| writer(line, &file))?;
    let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    Some(LockOwner {
        pid,
        is_stopped: is_stopped(&state),
    })
}

/// How much a process has computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OwnerWork {
    pub(crate) pid: u32,
    /// Time on the processors, in hundredths of a second.
    pub(crate) cpu_cs: u64,
}

/// Returns how much the process that holds the write lock has computed. Returns `None` if no such process is found, if it
/// is stopped, or if it is this process.
pub(crate) fn owner_work(catalog: &Path) -> Option<OwnerWork> {
    let LockOwner { pid, is_stopped } = lock_owner(catalog)?;
    if is_stopped || pid == std::process::id() {
        return None;
    }
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let cpu_cs = cpu_cs(&stat)?;
    Some(OwnerWork { pid, cpu_cs })
}

/// Returns the sum of the times in user and system mode from a text of `/proc/PID/stat`: its fields 14 and 15. The name
/// in parentheses is the second.
fn cpu_cs(stat: &str) -> Option<u64> {
    let (_, after_name) = stat.rsplit_once(") ")?;
    let mut times = after_name.split(' ').skip(11);
    let [user, system] = [times.next()?, times.next()?];
    Some(user.parse::<u64>().ok()? + system.parse::<u64>().ok()?)
}

/// Returns the path of a file that SQLite keeps next to the catalog, such as `-wal`.
pub(crate) fn sidecar(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// Returns the process id in a line of `/proc/locks`, if the line describes the write lock on `file`.
fn writer(line: &str, file: &str) -> Option<u32> {
    let words: Vec<_> = line.split_whitespace().collect();
    let [_, "POSIX", _, "WRITE", pid, of, WRITE_LOCK, _] = words[..] else {
        return None;
    };
    (of == file).then(|| pid.parse().ok())?
}

/// Returns whether a text from `/proc/PID/stat` shows a stopped process. The state follows the name in parentheses.
fn is_stopped(stat: &str) -> bool {
    let state = stat.rsplit(") ").next();
    state.is_some_and(|state| state.starts_with('T'))
}

#[cfg(test)]
mod tests {
    use super::{cpu_cs, is_stopped, writer};

    #[test]
    fn only_the_lock_for_writing_to_this_file_tells_who_writes() {
        let file = "fe:00:827";
        let line = "1: POSIX  ADVISORY  WRITE 8118 fe:00:827 120 120";
        assert_eq!(writer(line, file), Some(8118));
        for other in [
            "1: POSIX  ADVISORY  READ 8118 fe:00:827 120 120",
            "1: POSIX  ADVISORY  WRITE 8118 fe:00:827 121 121",
            "1: POSIX  ADVISORY  WRITE 8118 fe:00:828 120 120",
            "1: FLOCK  ADVISORY  WRITE 8118 fe:00:827 0 EOF",
            "1: -> POSIX  ADVISORY  WRITE 8118 fe:00:827 120 120",
        ] {
            assert_eq!(writer(other, file), None, "{other}");
        }
    }

    #[test]
    fn computing_time_is_read_whatever_the_name() {
        let stat = "12 (a) R 7) S 1 12 12 0 -1 4194560 1 0 0 0 250 31 9 9 20 0 1 0 5";
        assert_eq!(cpu_cs(stat), Some(281));
        assert_eq!(cpu_cs("12 (a) S 1"), None);
    }

    #[test]
    fn a_stopped_process_is_told_whatever_its_name() {
        assert!(is_stopped("12 (a) R b) T 1 12"));
        assert!(!is_stopped("12 (a) T b) S 1 12"));
        assert!(!is_stopped(""));
    }
}
