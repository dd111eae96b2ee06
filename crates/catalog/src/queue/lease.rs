//! Leases, with three kinds of statements: some change a job only while its lease is valid, and return a row for each job that
//! they changed; others end leases or read them. What is stored with a changed job is in `checkpoint.rs`.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::json;

use crate::db::conn::Conn;
use crate::db::query::query_as;
use crate::db::row::{FromRow, Row, from_row};
use crate::db::rows::json_array;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Cursor};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::pair_job::PairJob;
use crate::queue::provenance::FingerprintId;
use crate::queue::stage_record::StageCheckpoint;
use crate::{CatalogError, Result};
use mocban_core::domain::{JobStatus, PairId, UnixMillis, WorkerId};
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

impl<K: JobKind> CheckpointOutcome<K> {
    /// Returns the outcome of a checkpoint. `next` is the lease of the next stage, if there is one.
    pub(crate) fn of(is_stored: bool, next: Option<Lease<K>>) -> Self {
        match (is_stored, next) {
            (false, _) => Self::Refused,
            (true, Some(lease)) => Self::Lease(lease),
            (true, None) => Self::Done,
        }
    }
}

/// A worker's sign of life.
#[derive(Debug, Clone)]
pub(crate) struct Heartbeat {
    pub(crate) worker: WorkerId,
    pub(crate) now: UnixMillis,
    pub(crate) alive_since: UnixMillis,
    /// Its counts and times as JSON. `None` leaves those of the last heartbeat.
    pub(crate) metrics: Option<String>,
}

/// Stores a heartbeat, unless the worker has ended, or its last heartbeat is so old that others may consider it dead. A
/// worker that others took for dead is then known to live.
const HEARTBEAT: &str = "
UPDATE worker SET heartbeat = ?, died = 0, metrics = coalesce(?, metrics)
WHERE id = ? AND ended IS NULL AND heartbeat >= ? RETURNING id";

/// Adds a heartbeat to a script. The statement returns the worker's id, or nothing if the heartbeat is refused.
pub(crate) fn add_heartbeat(script: &mut Script, heartbeat: &Heartbeat) -> Statement<(i64,)> {
    let statement = script.add(HEARTBEAT);
    script.bind(heartbeat.now);
    script.bind(heartbeat.metrics.clone());
    script.bind(heartbeat.worker.0);
    script.bind(heartbeat.alive_since);
    statement
}

/// A lease, and the finished stages to store under it, in the order they were computed.
pub(crate) type LeasedCheckpoints<K = PairJob> = (Lease<K>, Vec<StageCheckpoint<K>>);

/// Advances jobs. Skips a job if its lease was lost or its worker counts as dead, and the job of a block if it is not at the
/// stage of the lease. Resets the crash count. Marks the job of a pair dirty if the new results do not build on the stored
/// ones: see `AdvancedJob` in `checkpoint.rs`.
pub(crate) static ADVANCE: Template = Template::new(
    "
UPDATE {job} SET stage = [next], status = [status], worker = CASE WHEN [status] = 1 THEN worker END,
    deadline = [deadline], attempt = 1, crashes = 0{and_advance}
FROM jsonb_each(?) AS item
WHERE {job}.{unit} = [unit] AND {job}.worker = [worker] AND {job}.token = [token] AND {job}.status = 1{and_in_place} AND EXISTS (
        SELECT 1 FROM worker AS w
        WHERE w.id = {job}.worker AND w.ended IS NULL AND w.heartbeat >= [alive_since])
RETURNING {unit} AS unit, token",
);

/// The part of a statement of PostgreSQL that advances the jobs of pairs if their leases are valid: the same as [`ADVANCE`],
/// and the job must still be at the stage of its lease. The columns of `item` are `JobRows` in `server_checkpoint.rs`.
/// `job.status + 0` keeps the planner from the index of leases, which contains all leases that ended while a snapshot is held.
pub(crate) const ADVANCED_ON_SERVER: &str = "
advanced AS (
    UPDATE job SET stage = item.next, status = item.status,
        worker = CASE WHEN item.status = 1 THEN job.worker END, deadline = item.deadline,
        attempt = 1, crashes = 0, exclusive = 0, low_confidence = item.low_confidence, fingerprint = item.fingerprint,
        dirty = CASE WHEN job.dirty = 1 OR item.mixed = 1 OR (item.first IS NOT NULL AND job.fingerprint IS DISTINCT FROM (
            SELECT upstream FROM fingerprint WHERE id = item.first)) THEN 1 ELSE 0 END
    FROM item
    WHERE job.pair = item.pair AND job.worker = item.worker AND job.token = item.token AND job.status + 0 = 1
        AND job.stage = item.stage AND EXISTS (
            SELECT 1 FROM worker AS w
            WHERE w.id = item.worker AND w.ended IS NULL AND w.heartbeat >= item.alive_since)
    RETURNING item.*)";

