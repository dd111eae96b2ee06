//! A block between two of its stages.

use std::time::Instant;

use serde_json::Value;

use super::inputs::BlockSources;
use crate::block_stages::BlockStageOutput;
use crate::run_context::JobEnd;
use mocban_catalog::{BlockInputVersions, BlockJob, BlockProvenance, BlockWork, Lease};
use mocban_core::domain::{ArtifactSet, BlockStage};

/// A block in progress.
pub(crate) struct BlockInProgress {
    pub(crate) lease: Lease<BlockJob>,
    pub(crate) work: BlockWork,
    pub(crate) sources: BlockSources,
    /// Versions of the input files, as far as they are known.
    pub(crate) inputs: BlockInputVersions,
}

impl BlockInProgress {
    /// Describes what a stage is computed from.
    pub(crate) fn provenance(&self, stage: BlockStage, settings: &Value) -> BlockProvenance {
        let BlockWork {
            attributes,
            control_points,
            ..
        } = &self.work;
        BlockProvenance::new(
            stage,
            settings,
            attributes,
            &self.inputs,
            control_points.as_ref(),
        )
    }
}

/// A computed stage.
pub(crate) struct ComputedBlockStage {
    pub(crate) output: BlockStageOutput,
    pub(crate) files: ArtifactSet,
    pub(crate) ms: u64,
    /// When the write of its files began.
    pub(crate) began: Instant,
}

/// What happens to a block after a stage.
pub(crate) enum AfterStage {
    /// The job continues with this stage.
    Continue(Box<BlockInProgress>, BlockStage),
    /// Its task ends.
    End(JobEnd),
}
