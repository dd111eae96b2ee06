//! Computes the stages of whole blocks with the settings of a project.

use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::block_stages::{
    BlockArtifacts, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
};
use crate::domain::{BlockStage, BlockStageRecord, FailureClass};

/// Computes the stages of blocks.
#[derive(Debug, Default)]
pub(super) struct BlockPipeline;

impl BlockStages for BlockPipeline {
    fn settings(&self, _stage: BlockStage) -> Value {
        json!({ "revision": 0 })
    }

    fn run(
        &self,
        _stage: BlockStage,
        inputs: &BlockInputs,
        _earlier: &[BlockStageRecord],
        _artifacts: &dyn BlockArtifacts,
        _stop: &AtomicBool,
    ) -> Result<BlockStageOutput, BlockStageError> {
        let text = "this build cannot register whole blocks";
        Err(inputs.mesh.failed(FailureClass::NoSolution, text))
    }
}
