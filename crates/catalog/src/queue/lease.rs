//! Leases, and what is stored under them.

use std::time::{Duration, Instant};

use serde::Serialize;
use sqlx::error::BoxDynError;

use crate::db::row::from_row;
use crate::db::value::{Argument, FromValue, Value as ColumnValue};
use crate::queue::counters::{CounterKey, cursor};
use mocban_core::domain::{
    ArtifactSet, ContentHash, Failure, InputVersion, JobStatus, MetricOutcome, PairId, Stage,
    UnixMillis, WorkerId,
};
use mocban_system::failpoint;

/// The right to run stages of one pair. A claim creates the lease, and a checkpoint continues it. Results and failures
/// of stages are stored only under a valid lease.
///
/// `token` is the fencing token. Each claim, recovery and repair increases the job's token, so a write under
/// an older lease changes nothing.
#[derive(Debug)]
pub struct Lease {
    pub(crate) pair: PairId,
    pub(crate) worker: WorkerId,
    pub(crate) token: i64,
    pub(crate) cursor: Stage,
    /// Fingerprint of the result before the cursor.
    pub(crate) fingerprint: Option<FingerprintId>,
    pub(crate) attempt: u32,
    pub(crate) exclusive: bool,
    /// Whether a stage was stored under this lease, which removed the pair's failure.
    pub(crate) cleared: bool,
}

from_row! { Lease { pair, worker, token, cursor: "stage", fingerprint, attempt, exclusive, cleared = false } }

impl Lease {
    /// Returns the pair.
    pub const fn pair(&self) -> PairId {
        self.pair
    }

    /// Returns the next stage to run.
    pub const fn cursor(&self) -> Stage {
        self.cursor
    }

    /// Returns the number of the attempt at this stage, from 1.
    pub const fn attempt(&self) -> u32 {
        self.attempt
    }

    /// Returns whether the pair must run exclusively, because it exceeded a resource limit or its worker died or hung.
    pub const fn exclusive(&self) -> bool {
        self.exclusive
    }

    /// Returns the counter key of the leased job.
    pub(crate) fn counter_key(&self) -> CounterKey {
        let fingerprint = self.fingerprint.map(|FingerprintId(id)| id);
        CounterKey::new(cursor(self.cursor), JobStatus::Leased, fingerprint)
    }

    /// Returns whether a fenced statement changed the job under this lease.
    pub(crate) fn is_in(&self, rows: &[FencedRow]) -> bool {
        rows.iter()
            .any(|row| (row.pair, row.token) == (self.pair.0, self.token))
    }
}

/// A job that was changed under a lease, with the token of that lease.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FencedRow {
    pub(crate) pair: i64,
    pub(crate) token: i64,
}

from_row! { FencedRow { pair, token } }

/// The state of a lease after a checkpoint.
#[derive(Debug)]
pub enum CheckpointOutcome {
    /// Stored; the lease continues with the next stage.
    Lease(Lease),
    /// Stored; the pair is done.
    Done,
    /// The lease was lost and nothing was stored.
    LeaseLost,
}

/// Versions of a pair's input files that its worker read. `None` for a file that was not read.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct InputVersions {
    /// The mesh.
    pub mesh: Option<InputVersion>,
    /// The print.
    pub print: Option<InputVersion>,
}

impl InputVersions {
    /// Returns whether neither file was read.
    pub(crate) const fn is_empty(&self) -> bool {
        self.mesh.is_none() && self.print.is_none()
    }
}

/// The scores of one metric with the hash that verdicts are bound to.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricResult {
    /// The scores.
    pub outcome: MetricOutcome,
    /// Hash of the numbers, except the confidence, and of the images that a reviewer sees.
    pub result_hash: ContentHash,
}

/// A finished stage: everything that its checkpoint stores.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageCheckpoint {
    /// Which stage.
    pub stage: Stage,
    /// Fingerprint of its settings.
    pub fingerprint: FingerprintId,
    /// Hash of the mesh.
    pub mesh_hash: ContentHash,
    /// Hash of the print, for stages that read it.
    pub print_hash: Option<ContentHash>,
    /// The manifest attributes it depends on, as JSON.
    pub attributes: String,
    /// The outcome as JSON.
    pub outcome: String,
    /// Artifacts by role.
    pub files: ArtifactSet,
    /// Hash over outcome and files.
    pub result_hash: ContentHash,
    /// Results of the metrics, for the last stage.
    #[serde(skip)]
    pub metrics: Vec<MetricResult>,
    /// Versions of all input files read so far. Empty if they have not changed since an earlier stage listed them.
    #[serde(skip)]
    pub inputs: InputVersions,
    /// Computing time in milliseconds.
    pub ms: u64,
    /// When it finished.
    pub at: UnixMillis,
    /// Deadline of the next stage.
    pub next_deadline: UnixMillis,
    /// If the worker's last heartbeat is before this time, the lease is void. The time is by the worker's own clock.
    pub alive_since: UnixMillis,
    /// When the write of its files began.
    #[serde(skip)]
    pub written: Instant,
}

/// Longest time from the writing of files to the commit of their rows, which may wait for a server that is unavailable.
/// Later, the files may have been removed as unreferenced (`store/collect.rs`), so their stages are computed again.
const LONGEST_COMMIT: Duration = Duration::from_mins(30);

/// Returns whether files that were written at this time may have been removed, because no row names them yet.
pub(crate) fn was_written_long_ago(written: Instant) -> bool {
    written.elapsed() > LONGEST_COMMIT / failpoint::time_scale("MOCBAN_COMMIT_TIME_SCALE")
}

/// What happens to a failed job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureAction {
    /// Retry at a given time.
    BackOff {
        /// When.
        run_at: UnixMillis,
    },
    /// Retry at once, while no other pair runs.
    RetryExclusive,
    /// No retry until a user requests one.
    Quarantine,
}

/// A failed stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageFailure {
    /// Which stage.
    pub stage: Stage,
    /// Class and message.
    pub failure: Failure,
    /// What happens to the job.
    pub action: FailureAction,
    /// Fingerprint of its settings.
    pub fingerprint: FingerprintId,
    /// The manifest attributes it depends on, as JSON.
    pub attributes: String,
    /// Input files that were read.
    pub inputs: InputVersions,
    /// Computing time in milliseconds, if anything was computed.
    pub ms: Option<u64>,
    /// When it failed.
    pub at: UnixMillis,
    /// If the worker's last heartbeat is before this time, the lease is void. The time is by the worker's own clock.
    pub alive_since: UnixMillis,
}

/// Row id of a fingerprint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct FingerprintId(pub i64);

impl FromValue for FingerprintId {
    fn from_value(value: ColumnValue<'_>) -> Result<Self, BoxDynError> {
        Ok(Self(i64::from_value(value)?))
    }
}

impl From<FingerprintId> for Argument {
    fn from(FingerprintId(id): FingerprintId) -> Self {
        Self::from(id)
    }
}

impl From<Option<FingerprintId>> for Argument {
    fn from(id: Option<FingerprintId>) -> Self {
        Self::from(id.map(|FingerprintId(id)| id))
    }
}
