//! Operations on Unix. Functions that need Linux return `None` on other systems.

use std::ffi::OsString;
use std::fs::{File, FileType, Metadata, OpenOptions, Permissions};
use std::io;
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::fs::{
    FileTypeExt as _, MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _,
};
use std::path::{Path, PathBuf};

use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::task::JoinHandle;

use super::{DeviceNumber, FileId, FileStat, ProcessMemory};

fn stat_of(meta: &Metadata) -> FileStat {
    FileStat {
        id: FileId {
            device: meta.dev(),
            inode: meta.ino(),
        },
        len: meta.len(),
    }
}

/// Returns identity and length of a file or folder. Follows links.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn stat(path: &Path) -> io::Result<FileStat> {
    std::fs::metadata(path).map(|meta| stat_of(&meta))
}

/// Returns identity and length of a file or folder, or of a link.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn stat_link(path: &Path) -> io::Result<FileStat> {
    std::fs::symlink_metadata(path).map(|meta| stat_of(&meta))
}

/// Returns identity and length of an open file.
pub fn stat_open(file: &File) -> io::Result<FileStat> {
    file.metadata().map(|meta| stat_of(&meta))
}

/// Returns a number that changes if another file replaces this one at its path: the inode.
pub fn generation(meta: &Metadata) -> u64 {
    meta.ino()
}

/// Returns device and inode of a file as `/proc` shows them, or `None` on other systems than Linux.
#[cfg(target_os = "linux")]
pub fn device_number(path: &Path) -> Option<DeviceNumber> {
    let meta = std::fs::metadata(path).ok()?;
    Some(DeviceNumber {
        major: rustix::fs::major(meta.dev()),
        minor: rustix::fs::minor(meta.dev()),
        inode: meta.ino(),
    })
}

#[cfg(not(target_os = "linux"))]
pub fn device_number(_path: &Path) -> Option<DeviceNumber> {
    None
}

/// Returns the number of a folder's file system (`f_type` of statfs(2)), or `None` on other systems than Linux.
#[cfg(target_os = "linux")]
pub fn file_system_magic(folder: &Path) -> Option<u64> {
    let magic = rustix::fs::statfs(folder).ok()?.f_type;
    Some(u64::try_from(magic).ok()? & 0xffff_ffff)
}

#[cfg(not(target_os = "linux"))]
pub fn file_system_magic(_folder: &Path) -> Option<u64> {
    None
}

/// Returns whether this process may write to a file, or add files to a folder, on a disk that can be written to.
pub fn may_write(path: &Path) -> bool {
    use rustix::fs::{Access, AtFlags, CWD, accessat};
    accessat(CWD, path, Access::WRITE_OK, AtFlags::EACCESS).is_ok()
}

/// Returns whether the disk of a folder has no room for another file or for more bytes.
pub fn is_disk_full(folder: &Path) -> bool {
    rustix::fs::statvfs(folder).is_ok_and(|disk| {
        // Some file systems do not count their files.
        disk.f_bavail == 0 || disk.f_files > 0 && disk.f_favail == 0
    })
}

/// Returns how many bytes a user can still store on the disk of a folder.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    disk.f_bavail.checked_mul(disk.f_frsize)
}

/// Makes a command start a process that signals of this terminal do not reach.
pub fn detach(command: &mut std::process::Command) {
    use std::os::unix::process::CommandExt as _;
    command.process_group(0);
}

/// Returns the number of the signal that ended a process, if one did.
pub fn ending_signal(status: std::process::ExitStatus) -> Option<i32> {
    use std::os::unix::process::ExitStatusExt as _;
    status.signal()
}

/// Sends a process of this computer what Ctrl-C sends.
///
/// # Errors
/// Returns an error if there is no such process, or it belongs to another user.
pub fn interrupt(pid: u32) -> io::Result<()> {
    let pid = i32::try_from(pid)
        .ok()
        .and_then(rustix::process::Pid::from_raw);
    let pid = pid.ok_or(io::ErrorKind::NotFound)?;
    Ok(rustix::process::kill_process(
        pid,
        rustix::process::Signal::INT,
    )?)
}

