//! What a run reports while it is in progress, and at its end.

use std::time::Duration;

use serde::{Serialize, Serializer};

use super::stop::StopLevel;
use mocban_catalog::{CutSummary, StatusCounts};
use mocban_core::domain::{BlockName, BlockStage, Failure, PairName, Stage};

/// Something that happened in a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "message_type", rename_all = "snake_case")]
pub enum RunEvent {
    /// The run starts.
    Started {
        /// Pairs with stages to run.
        pairs: u64,
        /// Total number of stages to run, over all pairs.
        stages: u64,
        /// Pairs that each stage has to run for.
        by_stage: [u64; Stage::COUNT],
        /// Blocks with stages to run. Their pairs are counted when they are cut, not here.
        blocks: u64,
        /// Pairs computed at the same time.
        workers: usize,
    },
    /// A stage starts.
    StageStarted {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
    },
    /// A stage is computed and stored.
    StageFinished {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Computing time in milliseconds.
        ms: u64,
    },
    /// All stages of a pair are stored.
    PairDone {
        /// The pair.
        pair: PairName,
    },
    /// A pair was quarantined.
    PairFailed {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Class and message.
        #[serde(flatten)]
        failure: Failure,
        /// Number of the pair's stages that will not complete, including the failed one. For progress bars.
        skipped: u64,
    },
    /// A stage failed in a way that may pass; it is retried later.
    PairBackingOff {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Class and message.
        #[serde(flatten)]
        failure: Failure,
        /// Wait before the retry in milliseconds.
        wait_ms: u64,
    },
    /// A stage of a block starts.
    BlockStageStarted {
        /// The block.
        block: BlockName,
        /// The stage.
        stage: BlockStage,
    },
    /// A stage of a block is computed and stored.
    BlockStageFinished {
        /// The block.
        block: BlockName,
        /// The stage.
        stage: BlockStage,
        /// Computing time in milliseconds.
        ms: u64,
    },
    /// A stored stage of a block assumed something or left something out.
    BlockWarned {
        /// The block.
        block: BlockName,
        /// The stage.
        stage: BlockStage,
        /// What was assumed or left out.
        warning: String,
    },
    /// All stages of a block are stored, and its characters are pairs.
    BlockDone {
        /// The block.
        block: BlockName,
        /// What the cut changed.
        #[serde(flatten)]
        cut: CutSummary,
        /// Stages that each new or changed pair has to run.
        stages: u64,
    },
    /// A block failed, for example because its page belongs to another block.
    BlockFailed {
        /// The block.
        block: BlockName,
        /// The stage.
        stage: BlockStage,
        /// Class and message.
        #[serde(flatten)]
        failure: Failure,
    },
    /// A stage of a block failed in a way that may pass; it is retried later.
    BlockBackingOff {
        /// The block.
        block: BlockName,
        /// The stage.
        stage: BlockStage,
        /// Class and message.
        #[serde(flatten)]
        failure: Failure,
        /// Wait before the retry in milliseconds.
        wait_ms: u64,
    },
    /// Pairs of dead workers are ready again.
    Recovered {
        /// Number of pairs.
        pairs: u64,
    },
    /// The run is stopping.
    Stopping {
        /// How soon.
        #[serde(rename = "now", serialize_with = "is_now")]
        level: StopLevel,
        /// Why, in a few words: asked to stop, or too many failures.
        reason: String,
    },
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes fields by reference"
)]
fn is_now<S: Serializer>(level: &StopLevel, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_bool(*level == StopLevel::Now)
}

/// How the pairs of blocks changed when a run cut these.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct CutPairs {
    /// Pairs that are new.
    pub added: u64,
    /// Pairs that changed and run again.
    pub changed: u64,
    /// Pairs that were retired because their boxes are gone.
    pub retired: u64,
    /// Retired and changed pairs with verdicts.
    pub judged: u64,
    /// Retired pairs that came back with their boxes.
    pub restored: u64,
}

impl CutPairs {
    /// Counts the pairs of a block that is cut.
    pub(super) const fn observe(&mut self, event: &RunEvent) {
        if let RunEvent::BlockDone { cut, .. } = event {
            self.added += cut.added;
            self.changed += cut.changed;
            self.retired += cut.retired;
            self.judged += cut.judged;
            self.restored += cut.restored;
        }
    }
}

/// What a run did with blocks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct BlockSummary {
    /// Blocks that this run finished.
    pub done: u64,
    /// Blocks that failed in this run.
    pub failed: u64,
    /// Blocks with stages left to run.
    pub left: u64,
    /// Blocks that failed in this or an earlier run.
    pub failed_in_all: u64,
    /// The pairs of the blocks that this run finished.
    pub pairs: CutPairs,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// Pairs that this run finished.
    pub done: u64,
    /// Pairs that were quarantined in this run.
    pub failed: u64,
    /// Stages computed and stored by this run.
    pub stages: u64,
    /// Selected pairs with stages left to run.
    pub left: u64,
    /// Number of selected pairs that this or an earlier run quarantined.
    pub failed_in_all: u64,
    /// Blocks.
    pub blocks: BlockSummary,
    /// Whether a signal stopped the run before everything was done.
    pub stopped: bool,
    /// Whether the run ended early because of [`RunOptions::max_failures`](super::RunOptions::max_failures).
    pub too_many_failures: bool,
    /// Time that stages were computed, all threads together.
    #[serde(skip)]
    pub compute_time: Duration,
    /// Wall-clock time in milliseconds.
    pub elapsed_ms: u64,
    /// The project's counts at the end.
    pub status: StatusCounts,
}
