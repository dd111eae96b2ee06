//! Why an export cannot be written as an archive.

use std::io;
use std::path::{Path, PathBuf};

/// Why an export cannot be written as an archive.
#[derive(Debug, thiserror::Error)]
pub enum FolderZipError {
    /// There is no export.
    #[error("there is no export in {0}; export again")]
    NoExport(PathBuf),
    /// The name of a file cannot be stored.
    #[error("the name of {0} is too long or not UTF-8; rename it or export again")]
    Name(PathBuf),
    /// The export or one of its files changed while it was read.
    #[error("{0} was changed or replaced meanwhile; download again")]
    Changed(PathBuf),
    /// An operation on a file failed.
    #[error("{path}: {source}")]
    File {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folders are nested too deeply.
    #[error("the folders in {0} are nested too deeply; remove it or export again")]
    TooDeep(PathBuf),
    /// The archive cannot be written to its destination.
    #[error("the archive cannot be written: {0}")]
    Output(io::Error),
}

/// Explains an error of a temporary file.
pub(super) fn temporary_error(source: io::Error) -> FolderZipError {
    file_error(&std::env::temp_dir(), source)
}

/// Explains an error of a file or folder.
pub(super) fn file_error(path: &Path, source: io::Error) -> FolderZipError {
    FolderZipError::File {
        path: path.to_owned(),
        source,
    }
}
