//! Operations on Windows.

use std::ffi::OsString;
use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io;
use std::os::windows::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Component, Path, PathBuf, Prefix};
use std::time::Duration;

use tokio::signal::windows::{ctrl_break, ctrl_c, ctrl_close, ctrl_shutdown};
use tokio::task::JoinHandle;

use super::{DeviceNumber, FileId, FileStat, ProcessMemory};

/// Opens a folder like a file (`FILE_FLAG_BACKUP_SEMANTICS` of `CreateFileW`).
const FOLDERS_TOO: u32 = 0x0200_0000;
/// Opens a link instead of its target (`FILE_FLAG_OPEN_REPARSE_POINT` of `CreateFileW`).
const LINK_ITSELF: u32 = 0x0020_0000;
/// Number of attempts to rename a file that is in use, before the last one.
const RENAME_ATTEMPTS: u32 = 200;
const RETRY_RENAME_AFTER: Duration = Duration::from_millis(5);
const ERROR_INVALID_FUNCTION: i32 = 1;
const ERROR_TOO_MANY_OPEN_FILES: i32 = 4;
const ERROR_ACCESS_DENIED: i32 = 5;
const ERROR_SHARING_VIOLATION: i32 = 32;
const ERROR_LOCK_VIOLATION: i32 = 33;
const ERROR_NOT_SUPPORTED: i32 = 50;

/// Opens a file or folder to ask for its properties only, which no other process can prevent.
fn open_for_stat(path: &Path, flags: u32) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.access_mode(0).custom_flags(FOLDERS_TOO | flags);
    options.open(path)
}

/// Returns identity and length of a file or folder. Follows links.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn stat(path: &Path) -> io::Result<FileStat> {
    stat_open(&open_for_stat(path, 0)?)
}

/// Returns identity and length of a file or folder, or of a link.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn stat_link(path: &Path) -> io::Result<FileStat> {
    stat_open(&open_for_stat(path, LINK_ITSELF)?)
}

/// Returns identity and length of an open file.
pub fn stat_open(file: &File) -> io::Result<FileStat> {
    let found = winapi_util::file::information(file)?;
    Ok(FileStat {
        id: FileId {
            device: found.volume_serial_number(),
            inode: found.file_index(),
        },
        len: found.file_size(),
    })
}

/// Returns a number that changes if another file replaces this one at its path: the time of its creation, in steps of
/// 100 ns. The file index is only known after the file was opened.
pub fn generation(meta: &Metadata) -> u64 {
    meta.creation_time()
}

/// Returns `None`: Windows has no `/proc`.
pub const fn device_number(_path: &Path) -> Option<DeviceNumber> {
    None
}

/// Returns `None`: Windows does not number its file systems.
pub const fn file_system_magic(_folder: &Path) -> Option<u64> {
    None
}

/// Returns `None`: the free space is not asked for on Windows.
pub const fn free_bytes(_folder: &Path) -> Option<u64> {
    None
}

/// Returns whether a file is not marked as read-only. The rights of folders are not looked at.
pub fn may_write(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|meta| meta.is_dir() || !meta.permissions().readonly())
}

/// Makes a command start a process that Ctrl-C in this terminal does not reach.
pub fn detach(command: &mut std::process::Command) {
    use std::os::windows::process::CommandExt as _;
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}

/// Returns `None`: Windows has no signals, and ends a process that crashes with a negative code.
pub const fn ending_signal(_status: std::process::ExitStatus) -> Option<i32> {
    None
}

/// Returns an error: Windows sends Ctrl-C only to processes of the same terminal.
///
/// # Errors
/// Always.
pub fn interrupt(_pid: u32) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Returns whether a folder is on a share of another machine, as in `\\server\share`. The resolved path of a drive letter
/// that stands for a share names the share.
pub fn is_share(folder: &Path) -> bool {
    let whole = std::fs::canonicalize(folder).or_else(|_| std::path::absolute(folder));
    let first = whole
        .as_ref()
        .ok()
        .and_then(|path| path.components().next());
    matches!(first, Some(Component::Prefix(prefix))
        if matches!(prefix.kind(), Prefix::UNC(..) | Prefix::VerbatimUNC(..)))
}

/// Returns the absolute path with all links resolved. A short path has its usual form, without `\\?\`.
///
/// # Errors
/// Returns an error if the path does not exist or may not be accessed.
pub fn canonicalize(path: &Path) -> io::Result<PathBuf> {
    dunce::canonicalize(path)
}

/// Opens a file for reading. Files on a disk never wait for a writer.
pub fn open_without_waiting(path: &Path) -> io::Result<File> {
    File::open(path)
}

/// Does nothing: see [`open_without_waiting`].
pub const fn let_reads_wait(_file: &File) -> io::Result<()> {
    Ok(())
}

/// Returns `false`: pipes are not in folders.
pub const fn is_pipe(_file_type: FileType) -> bool {
    false
}

