//! Statements that take leases and end back-offs, for pairs and blocks.

use std::cmp::Reverse;

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_as;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Cursor, Deltas};
use crate::queue::kind::{JobKind, StoredKind, Template};
use crate::queue::lease::{Lease, position};
use crate::queue::pair_job::PairJob;
use mocban_core::domain::{JobStatus, Stage, UnixMillis, WorkerId};
use mocban_system::failpoint::{self, Point};

/// Which pairs or blocks a worker wants to lease.
#[derive(Debug, Clone)]
pub struct ClaimRequest<K: JobKind = PairJob> {
    /// The worker.
    pub worker: WorkerId,
    /// Largest number to lease.
    pub slots: usize,
    /// Lease only those whose next stage is this one or an earlier one.
    pub until: K::Stage,
    /// If set, leases one pair that must run exclusively; otherwise, leases only pairs that need not.
    pub exclusive: bool,
    /// Lease only these. `None` for all.
    pub selection: Option<K::Selection>,
    /// Deadline of the first stage.
    pub deadline: UnixMillis,
    /// If the worker's last heartbeat is before this time, nothing is leased. The time is by the worker's own clock.
    pub alive_since: UnixMillis,
}

impl ClaimRequest {
    /// Returns a request for pairs that may run beside others, whatever their next stage. The age of the last
    /// heartbeat is not limited.
    pub const fn new(worker: WorkerId, slots: usize, deadline: UnixMillis) -> Self {
        Self {
            worker,
            slots,
            until: Stage::Register,
            exclusive: false,
            selection: None,
            deadline,
            alive_since: UnixMillis::MIN,
        }
    }
}

impl<K: JobKind> ClaimRequest<K> {
    /// Returns the largest number that the claim may lease.
    pub(crate) fn limit(&self) -> i64 {
        let slots = if self.exclusive {
            self.slots.min(1)
        } else {
            self.slots
        };
        slots as i64
    }
}

/// Leases the first ready jobs, for pairs in the order of the index `job_ready`. While a pair must run exclusively, no
/// worker leases anything. The limit is `+?`, which hides its value from SQLite's query planner. With a plain `?`, SQLite
/// would prepare the statement again each time.
pub(crate) static CLAIM: Template = Template::new(
    "
UPDATE {job} SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE {unit} IN (
    SELECT {unit} FROM {job} WHERE status = 0 AND stage <= ? AND {exclusive} = ?
    ORDER BY {prio}stage DESC, {unit} LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING {unit} AS unit, worker, token, stage, {fingerprint} AS fingerprint, attempt, {exclusive} AS exclusive",
);

/// Like [`CLAIM`], but leases only selected jobs.
static CLAIM_AMONG: Template = Template::new(
    "
UPDATE {job} SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE {unit} IN (
    SELECT j.{unit} FROM json_each(?) AS wanted CROSS JOIN {job} AS j ON j.{unit} = wanted.value
    WHERE j.status = 0 AND j.stage <= ? AND {exclusive} = ?
    ORDER BY {prio}j.stage DESC, j.{unit} LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING {unit} AS unit, worker, token, stage, {fingerprint} AS fingerprint, attempt, {exclusive} AS exclusive",
);

/// Ends the back-offs that are due at `?1`. Also ends back-offs beyond `?2`, which only a clock jump can cause.
pub(crate) static DUE: Template = Template::new(
    "
UPDATE {job} SET status = 0, run_at = NULL WHERE status = 2 AND (run_at <= ?1 OR run_at > ?2)
RETURNING stage, status, coalesce({fingerprint}, 0) AS fingerprint",
);

/// Adds a claim to a script, in SQLite.
pub(crate) fn add_claim<K: StoredKind>(
    script: &mut Script,
    request: &ClaimRequest<K>,
) -> Statement<Lease<K>> {
    let claim = match &request.selection {
        Some(_) => &CLAIM_AMONG,
        None => &CLAIM,
    };
    let statement = script.add(claim.of::<K>());
    script.bind(request.worker.0);
    script.bind(request.deadline);
    if let Some(selection) = &request.selection {
        script.bind(K::ids(selection).into_owned());
    }
    script.bind(position::<K>(request.until));
    script.bind(i64::from(request.exclusive));
    script.bind(request.limit());
    script.bind(request.worker.0);
    script.bind(request.alive_since);
    script.bind(i64::from(request.exclusive));
    statement
}

/// Returns the key by which claims sort jobs.
pub(crate) const fn order(turn: Cursor, unit: i64) -> (Reverse<Cursor>, i64) {
    (Reverse(turn), unit)
}

/// Returns claimed leases in the order of the claim. `RETURNING` promises no order.
pub(crate) fn in_order<K: JobKind>(mut leases: Vec<Lease<K>>) -> Vec<Lease<K>> {
    leases.sort_by_key(|lease| order(position::<K>(lease.cursor), lease.id()));
    for lease in &leases {
        failpoint::hit(lease.cursor, Point::Claiming, None);
    }
    leases
}

/// Counts claimed leases.
pub(crate) fn count_claimed(leases: &[Lease], deltas: &mut Deltas) {
    for lease in leases {
        let from = lease.counter_key().with_status(JobStatus::Ready);
        deltas.move_job(from, lease.counter_key());
    }
}

/// Counts released leases.
pub(crate) fn count_released<'l>(leases: impl Iterator<Item = &'l Lease>, deltas: &mut Deltas) {
    for lease in leases {
        let to = lease.counter_key().with_status(JobStatus::Ready);
        deltas.move_job(lease.counter_key(), to);
    }
}

/// Ends the back-offs that are due, and those with more than `longest` milliseconds left. Returns the number of jobs made
/// ready.
pub(crate) async fn release_due<K: StoredKind>(
    conn: &mut Conn,
    now: UnixMillis,
    longest: i64,
    deltas: &mut Deltas,
) -> Result<u64> {
    let due = query_as(DUE.of::<K>()).bind(now).bind(now + longest);
    let due: Vec<CounterKey> = due.fetch_all(conn).await?;
    for key in &due {
        deltas.move_job(key.with_status(JobStatus::Backoff), *key);
    }
    Ok(due.len() as u64)
}