/// Returns `false`: only Windows names the shares of other machines in paths.
pub const fn is_share(_folder: &Path) -> bool {
    false
}

/// Returns the absolute path with all links resolved.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn canonicalize(path: &Path) -> io::Result<PathBuf> {
    std::fs::canonicalize(path)
}

/// Opens a file for reading. Does not wait for the writer of a pipe.
pub fn open_without_waiting(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    let without_waiting = OFlags::NONBLOCK | OFlags::NOCTTY;
    options.custom_flags(without_waiting.bits().cast_signed());
    options.open(path)
}

/// Lets reads of a file wait that [`open_without_waiting`] opened.
pub fn let_reads_wait(file: &File) -> io::Result<()> {
    Ok(fcntl_setfl(file, OFlags::empty())?)
}

/// Returns whether an entry is a pipe with a name.
pub fn is_pipe(file_type: FileType) -> bool {
    file_type.is_fifo()
}

/// Returns whether an entry is a socket.
pub fn is_socket(file_type: FileType) -> bool {
    file_type.is_socket()
}

/// Opens a folder, to lock it or to make the names in it durable.
pub fn open_folder(folder: &Path) -> io::Result<File> {
    File::open(folder)
}

/// Makes the names in an open folder durable.
pub fn sync_names(folder: &File) -> io::Result<()> {
    folder.sync_all()
}

/// Makes the content of a file durable.
pub fn sync_file(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// Makes a folder with all its files durable: syncs its file system.
#[cfg(target_os = "linux")]
pub fn sync_tree(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(File::open(folder)?)?)
}

#[cfg(not(target_os = "linux"))]
pub fn sync_tree(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Renames a file or folder; replaces an existing file atomically.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    std::fs::rename(from, to)
}

/// Swaps two folders atomically. Returns `false` if that fails, as on file systems that cannot swap.
#[cfg(target_os = "linux")]
pub fn exchange(one: &Path, other: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
pub fn exchange(_one: &Path, _other: &Path) -> bool {
    false
}

/// Lets all users read the temporary files that a builder creates. By default, only their owner may.
pub fn let_all_read(builder: &mut tempfile::Builder) {
    builder.permissions(Permissions::from_mode(0o644));
}

/// Returns the file name with these bytes of an `OsStr`, which must end at the end of a character.
pub fn file_name_of(bytes: &[u8]) -> OsString {
    OsString::from_vec(bytes.to_vec())
}

/// Returns a path below a folder with slashes between its parts, so that all systems can read it.
pub fn with_slashes(path: String) -> String {
    path
}

/// Ends the lock of an open file.
pub fn unlock(file: &File) -> io::Result<()> {
    file.unlock()
}

/// Returns whether an error of a lock means that the file system has no locks.
pub fn is_without_locks(error: &io::Error) -> bool {
    let codes = [
        Errno::NOTSUP,
        Errno::NOSYS,
        Errno::NOLCK,
        Errno::INVAL,
        Errno::BADF,
    ];
    codes.iter().any(|code| is_code(error, *code))
}

/// Returns whether this process has too many open files.
pub fn is_out_of_files(error: &io::Error) -> bool {
    is_code(error, Errno::MFILE)
}

/// Returns whether all processes together have too many open files.
pub fn is_system_out_of_files(error: &io::Error) -> bool {
    is_code(error, Errno::NFILE)
}

fn is_code(error: &io::Error, code: Errno) -> bool {
    error.raw_os_error() == Some(code.raw_os_error())
}

/// Returns the number of files that this process may have open at the same time.
pub fn max_open_files() -> u64 {
    getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX)
}

/// Returns an error if this process cannot open that many more files now.
pub fn check_free_files(count: usize) -> io::Result<()> {
    let files: io::Result<Vec<_>> = (0..count).map(|_| std::fs::File::open("/")).collect();
    files.map(drop)
}

