//! Why a run cannot go on.

use mocban_catalog::{CatalogError, FieldChange};
use mocban_core::domain::{BlockName, ErrorCode, Explained, PairName};
use mocban_store::{ArtifactError, LockError, PlaceError, StorageError, StoreError};

/// An error that ends a run. A failed pair is not such an error; the run's summary counts failed pairs.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Another process runs this project.
    #[error(transparent)]
    InUse(LockError),
    /// The lock files cannot be used.
    #[error(transparent)]
    Lock(LockError),
    /// The processes that already work on the project have other settings.
    #[error(
        "the run in progress has other settings{}; use the same settings, or wait until it has ended",
        list(.0)
    )]
    OtherSettings(Vec<FieldChange>),
    /// The last plan has other settings than this worker.
    #[error("the last plan has other settings{}; use the same settings, or run `plan` with these once no worker is at work", list(.0))]
    OtherPlan(Vec<FieldChange>),
    /// Pairs were named that do not exist.
    #[error("there is no pair {}", .0.iter().map(PairName::as_str).collect::<Vec<_>>().join(", "))]
    NoSuchPair(Vec<PairName>),
    /// A block was named that does not exist.
    #[error("there is no block {0}")]
    NoSuchBlock(BlockName),
    /// The catalog returned an error.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// The project's directory cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The folder of inputs cannot be used.
    #[error("{0}")]
    Storage(#[from] StorageError),
    /// The artifacts belong to another catalog.
    #[error(transparent)]
    Place(Box<PlaceError>),
    /// An artifact could not be written.
    #[error(transparent)]
    Artifact(#[from] ArtifactError),
}

impl Explained for RunError {
    fn wrapped(&self) -> Option<&dyn Explained> {
        match self {
            Self::Catalog(error) => Some(error),
            Self::Store(error) => Some(error),
            Self::Storage(error) => Some(error),
            _ => None,
        }
    }

    fn code(&self) -> ErrorCode {
        match self {
            Self::InUse(_) => ErrorCode::ProjectInUse,
            Self::OtherSettings(_) | Self::OtherPlan(_) | Self::Place(_) => ErrorCode::Usage,
            Self::NoSuchPair(_) | Self::NoSuchBlock(_) => ErrorCode::NothingSelected,
            _ => self
                .wrapped()
                .map_or(ErrorCode::Unexpected, Explained::code),
        }
    }
}

/// Formats changed settings as ` (register.smoothing_px: 1.0 -> 1.5)`. Returns an empty text if no change is known.
fn list(changes: &[FieldChange]) -> String {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    match changes.as_slice() {
        [] => String::new(),
        changes => format!(" ({})", changes.join(", ")),
    }
}

impl From<PlaceError> for RunError {
    fn from(error: PlaceError) -> Self {
        match error {
            PlaceError::Failed(error) => Self::Artifact(error),
            error => Self::Place(Box::new(error)),
        }
    }
}

impl From<LockError> for RunError {
    fn from(error: LockError) -> Self {
        match error {
            LockError::InUse { .. } => Self::InUse(error),
            LockError::Io { .. } => Self::Lock(error),
        }
    }
}
