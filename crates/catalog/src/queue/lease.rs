//! Leases, and what is stored under them.

use std::time::{Duration, Instant};

use crate::db::row::{FromRow, Row, from_row};
use crate::queue::counters::{CounterKey, Cursor};
use crate::queue::kind::JobKind;
use crate::queue::pair_job::PairJob;
use crate::queue::provenance::FingerprintId;
use crate::queue::stage_record::StageCheckpoint;
use crate::{CatalogError, Result};
use mocban_core::domain::{JobStatus, PairId, WorkerId};
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

/// Longest time from the writing of files to the commit of their rows, which may wait for a server that is unavailable.
/// Later, the files may have been removed as unreferenced (`crates/store/src/collect.rs`), so their stages are computed again.
const LONGEST_COMMIT: Duration = Duration::from_mins(30);

/// Returns whether files that were written at this time may have been removed, because no row names them yet.
pub(crate) fn was_written_long_ago(write_began: Instant) -> bool {
    write_began.elapsed() > LONGEST_COMMIT / failpoint::time_scale("MOCBAN_COMMIT_TIME_SCALE")
}