/// Updates failed jobs. Skips a job if its lease was lost or its worker counts as dead. `status + 0` keeps the planner of
/// PostgreSQL from the index of leases, which contains all leases that ended while a snapshot is held.
pub(crate) static FAIL: Template = Template::new(
    "
UPDATE {job} SET stage = min({job}.stage, [stage]), status = [status], run_at = [run_at], worker = NULL, deadline = NULL{and_fail}
FROM jsonb_each(?) AS item
WHERE {job}.{unit} = [unit] AND {job}.worker = [worker] AND {job}.token = [token] AND {job}.status + 0 = 1 AND EXISTS (
        SELECT 1 FROM worker AS w
        WHERE w.id = {job}.worker AND w.ended IS NULL AND w.heartbeat >= [alive_since])
RETURNING {unit} AS unit, token, stage, status, coalesce({fingerprint}, 0) AS fingerprint",
);

/// Gives leases back. Their attempts do not count. `status + 0` keeps the planner of PostgreSQL from the index of leases,
/// which contains all leases that ended while a snapshot is held.
pub(crate) static RELEASE: Template = Template::new(
    "
UPDATE {job} SET status = 0, worker = NULL, deadline = NULL, attempt = max({job}.attempt - 1, 0)
FROM jsonb_each(?) AS item
WHERE {job}.{unit} = [0] AND {job}.worker = [1] AND {job}.token = [2] AND {job}.status + 0 = 1
RETURNING {unit} AS unit, token",
);

/// Adds the release of leases to a script.
pub(crate) fn add_release<'l, K: StoredKind>(
    script: &mut Script,
    leases: impl Iterator<Item = &'l Lease<K>>,
) -> Result<Option<Statement<FencedRow>>> {
    let fences = leases.map(|lease| json!([lease.id(), lease.worker, lease.token]));
    script.add_over(RELEASE.of::<K>(), fences)
}

/// Selects a job if its lease is valid, and locks it, so that the lease cannot be lost before the transaction ends.
pub(crate) static LEASED: Template = Template::new(
    "
SELECT {unit} AS unit, token FROM {job}
WHERE {unit} = ?1 AND worker = ?2 AND token = ?3 AND status = 1 AND EXISTS (
        SELECT 1 FROM worker AS w WHERE w.id = {job}.worker AND w.ended IS NULL AND w.heartbeat >= ?4) FOR UPDATE",
);

/// Sends jobs back to a stage, never forward. Ends their leases too: the token increases, so later writes under an old
/// lease fail.
pub(crate) static SEND_BACK: Template = Template::new(
    "
UPDATE {job} SET stage = min({job}.stage, [1]), status = 0, run_at = NULL, attempt = 0, crashes = 0, worker = NULL,
    deadline = NULL, token = token + 1{and_send_back}
FROM json_each(?1) AS item WHERE {job}.{unit} = [0]
RETURNING {unit} AS unit, stage, status, coalesce({fingerprint}, 0) AS fingerprint",
);

/// Selects the leases of a worker.
static LEASES_OF_WORKER: Template = Template::new(
    "
SELECT {unit} AS unit, worker, token, stage, {fingerprint} AS fingerprint, attempt, {exclusive} AS exclusive
FROM {job} WHERE status = 1 AND worker = ?1 ORDER BY {unit}",
);

/// Returns the leases of a worker.
pub(crate) async fn leases<K: StoredKind>(
    conn: &mut Conn,
    worker: WorkerId,
) -> Result<Vec<Lease<K>>> {
    let leases = query_as(LEASES_OF_WORKER.of::<K>()).bind(worker.0);
    leases.fetch_all(conn).await
}

