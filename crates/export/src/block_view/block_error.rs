//! Why a block cannot be shown.

use crate::source_print::SourcePrintError;
use mocban_align::block::BlockError;
use mocban_catalog::CatalogError;
use mocban_core::domain::{BlockName, BlockStage, ErrorCode, Explained, ThresholdMetric};
use mocban_core::raster::PngError;

/// Why a block cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum BlockViewError {
    /// The catalog cannot be read.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// The block does not exist.
    #[error("block {0} was removed while it was read")]
    Gone(BlockName),
    /// The block has no alignment.
    #[error("block {block} is not aligned with its page, so there is nothing to show: {why}")]
    NotAligned {
        /// Which block.
        block: BlockName,
        /// The failure, or what to do.
        why: String,
    },
    /// No character has a result of the metric that was asked for.
    #[error(
        "no character of block {block} has a result of {metric}, so there is nothing to show; leave --metric out"
    )]
    NoResult {
        /// Which block.
        block: BlockName,
        /// Which metric.
        metric: ThresholdMetric,
    },
    /// A stored outcome has another form.
    #[error("the stored result of {stage} cannot be read: {why}; run the block again")]
    Outcome {
        /// Which stage.
        stage: BlockStage,
        /// Why.
        why: String,
    },
    /// The heights of the face cannot be read.
    #[error(transparent)]
    Store(#[from] mocban_store::ArtifactError),
    /// The heights of the face are not a valid image.
    #[error("the stored heights of the face: {0}")]
    Image(#[from] PngError),
    /// The page cannot be used.
    #[error(transparent)]
    Page(#[from] SourcePrintError),
    /// The page has no ink.
    #[error("the image of the page: {0}")]
    Ink(#[from] BlockError),
    /// A worker task panicked or was cancelled.
    #[error("drawing stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

impl Explained for BlockViewError {
    fn wrapped(&self) -> Option<&dyn Explained> {
        match self {
            Self::Catalog(error) => Some(error),
            _ => None,
        }
    }

    fn code(&self) -> ErrorCode {
        match self {
            Self::NotAligned { .. } | Self::NoResult { .. } => ErrorCode::NothingSelected,
            Self::Catalog(error) => error.code(),
            _ => ErrorCode::Unexpected,
        }
    }
}
