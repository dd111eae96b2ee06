//! Why an artifact could not be read or written.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::input_error::InputError;
use super::open_file::file_kind;
use super::remote::BucketError;
use mocban_core::domain::{Explained, moved_away};

/// Why an artifact could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArtifactError {
    /// A row names it, but the file is missing.
    #[error("artifact {0} is missing")]
    Missing(PathBuf),
    /// The file was changed after it was written.
    #[error("artifact {0} was changed: its bytes do not match its name")]
    Changed(PathBuf),
    /// A folder or anything else that is not a file has the name of an artifact, or a file has the name of its folder.
    #[error("{path} is {kind}, where this program keeps {wanted} of its own; move it away")]
    Blocked {
        /// Its path.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
        /// What belongs there.
        wanted: &'static str,
    },
    /// The project's directory was renamed or removed.
    #[error("{}", moved_away(.0))]
    Moved(PathBuf),
    /// A row names a pack in an object store, but the settings name no store.
    #[error("artifact {0} is in an object store; set storage.artifacts to its address")]
    NoStore(String),
    /// A request to the object store failed.
    #[error("{0}")]
    Bucket(#[source] BucketError),
    /// A file operation failed.
    #[error("artifact {path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl Explained for ArtifactError {}

impl ArtifactError {
    /// Returns whether an object store did not answer, so that the same request may succeed later.
    pub const fn is_unavailable(&self) -> bool {
        matches!(self, Self::Bucket(BucketError::Unavailable { .. }))
    }

    /// Returns whether other artifacts may be sound and readable. After any other error, none can be read.
    pub const fn concerns_one_file(&self) -> bool {
        match self {
            Self::Missing(_)
            | Self::Changed(_)
            | Self::Blocked { .. }
            | Self::Io { .. }
            | Self::Bucket(BucketError::Object { .. }) => true,
            Self::Moved(_) | Self::NoStore(_) | Self::Bucket(_) => false,
        }
    }

    /// Returns an error if the path of an artifact leads through something that is not a folder.
    pub(super) fn blocked_folder(path: &Path) -> Option<Self> {
        let mut folders = path.ancestors().skip(1);
        let (folder, meta) =
            folders.find_map(|folder| Some((folder, std::fs::metadata(folder).ok()?)))?;
        (!meta.is_dir()).then(|| Self::Blocked {
            path: folder.to_owned(),
            kind: file_kind(&meta),
            wanted: "a folder",
        })
    }

    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

impl From<InputError> for ArtifactError {
    fn from(error: InputError) -> Self {
        match error {
            InputError::NotThere(path) => {
                Self::blocked_folder(&path).unwrap_or(Self::Missing(path))
            }
            InputError::NotAFile { path, kind } => Self::Blocked {
                path,
                kind,
                wanted: "a file",
            },
            InputError::Changed(path) | InputError::TooLarge { path, .. } => Self::Changed(path),
            InputError::Denied(path) => Self::io(&path)(ErrorKind::PermissionDenied.into()),
            InputError::Object(error) | InputError::Store(error) => Self::Bucket(error),
            InputError::Io { path, source } => Self::Io { path, source },
        }
    }
}
