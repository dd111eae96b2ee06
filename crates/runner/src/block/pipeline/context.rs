//! What the stages of a block have in common: inputs, results of earlier stages, artifacts, limits.

use std::sync::atomic::AtomicBool;

use serde::de::DeserializeOwned;

use crate::block_stages::{BlockArtifacts, BlockInputs, BlockStageError};
use mocban_core::InputLimits;
use mocban_core::domain::{BlockStage, BlockStageRecord};

/// What a stage reads and writes.
pub(crate) struct StageContext<'a> {
    pub(crate) inputs: &'a BlockInputs,
    pub(crate) earlier: &'a [BlockStageRecord],
    pub(crate) artifacts: &'a dyn BlockArtifacts,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) limits: &'a InputLimits,
    /// Largest height map, in pixels.
    pub(crate) max_map_pixels: usize,
}

impl StageContext<'_> {
    /// Returns the record of an earlier stage.
    pub(crate) fn record(&self, stage: BlockStage) -> Result<&BlockStageRecord, BlockStageError> {
        let record = self.earlier.iter().find(|record| record.stage == stage);
        record.ok_or(BlockStageError::RerunFrom(stage))
    }

    /// Returns the outcome of an earlier stage.
    pub(crate) fn outcome<T: DeserializeOwned>(
        &self,
        stage: BlockStage,
    ) -> Result<T, BlockStageError> {
        let record = self.record(stage)?;
        serde_json::from_str(&record.outcome).map_err(|error| {
            tracing::warn!(block = %self.inputs.name, %stage, "the outcome cannot be read: {error}; the stage runs again");
            BlockStageError::RerunFrom(stage)
        })
    }
}
