//! Operations that differ between operating systems. No other production code names one, apart from `cfg` of Linux.
//!
//! `unix.rs` and `windows.rs` have the same functions.

mod active_time;
#[cfg(unix)]
mod unix;
#[cfg(windows)]
#[allow(
    clippy::unnecessary_wraps,
    clippy::needless_pass_by_value,
    reason = "the signatures are those of `unix.rs`"
)]
mod windows;

pub use active_time::{ActiveClock, sleep_active, timeout_active};
#[cfg(unix)]
pub use unix::*;
#[cfg(windows)]
pub use windows::*;

/// Identifies a file or folder on this machine as long as it exists: device and inode, or volume and file index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileId {
    device: u64,
    inode: u64,
}

/// Identity and length of a file or folder.
#[derive(Debug, Clone, Copy)]
pub struct FileStat {
    /// Its identity.
    pub id: FileId,
    /// Its length in bytes.
    pub len: u64,
}

/// Memory of this process in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProcessMemory {
    /// Memory now.
    pub resident: u64,
    /// Largest memory so far.
    pub peak: u64,
}

/// Device and inode of a file as Linux's tables in `/proc` show them.
#[derive(Debug, Clone, Copy)]
pub struct DeviceNumber {
    /// Major number of the device.
    pub major: u32,
    /// Minor number of the device.
    pub minor: u32,
    /// The inode.
    pub inode: u64,
}
