//! Why an artifact could not be read or written.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::input_error::InputError;
use super::remote::BucketError;

/// Why an artifact could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArtifactError {
    /// A row names it, but the file is missing.
    #[error("artifact {0} is missing")]
    Missing(PathBuf),
    /// The file was changed after it was written.
    #[error("artifact {0} was changed: its bytes do not match its name")]
    Changed(PathBuf),
    /// The project's directory was renamed or removed.
    #[error(
        "{0} was renamed, moved or removed during this command, so nothing more was written there; run the command again with the new path"
    )]
    Moved(PathBuf),
    /// A row names a pack in an object store, but the settings name no store.
    #[error("artifact {0} is in an object store; set storage.artifacts to its address")]
    NoStore(String),
    /// A request to the object store failed.
    #[error("artifact: {0}")]
    Bucket(BucketError),
    /// A file operation failed.
    #[error("artifact {path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl ArtifactError {
    /// Returns whether an object store did not answer, so that the same request may succeed later.
    pub const fn is_unavailable(&self) -> bool {
        matches!(self, Self::Bucket(BucketError::Unavailable { .. }))
    }

    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

impl From<InputError> for ArtifactError {
    fn from(error: InputError) -> Self {
        match error {
            InputError::NotThere(path) => Self::Missing(path),
            InputError::NotAFile { path, .. }
            | InputError::Changed(path)
            | InputError::TooLarge { path, .. } => Self::Changed(path),
            InputError::Denied(path) => Self::io(&path)(ErrorKind::PermissionDenied.into()),
            InputError::Object(error) | InputError::Store(error) => Self::Bucket(error),
            InputError::Io { path, source } => Self::Io { path, source },
        }
    }
}