/// Returns the name of this machine.
pub fn host_name() -> String {
    let system = rustix::system::uname();
    system.nodename().to_string_lossy().into_owned()
}

/// Returns the memory of this process (`proc_pid_status(5)`), or `None` on other systems than Linux.
pub fn process_memory() -> Option<ProcessMemory> {
    parse_memory(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn parse_memory(status: &str) -> Option<ProcessMemory> {
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        kib.checked_mul(1024)
    };
    Some(ProcessMemory {
        resident: field("VmRSS:")?,
        peak: field("VmHWM:")?,
    })
}

/// Calls a function at each Ctrl-C, SIGTERM and SIGHUP until the handle is aborted. SIGHUP stays ignored if it was
/// ignored when this process started, as under `nohup`.
pub fn watch_signals(on_signal: impl Fn() + Send + 'static) -> io::Result<JoinHandle<()>> {
    let is_ignored = IgnoredSignals::of_this_process().contains(SignalKind::hangup());
    let hang_up = (!is_ignored).then(|| signal(SignalKind::hangup()));
    let mut hang_up = hang_up.transpose()?;
    let mut interrupt = Some(signal(SignalKind::interrupt())?);
    let mut terminate = Some(signal(SignalKind::terminate())?);
    Ok(tokio::spawn(async move {
        loop {
            tokio::select! {
                () = next(&mut interrupt) => on_signal(),
                () = next(&mut terminate) => on_signal(),
                () = next(&mut hang_up) => on_signal(),
            };
        }
    }))
}

/// Waits for a signal. Never returns if the signal is not watched.
async fn next(signal: &mut Option<Signal>) {
    let received = match signal {
        Some(signal) => signal.recv().await,
        None => None,
    };
    if received.is_none() {
        std::future::pending::<()>().await;
    }
}

/// The signals that this process ignores, as a bit mask in which bit 0 is signal 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct IgnoredSignals(u64);

impl IgnoredSignals {
    /// Reads the mask that Linux shows (`proc_pid_status(5)`). On other systems no signal counts as ignored.
    fn of_this_process() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        Self::parse(&status)
    }

    fn parse(status: &str) -> Self {
        let mask = status
            .lines()
            .find_map(|line| line.strip_prefix("SigIgn:"))
            .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        Self(mask.unwrap_or(0))
    }

    fn contains(self, kind: SignalKind) -> bool {
        let bit = kind.as_raw_value() - 1;
        self.0 >> bit & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use tokio::signal::unix::SignalKind;

    use super::{Errno, IgnoredSignals, ProcessMemory, is_without_locks, parse_memory};

    #[test]
    fn ignored_signals_are_read_from_the_mask() {
        let ignored =
            IgnoredSignals::parse("SigBlk:\t0000000000000002\nSigIgn:\t0000000000001001\n");
        assert!(ignored.contains(SignalKind::hangup()));
        assert!(!ignored.contains(SignalKind::interrupt()));
        assert!(!ignored.contains(SignalKind::terminate()));
        assert_eq!(IgnoredSignals::parse("Name:\tmocban\n"), IgnoredSignals(0));
    }

    #[test]
    fn memory_is_read_in_bytes() {
        let status =
            "Name:\tmocban\nVmPeak:\t  9000 kB\nVmHWM:\t    2048 kB\nVmRSS:\t    1024 kB\n";
        let memory = ProcessMemory {
            resident: 1 << 20,
            peak: 2 << 20,
        };
        assert_eq!(parse_memory(status), Some(memory));
        assert_eq!(parse_memory("VmRSS: 1 kB\n"), None);
    }

    #[test]
    fn missing_support_for_locks_differs_from_a_failing_disk() {
        let error = |code: Errno| std::io::Error::from(code);
        assert!(is_without_locks(&error(Errno::NOTSUP)));
        assert!(!is_without_locks(&error(Errno::IO)));
    }
}