/// Returns `false`: sockets do not differ from files.
pub const fn is_socket(_file_type: FileType) -> bool {
    false
}

/// Opens a folder. Windows cannot lock it.
pub fn open_folder(folder: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).custom_flags(FOLDERS_TOO);
    options.open(folder)
}

/// Does nothing: Windows cannot sync a folder, and NTFS keeps its names consistent in a journal. A name may be lost in a
/// power cut, as if the program had ended a few seconds earlier.
pub const fn sync_names(_folder: &File) -> io::Result<()> {
    Ok(())
}

/// Makes the content of a file durable. Windows only syncs files that are open for writing.
pub fn sync_file(path: &Path) -> io::Result<()> {
    OpenOptions::new().write(true).open(path)?.sync_all()
}

/// Makes a folder with all its files durable: syncs each file.
pub fn sync_tree(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_tree(&entry.path())?;
        } else {
            sync_file(&entry.path())?;
        }
    }
    Ok(())
}

/// Renames a file or folder; replaces an existing file atomically. Tries again for a second while another program has
/// the file or a file in the folder open, such as a virus scanner.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    for _ in 0..RENAME_ATTEMPTS {
        match std::fs::rename(from, to) {
            Err(error) if is_in_use(&error) => std::thread::sleep(RETRY_RENAME_AFTER),
            renamed => return renamed,
        }
    }
    std::fs::rename(from, to)
}

fn is_in_use(error: &io::Error) -> bool {
    matches!(
        error.raw_os_error(),
        Some(ERROR_ACCESS_DENIED | ERROR_SHARING_VIOLATION)
    )
}

/// Returns `false`: Windows cannot swap two folders.
pub const fn exchange(_one: &Path, _other: &Path) -> bool {
    false
}

/// Does nothing: new files have the permissions of their folder.
pub const fn let_all_read(_builder: &mut tempfile::Builder) {}

/// Returns the file name with these bytes of an `OsStr`, which must end at the end of a character.
pub fn file_name_of(bytes: &[u8]) -> OsString {
    String::from_utf8_lossy(bytes).into_owned().into()
}

/// Returns a path below a folder with slashes between its parts, so that all systems can read it.
pub fn with_slashes(path: String) -> String {
    path.replace('\\', "/")
}

/// Ends the lock of an open file. The standard library unlocks twice, in case there are two locks, and Wine reports the
/// second time as a lock violation.
pub fn unlock(file: &File) -> io::Result<()> {
    match file.unlock() {
        Err(error) if error.raw_os_error() == Some(ERROR_LOCK_VIOLATION) => Ok(()),
        unlocked => unlocked,
    }
}

/// Returns whether an error of a lock means that the file system has no locks.
pub fn is_without_locks(error: &io::Error) -> bool {
    matches!(
        error.raw_os_error(),
        Some(ERROR_INVALID_FUNCTION | ERROR_NOT_SUPPORTED)
    )
}

/// Returns whether this process has too many open files.
pub fn is_out_of_files(error: &io::Error) -> bool {
    error.raw_os_error() == Some(ERROR_TOO_MANY_OPEN_FILES)
}

/// Returns `false`: Windows names a full disk in its errors.
pub const fn is_disk_full(_folder: &Path) -> bool {
    false
}

/// Returns `false`: Windows has no limit for all processes.
pub const fn is_system_out_of_files(_error: &io::Error) -> bool {
    false
}

/// Returns the largest number: Windows limits open files by memory only.
pub const fn max_open_files() -> u64 {
    u64::MAX
}

/// Succeeds: Windows has no limit for a process.
pub const fn check_free_files(_count: usize) -> io::Result<()> {
    Ok(())
}

/// Returns the name of this machine, or an empty text if the system does not give it.
pub fn host_name() -> String {
    use winapi_util::sysinfo::{ComputerNameKind, get_computer_name};
    let name = get_computer_name(ComputerNameKind::PhysicalDnsHostname);
    name.map_or_else(
        |_| String::new(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// Returns `None`: the memory is not asked for.
pub const fn process_memory() -> Option<ProcessMemory> {
    None
}

/// Calls a function at each Ctrl-C and Ctrl-Break, when the console is closed, and at a shutdown of the system, until
/// the handle is aborted. Windows ends the process about five seconds after the console is closed.
pub fn watch_signals(on_signal: impl Fn() + Send + 'static) -> io::Result<JoinHandle<()>> {
    let (mut interrupt, mut end) = (ctrl_c()?, ctrl_break()?);
    let (mut close, mut shutdown) = (ctrl_close()?, ctrl_shutdown()?);
    Ok(tokio::spawn(async move {
        loop {
            let received = tokio::select! {
                received = interrupt.recv() => received,
                received = end.recv() => received,
                received = close.recv() => received,
                received = shutdown.recv() => received,
            };
            if received.is_none() {
                return;
            }
            on_signal();
        }
    }))
}
