//! What an error means for its user: a stable code, and one sentence that says what was seen and what to do.

use std::error::Error;
use std::path::Path;

use super::enum_names::enum_names;

/// What went wrong, under a name that stays the same, for programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorCode {
    /// A failure without a name of its own.
    Unexpected,
    /// Arguments, a list or an output that cannot be used. Nothing was changed.
    Usage,
    /// A setting, or the file of the settings.
    Settings,
    /// The user of the database may not do this.
    NotPermitted,
    /// An output that would not be complete, and would replace an earlier file.
    Incomplete,
    /// No pair or block is selected.
    NothingSelected,
    /// There is no project.
    NoProject,
    /// Another process runs the project.
    ProjectInUse,
    /// Another process writes the same output.
    OutputInUse,
    /// Another process locked the catalog for too long.
    Locked,
    /// The catalog's file or folder cannot be written to.
    NotWritable,
    /// The catalog holds rows that are not allowed, or parts that another program added.
    Damaged,
    /// The pages of the catalog's file are inconsistent.
    DamagedFile,
    /// The file is empty or not a catalog.
    NotACatalog,
    /// Another program deleted, replaced or cut the catalog's write-ahead log.
    LogLost,
    /// Another version of this program wrote the catalog.
    OtherVersion,
    /// A server cannot be reached at the moment.
    Unavailable,
    /// A disk or a quota is full.
    DiskFull,
    /// This process may not open more files.
    TooManyFiles,
    /// The reader of an output closed it.
    ClosedPipe,
}

enum_names! {
    pub ErrorCode, "a code of an error":
    Unexpected = "unexpected", Usage = "usage", Settings = "settings", NotPermitted = "not_permitted",
    Incomplete = "incomplete", NothingSelected = "nothing_selected", NoProject = "no_project",
    ProjectInUse = "project_in_use", OutputInUse = "output_in_use", Locked = "locked", NotWritable = "not_writable",
    Damaged = "damaged", DamagedFile = "damaged_file", NotACatalog = "not_a_catalog", LogLost = "log_lost",
    OtherVersion = "other_version", Unavailable = "unavailable", DiskFull = "disk_full",
    TooManyFiles = "too_many_files", ClosedPipe = "closed_pipe",
}

/// What to do when a disk is full.
pub const FREE_SPACE: &str = "free some space and try again, everything stored so far is safe";

/// Returns the message of a command whose project in a folder was renamed, moved or removed meanwhile.
pub fn moved_away(project: &Path) -> String {
    format!(
        "{} was renamed, moved or removed during this command, so nothing more was written there; run the command again with the new path",
        project.display()
    )
}

/// An error that knows what it means for its user. An error that only wraps another one has its code and advice.
pub trait Explained: Error + Send + Sync + 'static {
    /// Returns the error that this one wraps.
    fn wrapped(&self) -> Option<&dyn Explained> {
        None
    }

    /// Returns the code.
    fn code(&self) -> ErrorCode {
        self.wrapped()
            .map_or(ErrorCode::Unexpected, Explained::code)
    }

    /// Returns a sentence on what was seen in the project in a folder and what to do, if the error's own message does not
    /// say it.
    fn advice(&self, project: &Path) -> Option<String> {
        self.wrapped()?.advice(project)
    }
}

/// Implements [`Explained`] for an error whose variants `$variant` wrap an explained error.
#[macro_export]
macro_rules! explained_by_cause {
    ($type:ident: $($variant:ident),+) => {
        impl $crate::domain::Explained for $type {
            fn wrapped(&self) -> Option<&dyn $crate::domain::Explained> {
                match self {
                    $(Self::$variant(error) => Some(error),)+
                    _ => None,
                }
            }
        }
    };
}

pub use explained_by_cause;

impl Explained for std::io::Error {
    fn code(&self) -> ErrorCode {
        use std::io::ErrorKind::{BrokenPipe, QuotaExceeded, StorageFull};
        match self.kind() {
            BrokenPipe => ErrorCode::ClosedPipe,
            QuotaExceeded | StorageFull => ErrorCode::DiskFull,
            _ => ErrorCode::Unexpected,
        }
    }
}

impl Explained for serde_json::Error {}
