//! What is stored of a stage under a lease: its result with its metrics, or its failure.

use std::time::Instant;

use crate::queue::kind::JobKind;
use crate::queue::pair_job::PairJob;
use mocban_core::domain::{ArtifactSet, ContentHash, Failure, MetricOutcome, UnixMillis};

/// The scores of one metric with the hash that verdicts are bound to.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricResult {
    /// The scores.
    pub outcome: MetricOutcome,
    /// Hash of the numbers, except the confidence, and of the images that a reviewer sees.
    pub result_hash: ContentHash,
}

impl MetricResult {
    /// Returns whether all numbers except the confidence are finite. Others have no JSON, so they could not be read back.
    pub(crate) fn is_finite(&self) -> bool {
        let outcome = &self.outcome;
        let scores = &outcome.scores;
        let lost = &outcome.disagreement;
        [
            outcome.threshold_depth,
            outcome.angle_deg,
            outcome.scale,
            outcome.shift_px[0],
            outcome.shift_px[1],
            outcome.margin,
            scores.ssim,
            scores.nl_ssim,
            scores.iou,
            scores.iou_box,
            scores.dice,
            scores.density_print,
            scores.density_depth,
            lost.missing_ink,
            lost.missing_wood,
        ]
        .into_iter()
        .all(f64::is_finite)
    }
}

/// A finished stage: everything that its checkpoint stores.
#[derive(Debug, Clone, PartialEq)]
pub struct StageCheckpoint<K: JobKind = PairJob> {
    /// Which stage.
    pub stage: K::Stage,
    /// Settings, inputs and attributes that it was computed from.
    pub provenance: K::Provenance,
    /// The outcome as JSON.
    pub outcome: String,
    /// Artifacts by role.
    pub files: ArtifactSet,
    /// Hash over outcome and files.
    pub result_hash: ContentHash,
    /// Results of the metrics, for the last stage of a pair.
    pub metrics: Vec<MetricResult>,
    /// Versions of all input files read so far. Empty if they have not changed since an earlier stage listed them.
    pub inputs: K::Inputs,
    /// Computing time in milliseconds.
    pub ms: u64,
    /// When it finished.
    pub at: UnixMillis,
    /// Deadline of the next stage.
    pub next_deadline: UnixMillis,
    /// If the worker's last heartbeat is before this time, the lease is void. The time is by the worker's own clock.
    pub alive_since: UnixMillis,
    /// When the write of its files began, or earlier.
    pub write_began: Instant,
}

/// What happens to a failed job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureAction {
    /// Retry at a given time.
    BackOff {
        /// When.
        run_at: UnixMillis,
    },
    /// Retry at once, while no other pair runs. Only for pairs.
    RetryExclusive,
    /// No retry until a user requests one, or the settings or inputs change.
    Quarantine,
}

impl FailureAction {
    /// Returns the time until the next attempt in milliseconds: 0 if there is none, or if it does not wait.
    pub const fn wait_ms(self, now: UnixMillis) -> u64 {
        match self {
            Self::BackOff { run_at } => (run_at - now).unsigned_abs(),
            Self::RetryExclusive | Self::Quarantine => 0,
        }
    }
}

/// A failed stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageFailure<K: JobKind = PairJob> {
    /// Which stage.
    pub stage: K::Stage,
    /// Class and message.
    pub failure: Failure,
    /// What happens to the job.
    pub action: FailureAction,
    /// Settings, inputs and attributes of the attempt.
    pub provenance: K::Provenance,
    /// Versions of the input files that were read.
    pub inputs: K::Inputs,
    /// Computing time in milliseconds, if anything was computed.
    pub ms: Option<u64>,
    /// When it failed.
    pub at: UnixMillis,
    /// If the worker's last heartbeat is before this time, the lease is void. The time is by the worker's own clock.
    pub alive_since: UnixMillis,
}
