//! Computes the stages of whole blocks: reads their inputs, calls the functions of `block` and `labels`, and encodes what
//! they return.

mod align;
mod boxes;
mod cut;
mod face;
mod held;
mod scan_stream;

use std::sync::atomic::AtomicBool;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::block_stages::{
    BlockArtifacts, BlockFile, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
};
use super::options::RunOptions;
use crate::block::BlockError;
use crate::domain::{BlockStage, BlockStageRecord, FailureClass};
use crate::mesh::{MeshLimits, MeshReadError};
use crate::raster::ImageLimits;
use held::HeldInputs;

/// Version of each stage, in the order of the stages. A change of what a stage returns needs a new number.
const REVISIONS: [u32; 4] = [1, 1, 1, 1];

/// Computes the stages of blocks.
#[derive(Debug)]
pub(super) struct BlockPipeline {
    mesh_limits: MeshLimits,
    image_limits: ImageLimits,
    /// Inputs of the last stage, which the next stage of the same block reads again.
    held: HeldInputs,
}

/// What a stage reads and writes.
struct StageContext<'a> {
    inputs: &'a BlockInputs,
    earlier: &'a [BlockStageRecord],
    artifacts: &'a dyn BlockArtifacts,
    stop: &'a AtomicBool,
}

impl BlockPipeline {
    /// Creates a pipeline with the limits of a run.
    pub(super) fn new(options: &RunOptions) -> Self {
        Self {
            mesh_limits: options.mesh_limits,
            image_limits: options.image_limits,
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
        };
        match stage {
            BlockStage::Face => self.face(&context),
            BlockStage::Align => self.align(&context),
            BlockStage::Boxes => self.boxes(&context),
            BlockStage::Cut => self.cut(&context),
        }
    }
}

impl StageContext<'_> {
    /// Returns the record of an earlier stage.
    fn record(&self, stage: BlockStage) -> Result<&BlockStageRecord, BlockStageError> {
        let record = self.earlier.iter().find(|record| record.stage == stage);
        record.ok_or(BlockStageError::RerunFrom(stage))
    }

    /// Returns the outcome of an earlier stage.
    fn outcome<T: DeserializeOwned>(&self, stage: BlockStage) -> Result<T, BlockStageError> {
        let record = self.record(stage)?;
        let outcome = serde_json::from_str(&record.outcome);
        outcome.map_err(|error| {
            tracing::warn!(block = %self.inputs.name, %stage, "the outcome cannot be read: {error}; the stage runs again");
            BlockStageError::RerunFrom(stage)
        })
    }
}

/// Returns the output of a stage with an outcome and no characters.
fn output(outcome: &impl Serialize) -> Result<BlockStageOutput, BlockStageError> {
    let outcome = serde_json::to_value(outcome)
        .map_err(|error| BlockStageError::failed(FailureClass::Bug, error.to_string()))?;
    Ok(BlockStageOutput {
        outcome,
        characters: Vec::new(),
    })
}

/// Returns the failure of a stage that reads a file.
fn failed(file: &BlockFile, error: BlockError) -> BlockStageError {
    match error {
        BlockError::Mesh(MeshReadError::Io(error)) if scan_stream::is_stop(&error) => {
            BlockStageError::Stopped
        }
        BlockError::Mesh(MeshReadError::Io(error)) => file.unreadable(error),
        BlockError::Mesh(MeshReadError::Mesh(error)) => file.failed(error.class(), error),
        BlockError::NoArea { .. } | BlockError::NoFaces { .. } => {
            file.failed(FailureClass::BadInput, error)
        }
        BlockError::NoFace { .. } | BlockError::NoInk { .. } | BlockError::Refused { .. } => {
            file.failed(FailureClass::NoSolution, error)
        }
    }
}
