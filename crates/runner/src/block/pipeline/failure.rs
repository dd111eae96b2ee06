//! What errors of `block` mean for the job of a block.

use std::io;

use serde::Serialize;

use crate::block_stages::{BlockFile, BlockStageError, BlockStageOutput};
use mocban_align::block::BlockError;
use mocban_core::domain::FailureClass;
use mocban_core::mesh::MeshReadError;

/// Returns the output of a stage with an outcome and no characters.
pub(crate) fn output(outcome: &impl Serialize) -> Result<BlockStageOutput, BlockStageError> {
    let outcome = serde_json::to_value(outcome)
        .map_err(|error| BlockStageError::failed(FailureClass::Bug, error.to_string()))?;
    Ok(BlockStageOutput {
        outcome,
        characters: Vec::new(),
    })
}

/// Returns the failure of a stage that reads a file.
pub(crate) fn failed(file: &BlockFile, error: BlockError) -> BlockStageError {
    match error {
        BlockError::Mesh(MeshReadError::Io(error)) if is_stop(&error) => BlockStageError::Stopped,
        BlockError::Mesh(MeshReadError::Io(error)) => file.unreadable(error),
        BlockError::Mesh(MeshReadError::Mesh(error)) => file.failed(error.class(), error),
        BlockError::NoArea { .. }
        | BlockError::NoFaces { .. }
        | BlockError::TooLarge { .. }
        | BlockError::Overlap { .. } => file.failed(FailureClass::BadInput, error),
        BlockError::NoFace { .. } | BlockError::NoInk { .. } | BlockError::Refused { .. } => {
            file.failed(FailureClass::NoSolution, error)
        }
    }
}

/// The error of a read after the run was asked to stop.
#[derive(Debug, thiserror::Error)]
#[error("the run stops")]
pub(crate) struct StopRequested;

/// Returns whether reading failed because the run stops.
fn is_stop(error: &io::Error) -> bool {
    error
        .get_ref()
        .is_some_and(<dyn std::error::Error + Send + Sync>::is::<StopRequested>)
}
