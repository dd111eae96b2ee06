//! Why an input file could not be read.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::remote::BucketError;
use mocban_core::domain::{Explained, FailureClass, NOT_THERE};
use mocban_system::platform::{is_out_of_files, is_system_out_of_files};

/// Why an input file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// There is no such file.
    #[error("{0}{end}", end = NOT_THERE)]
    NotThere(PathBuf),
    /// The path is a directory or anything else that is not a regular file.
    #[error("{path} is {kind}, not a file")]
    NotAFile {
        /// Which path.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
    },
    /// The process may not read it.
    #[error("{0} may not be read: permission denied")]
    Denied(PathBuf),
    /// The file is larger than the settings allow.
    #[error("{path} has {bytes} bytes, over the limit of {limit} ({setting})")]
    TooLarge {
        /// Which file.
        path: PathBuf,
        /// Its size in bytes.
        bytes: u64,
        /// The limit in bytes.
        limit: u64,
        /// Name of the setting.
        setting: &'static str,
    },
    /// The file is being written.
    #[error("{0} changed while it was read")]
    Changed(PathBuf),
    /// The object store refuses the object, and will refuse it the next time.
    #[error("{0}")]
    Object(BucketError),
    /// The object store failed; another attempt may succeed.
    #[error("{0}")]
    Store(BucketError),
    /// Reading failed; it may succeed another time.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl Explained for InputError {}

impl From<BucketError> for InputError {
    fn from(error: BucketError) -> Self {
        match error {
            BucketError::NotThere(address) => Self::NotThere(address.into()),
            error @ BucketError::Object { .. } => Self::Object(error),
            error => Self::Store(error),
        }
    }
}

impl InputError {
    /// Adds the path to an error of the system, and replaces errors with a known reason.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        match source.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => Self::NotThere(path.to_owned()),
            ErrorKind::PermissionDenied => Self::Denied(path.to_owned()),
            ErrorKind::IsADirectory => Self::NotAFile {
                path: path.to_owned(),
                kind: "a directory",
            },
            _ => Self::Io {
                path: path.to_owned(),
                source: with_advice(source),
            },
        }
    }

    /// Returns the class of the failure.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::NotThere(_)
            | Self::NotAFile { .. }
            | Self::Denied(_)
            | Self::Changed(_)
            | Self::Object(_)
            | Self::Store(_)
            | Self::Io { .. } => FailureClass::Io,
            Self::TooLarge { .. } => FailureClass::BadInput,
        }
    }

    /// Returns whether the user can correct the file at its place: it is missing, is a folder, or may not be read.
    pub const fn is_correctable(&self) -> bool {
        matches!(
            self,
            Self::NotThere(_) | Self::NotAFile { .. } | Self::Denied(_)
        )
    }

    /// Returns whether a retry may succeed without a change by the user.
    pub fn is_transient(&self) -> bool {
        match self {
            Self::Io { source, .. } => source.kind() != ErrorKind::InvalidFilename,
            Self::Changed(_) | Self::Store(_) => true,
            _ => false,
        }
    }
}

/// Replaces an error about too many open files with an error that names a remedy.
pub(super) fn with_advice(error: io::Error) -> io::Error {
    if is_out_of_files(&error) {
        io::Error::other("too many open files; raise the limit with `ulimit -n`")
    } else if is_system_out_of_files(&error) {
        io::Error::other("the system has too many open files; close other programs")
    } else {
        error
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io;

    use rustix::io::Errno;

    use super::{BucketError, FailureClass, InputError, with_advice};

    #[test]
    fn too_many_open_files_name_the_way_out() {
        let error = io::Error::from(Errno::MFILE);
        let text = with_advice(error).to_string();
        assert!(
            text.contains("too many open files") && text.contains("ulimit -n"),
            "{text}"
        );
        let error = io::Error::from(Errno::IO);
        assert_eq!(
            with_advice(error).raw_os_error(),
            Some(Errno::IO.raw_os_error())
        );
    }

    #[test]
    fn an_object_that_is_refused_is_not_tried_again() {
        let object = |code: &str| BucketError::Object {
            address: "s3://b/x".to_owned(),
            code: code.to_owned(),
        };
        let error = InputError::from(object("KeyTooLongError"));
        assert!(matches!(error, InputError::Object(_)) && !error.is_transient());
        assert_eq!(error.class(), FailureClass::Io);
    }
}
