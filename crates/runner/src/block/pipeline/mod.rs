//! Computes the stages of whole blocks: reads their inputs, calls the functions of `block` and `labels`, and encodes what
//! they return.

mod align;
mod boxes;
mod context;
mod cut;
mod face;
mod failure;
mod scan_stream;
mod stage_cache;

use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use self::context::StageContext;
use self::stage_cache::{HeldGuard, HeldInputs};
use super::memory::max_map_pixels;
use crate::block_stages::{
    BlockArtifacts, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
};
use crate::options::RunOptions;
use mocban_core::InputLimits;
use mocban_core::domain::{BlockStage, BlockStageRecord};

/// Version of each stage, in the order of the stages. A change of what a stage returns needs a new number.
const REVISIONS: [u32; BlockStage::COUNT] = [2, 3, 6, 4];

/// Computes the stages of blocks.
#[derive(Debug)]
pub(crate) struct BlockPipeline {
    limits: InputLimits,
    max_map_pixels: usize,
    /// Inputs of the last stage, which the next stage of the same block reads again.
    held: HeldInputs,
}

impl BlockPipeline {
    /// Creates a pipeline with the limits of a run.
    pub(crate) fn new(options: &RunOptions) -> Self {
        Self {
            limits: options.limits,
            max_map_pixels: max_map_pixels(options.memory),
            held: HeldInputs::default(),
        }
    }
}

impl BlockStages for BlockPipeline {
    fn settings(&self, stage: BlockStage) -> Value {
        json!({ "revision": REVISIONS[stage.index()] })
    }

    fn run(
        &self,
        stage: BlockStage,
        inputs: &BlockInputs,
        earlier: &[BlockStageRecord],
        artifacts: &dyn BlockArtifacts,
        stop: &AtomicBool,
    ) -> Result<BlockStageOutput, BlockStageError> {
        let context = StageContext {
            inputs,
            earlier,
            artifacts,
            stop,
            limits: &self.limits,
            max_map_pixels: self.max_map_pixels,
        };
        let mut forgets = HeldGuard(Some(&self.held));
        let outcome = match stage {
            BlockStage::Face => face::face(&context),
            BlockStage::Align => align::align(&context, &self.held),
            BlockStage::Boxes => boxes::boxes(&context, &self.held),
            BlockStage::Cut => cut::cut(&context, &self.held),
        };
        let goes_on = match &outcome {
            Ok(_) => stage != BlockStage::Cut,
            Err(BlockStageError::RerunFrom(_) | BlockStageError::Store(_)) => true,
            Err(BlockStageError::Failed { .. } | BlockStageError::Stopped) => false,
        };
        if goes_on {
            forgets.0 = None;
        }
        outcome
    }
}