/// Longest time from the writing of files to the commit of their rows, which may wait for a server that is unavailable.
/// Later, the files may have been removed as unreferenced (`crates/store/src/collect.rs`), so their stages are computed again.
const LONGEST_COMMIT: Duration = Duration::from_mins(30);

/// Returns whether files of a stage may have been removed, because no row names them yet.
pub(crate) fn is_late<K: JobKind>((_, stages): &LeasedCheckpoints<K>) -> bool {
    let longest = LONGEST_COMMIT / failpoint::time_scale("MOCBAN_COMMIT_TIME_SCALE");
    let mut stages = stages.iter();
    stages.any(|stage| stage.write_began.elapsed() > longest)
}

/// Returns the counter key of a job after a stage is stored.
pub(crate) fn key_after<K: JobKind>(stage: &StageCheckpoint<K>) -> CounterKey {
    let (cursor, status) = match K::next(stage.stage) {
        Some(next) => (position::<K>(next), JobStatus::Leased),
        None => (K::STAGES as Cursor, JobStatus::Done),
    };
    let fingerprint = K::fingerprint(&stage.provenance);
    CounterKey::new(cursor, status, fingerprint.map(|FingerprintId(id)| id))
}

/// Returns the position and the status of a job after stages are stored, or `None` if there are none.
pub(crate) fn position_after<K: JobKind>(
    stages: &[StageCheckpoint<K>],
) -> Option<(Cursor, JobStatus)> {
    let after = key_after(stages.last()?);
    Some((after.cursor, after.status))
}

/// Selects jobs by pair or block.
static JOBS: Template = Template::new(
    "
SELECT j.{unit} AS unit, j.token, j.stage, j.status, j.worker FROM json_each(?1) AS wanted
    CROSS JOIN {job} AS j ON j.{unit} = CAST(wanted.atom AS bigint)",
);

/// The state of a job.
struct StoredJob {
    unit: i64,
    token: i64,
    stage: i64,
    status: JobStatus,
    worker: Option<i64>,
}

from_row! { StoredJob { unit, token, stage, status, worker } }

/// Returns the jobs of checkpoints, and of failures and releases (`ended`), which an earlier commit has already stored.
pub(crate) async fn stored_before<'i, K: StoredKind>(
    conn: &mut Conn,
    checkpoints: impl Iterator<Item = &'i LeasedCheckpoints<K>>,
    ended: impl Iterator<Item = &'i Lease<K>>,
) -> Result<Vec<FencedRow>> {
    let checkpoints: BTreeMap<_, _> = checkpoints
        .filter_map(|(lease, stages)| Some((lease.id(), (lease, position_after(stages)?))))
        .collect();
    let ended: BTreeMap<_, _> = ended.map(|lease| (lease.id(), lease)).collect();
    let units: Vec<_> = checkpoints.keys().chain(ended.keys()).copied().collect();
    if units.is_empty() {
        return Ok(Vec::new());
    }
    let jobs = query_as(JOBS.of::<K>()).bind(json_array(units));
    let jobs = jobs.fetch_all(conn);
    let jobs: Vec<StoredJob> = jobs.await?;
    let is_stored = |job: &StoredJob| {
        if let Some((lease, (stage, status))) = checkpoints.get(&job.unit) {
            let worker = (*status == JobStatus::Leased).then_some(lease.worker.0);
            return job.token == lease.token
                && (job.stage, job.status, job.worker) == (*stage, *status, worker);
        }
        ended
            .get(&job.unit)
            .is_some_and(|lease| job.token == lease.token && job.worker.is_none())
    };
    let stored = jobs.into_iter().filter(is_stored);
    Ok(stored
        .map(|job| FencedRow {
            unit: job.unit,
            token: job.token,
        })
        .collect())
}

/// Returns whether an earlier commit has stored a failure or a release under this lease.
pub(crate) async fn is_end_stored<K: StoredKind>(
    conn: &mut Conn,
    lease: &Lease<K>,
) -> Result<bool> {
    let stored = stored_before(conn, [].into_iter(), [lease].into_iter()).await?;
    Ok(lease.is_in(&stored))
}
