//! Leases, and what is stored under them.

use std::time::{Duration, Instant};

use crate::db::row::{FromRow, Row, from_row};
use crate::queue::counters::{CounterKey, Cursor};
use crate::queue::kind::JobKind;
use crate::queue::pair_job::PairJob;
use crate::queue::provenance::FingerprintId;
use crate::{CatalogError, Result};
use mocban_core::domain::{
    ArtifactSet, ContentHash, Failure, JobStatus, MetricOutcome, PairId, UnixMillis, WorkerId,
};
use mocban_system::failpoint;

/// The right to run stages of one pair or block. A claim creates the lease, and a checkpoint continues it with the next
/// stage. Results and failures of stages are stored only under a valid lease: the worker has not ended, its last heartbeat is
/// recent, and the job has the token of the lease. The deadline in the row of the job is used only to recover it.
///
/// `token` is the fencing token: the number of the job's owner. A claim, a recovery, a repair, a new cut and the return of a
/// retired pair increase the token in the row of the job. A write names the token of its lease, and is refused if the row
/// has another.
#[derive(Debug, PartialEq, Eq)]
pub struct Lease<K: JobKind = PairJob> {
    pub(crate) unit: K::Unit,
    pub(crate) worker: WorkerId,
    pub(crate) token: i64,
    pub(crate) cursor: K::Stage,
    /// Fingerprint of the result before the cursor. `None` for a block.
    pub(crate) fingerprint: Option<FingerprintId>,
    pub(crate) attempt: u32,
    pub(crate) exclusive: bool,
    /// Whether a stage was stored under this lease, which removed the failure.
    pub(crate) cleared: bool,
}

impl<K: JobKind> FromRow for Lease<K> {
    fn from_row(row: &Row) -> Result<Self> {
        let index: i64 = row.get("stage")?;
        let cursor = usize::try_from(index).ok().and_then(K::stage);
        let unknown = || CatalogError::Corrupt(format!("stage {index} is unknown"));
        Ok(Self {
            unit: K::unit(row.get("unit")?),
            worker: row.get("worker")?,
            token: row.get("token")?,
            cursor: cursor.ok_or_else(unknown)?,
            fingerprint: row.get("fingerprint")?,
            attempt: row.get("attempt")?,
            exclusive: row.get("exclusive")?,
            cleared: false,
        })
    }
}

impl Lease {
    /// Returns the pair.
    pub const fn pair(&self) -> PairId {
        self.unit
    }
}

impl<K: JobKind> Lease<K> {
    /// Returns the row id of the pair or block.
    pub fn id(&self) -> i64 {
        K::id(self.unit)
    }

    /// Returns the worker that holds the lease.
    pub const fn worker(&self) -> WorkerId {
        self.worker
    }

    /// Returns the next stage to run.
    pub const fn cursor(&self) -> K::Stage {
        self.cursor
    }

    /// Returns the number of the attempt at this stage, from 1.
    pub const fn attempt(&self) -> u32 {
        self.attempt
    }

    /// Returns whether no other pair may run at the same time, because the pair exceeded a resource limit or its worker died
    /// or hung. Blocks have no such mark, because a process claims no pairs beside a block.
    pub const fn exclusive(&self) -> bool {
        self.exclusive
    }

    /// Returns the counter key of the leased job.
    pub(crate) fn counter_key(&self) -> CounterKey {
        let fingerprint = self.fingerprint.map(|FingerprintId(id)| id);
        CounterKey::new(position::<K>(self.cursor), JobStatus::Leased, fingerprint)
    }

    /// Returns whether a fenced statement changed the job under this lease.
    pub(crate) fn is_in(&self, rows: &[FencedRow]) -> bool {
        let id = self.id();
        rows.iter()
            .any(|row| (row.unit, row.token) == (id, self.token))
    }

    /// Returns the lease after a checkpoint that ended with this stage, or `None` if the job is done.
    pub(crate) fn after(&self, last: &StageCheckpoint<K>) -> Option<Self> {
        Some(Self {
            cursor: K::next(last.stage)?,
            fingerprint: K::fingerprint(&last.provenance),
            attempt: 1,
            cleared: true,
            ..*self
        })
    }
}

/// Returns the position of a job with this next stage.
pub(crate) fn position<K: JobKind>(stage: K::Stage) -> Cursor {
    K::index(stage) as Cursor
}

/// A job that was changed under a lease, with the token of that lease.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FencedRow {
    pub(crate) unit: i64,
    pub(crate) token: i64,
}

from_row! { FencedRow { unit, token } }

/// The state of a lease after a checkpoint.
#[derive(Debug, PartialEq, Eq)]
pub enum CheckpointOutcome<K: JobKind = PairJob> {
    /// Stored; the lease continues with the next stage.
    Lease(Lease<K>),
    /// Stored; the pair or block is done.
    Done,
    /// Nothing was stored, because the lease was lost, or because the files were written so long ago that they may have been
    /// removed.
    Refused,
}

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

/// Longest time from the writing of files to the commit of their rows, which may wait for a server that is unavailable.
/// Later, the files may have been removed as unreferenced (`crates/store/src/collect.rs`), so their stages are computed again.
const LONGEST_COMMIT: Duration = Duration::from_mins(30);

/// Returns whether files that were written at this time may have been removed, because no row names them yet.
pub(crate) fn was_written_long_ago(write_began: Instant) -> bool {
    write_began.elapsed() > LONGEST_COMMIT / failpoint::time_scale("MOCBAN_COMMIT_TIME_SCALE")
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
