//! Why no report can be made.

use mocban_catalog::CatalogError;
use mocban_core::domain::explained_by_cause;
use mocban_results::pair_artifacts::PairArtifactsError;

/// Why no report can be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The catalog cannot be read.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// The result of a pair with a manual alignment cannot be read.
    #[error(transparent)]
    Artifacts(#[from] PairArtifactsError),
    /// The task that evaluates pairs panicked or was cancelled.
    #[error("comparing with the truth stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

explained_by_cause! { ReportError: Catalog }
