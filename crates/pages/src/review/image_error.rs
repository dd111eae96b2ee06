//! Why the images of an item cannot be rendered.

use crate::local_server::WorkFailed;
use mocban_catalog::CatalogError;
use mocban_export::{PictureError, SourcePrintError};
use mocban_results::pair_artifacts::PairArtifactsError;

/// Why the images of an item cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub(super) enum ImageError {
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
    #[error(transparent)]
    Print(#[from] SourcePrintError),
    /// The pair has a new result.
    #[error("this pair has a new result; reload the page")]
    Gone,
    /// A run computes the pair again, or it failed, so some of its results are missing.
    #[error("this pair has no complete result at the moment; try again when a run has computed it")]
    Incomplete,
    /// The scan cannot be shown in 3D.
    #[error(transparent)]
    Scan(#[from] PictureError),
    #[error(transparent)]
    Stopped(#[from] WorkFailed),
}
