//! The right to work on one pair, and what is stored under it.

use crate::catalog::queue::counters::{CounterKey, cursor};
use crate::domain::{
    ArtifactSet, ContentHash, Failure, JobStatus, MetricOutcome, PairId, Stage, UnixMillis,
    WorkerId,
};

/// The right to work on one pair. Only a claim makes one, and only its holder can store anything for the pair.
///
/// `token` fences it: each claim and each recovery raises the job's token, so that a lease that was taken away
/// changes nothing any more.
#[derive(Debug)]
pub struct Lease {
    pub(crate) pair: PairId,
    pub(crate) worker: WorkerId,
    pub(crate) token: i64,
    pub(crate) cursor: Stage,
    /// Fingerprint of the result before the cursor.
    pub(crate) fingerprint: Option<FingerprintId>,
    pub(crate) attempt: u32,
    pub(crate) crashes: u32,
    pub(crate) exclusive: bool,
    /// Whether a stage was stored under it, so that no failure is known of the pair any more.
    pub(crate) cleared: bool,
}

impl Lease {
    /// The pair.
    pub const fn pair(&self) -> PairId {
        self.pair
    }

    /// First stage that has no result yet.
    pub const fn cursor(&self) -> Stage {
        self.cursor
    }

    /// Which try of this stage it is, from 1.
    pub const fn attempt(&self) -> u32 {
        self.attempt
    }

    /// Workers that died over the pair since its last finished stage.
    pub const fn crashes(&self) -> u32 {
        self.crashes
    }

    /// Whether nothing else may run beside it, because it needed too much or a worker died over it.
    pub const fn exclusive(&self) -> bool {
        self.exclusive
    }

    /// The fence: of two leases on a pair the one with the higher token is the later.
    pub const fn token(&self) -> i64 {
        self.token
    }

    /// Returns where the leased job is counted.
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

/// A job that a fenced statement changed: pair and token of the lease that still held.
#[derive(Debug, Clone, Copy, sqlx::FromRow)]
pub(crate) struct FencedRow {
    pub(crate) pair: i64,
    pub(crate) token: i64,
}

/// What became of a lease when something was stored under it.
#[derive(Debug)]
pub enum CheckpointOutcome {
    /// Stored; the lease goes on with the next stage.
    Lease(Lease),
    /// Stored; the pair is done.
    Done,
    /// The lease is lost: nothing was stored, the work is dropped.
    LeaseLost,
}

/// An input file as a stage read it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputVersion {
    /// Hash of its bytes.
    pub hash: ContentHash,
    /// Size, time and number of the file at that moment, as the store writes them.
    pub stat: String,
}

/// The input files of a pair as its worker read them; `None` for one that was not read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
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

/// One metric's numbers with the hash that verdicts are bound to.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricResult {
    /// The numbers.
    pub outcome: MetricOutcome,
    /// Hash over the numbers and the pictures a reviewer sees.
    pub result_hash: ContentHash,
}

/// A stage that is done: everything its checkpoint stores.
#[derive(Debug, Clone, PartialEq)]
pub struct StageCheckpoint {
    /// Which stage.
    pub stage: Stage,
    /// Number of the fingerprint it was computed with.
    pub fingerprint: FingerprintId,
    /// Content of the mesh it was computed from.
    pub mesh_hash: ContentHash,
    /// Content of the print, for stages that see it.
    pub print_hash: Option<ContentHash>,
    /// What the manifest said that it depends on.
    pub attributes: String,
    /// The numbers as JSON.
    pub outcome: String,
    /// The artifacts by role.
    pub files: ArtifactSet,
    /// Hash over outcome and files.
    pub result_hash: ContentHash,
    /// The metrics' results, for the last stage.
    pub metrics: Vec<MetricResult>,
    /// Input files as read for this pair.
    pub inputs: InputVersions,
    /// Computing time in milliseconds.
    pub ms: u64,
    /// When it was done.
    pub at: UnixMillis,
    /// When the next stage should be over.
    pub next_deadline: UnixMillis,
    /// The lease stands only if the worker's last sign of life is of then or later, by its own clock.
    pub alive_since: UnixMillis,
}

/// What a failure means for the job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureAction {
    /// Again at this time.
    BackOff {
        /// When.
        run_at: UnixMillis,
    },
    /// Again at once, with nothing beside it.
    RetryExclusive,
    /// Not again until somebody asks.
    Quarantine,
}

/// A stage that failed.
#[derive(Debug, Clone, PartialEq)]
pub struct StageFailure {
    /// Which stage.
    pub stage: Stage,
    /// Class and message.
    pub failure: Failure,
    /// What it means for the job.
    pub action: FailureAction,
    /// Number of the fingerprint it was run with.
    pub fingerprint: FingerprintId,
    /// What the manifest said.
    pub attributes: String,
    /// Input files as read for this pair.
    pub inputs: InputVersions,
    /// Computing time in milliseconds, where something was computed.
    pub ms: Option<u64>,
    /// When it failed.
    pub at: UnixMillis,
    /// The lease stands only if the worker's last sign of life is of then or later, by its own clock.
    pub alive_since: UnixMillis,
}

/// A fingerprint's number in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FingerprintId(pub(crate) i64);
