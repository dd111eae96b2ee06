//! Why an export fails.

use super::export_folder::FolderError;
use mocban_catalog::CatalogError;
use mocban_core::domain::explained_by_cause;
use mocban_store::ArtifactError;

/// Why nothing was exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The catalog cannot be read.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// The folder or the object store of the artifacts cannot be read, so that the export would have no files.
    #[error("{0}")]
    Artifacts(#[from] ArtifactError),
    /// The folder cannot be used, or a file in it not written.
    #[error("{0}")]
    Folder(#[from] FolderError),
    /// A worker task panicked or was cancelled.
    #[error("the export stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

explained_by_cause! { ExportError: Catalog, Folder }
