//! What a run tells while it goes on, and at its end.

use std::time::Duration;

use crate::catalog::StatusCounts;
use crate::domain::{Failure, PairName, Stage};

use super::StopLevel;

/// Something that happened in a run.
#[derive(Debug, Clone, PartialEq)]
pub enum RunEvent {
    /// The run begins.
    Started {
        /// Pairs with work before them.
        pairs: u64,
        /// Stages before them, all pairs together: the length of the overall bar.
        stages: u64,
        /// Stages before them by stage.
        by_stage: [u64; 4],
        /// Pairs worked on at the same time.
        workers: usize,
    },
    /// A stage begins.
    StageStarted {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
    },
    /// A stage is done and stored.
    StageFinished {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Computing time in milliseconds.
        ms: u64,
    },
    /// All stages of a pair are done.
    PairDone {
        /// The pair.
        pair: PairName,
    },
    /// A pair failed for good.
    PairFailed {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Class and message.
        failure: Failure,
        /// Stages of the pair that will not run now, this one included: the bar grows by them.
        skipped: u64,
    },
    /// A stage failed in a way that may pass; it is tried again later.
    PairBackingOff {
        /// The pair.
        pair: PairName,
        /// The stage.
        stage: Stage,
        /// Class and message.
        failure: Failure,
        /// Wait in milliseconds.
        wait_ms: u64,
    },
    /// Leases of dead workers came back.
    Recovered {
        /// How many pairs.
        pairs: u64,
    },
    /// The run was asked to stop.
    Stopping {
        /// How.
        level: StopLevel,
        /// Why, in a few words: a signal, or too many failures.
        reason: String,
    },
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSummary {
    /// Pairs that were finished by this run.
    pub done: u64,
    /// Pairs that failed for good in this run.
    pub failed: u64,
    /// Stages computed by this run.
    pub stages: u64,
    /// Pairs still to do, among those selected.
    pub left: u64,
    /// Pairs among those selected that stand failed now, from this run or an earlier one: not 0 means exit code 3.
    pub failed_in_all: u64,
    /// Set when it was stopped before all was done, by a signal.
    pub stopped: bool,
    /// Set when it drained because of `max_failures`.
    pub too_many_failures: bool,
    /// Time that threads were computing stages, all together.
    pub at_work: Duration,
    /// Wall time in milliseconds.
    pub elapsed_ms: u64,
    /// Counts of the project at the end.
    pub status: StatusCounts,
}
