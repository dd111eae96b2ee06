//! Statements that take leases, keep them alive and give them back.

use std::cmp::Reverse;

use serde_json::json;

use crate::db::dialect::Sql;
use crate::db::error::Result;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{Cursor, Deltas, cursor};
use crate::queue::lease::{FencedRow, Lease};
use crate::queue::selection::PairSelection;
use mocban_core::domain::{JobStatus, Stage, UnixMillis, WorkerId};
use mocban_system::failpoint::{self, Point};

/// Which pairs a worker wants to lease.
#[derive(Debug, Clone)]
pub struct ClaimRequest {
    /// The worker.
    pub worker: WorkerId,
    /// Largest number of pairs to lease.
    pub slots: usize,
    /// Lease only pairs whose next stage is this one or an earlier one.
    pub until: Stage,
    /// If set, leases one pair that must run exclusively; otherwise, leases only pairs that need not.
    pub exclusive: bool,
    /// Lease only these pairs. `None` for all pairs.
    pub among: Option<PairSelection>,
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
            among: None,
            deadline,
            alive_since: UnixMillis::MIN,
        }
    }

    /// Returns the largest number of pairs that the claim may lease.
    pub(crate) fn limit(&self) -> i64 {
        let slots = if self.exclusive {
            self.slots.min(1)
        } else {
            self.slots
        };
        slots as i64
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

/// Leases the first ready jobs in the order of the index `job_ready`. While an exclusive job is leased, no worker holds
/// another lease. The limit is `+?`, which hides its value from SQLite's query planner. With a plain `?`, SQLite would
/// prepare the statement again each time.
pub(crate) const CLAIM: &str = "
UPDATE job SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT pair FROM job WHERE status = 0 AND stage <= ? AND exclusive = ?
    ORDER BY prio, stage DESC, pair LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING pair, worker, token, stage, fingerprint, attempt, exclusive";

/// Like [`CLAIM`], but leases only selected pairs.
const CLAIM_AMONG: &str = "
UPDATE job SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT j.pair FROM json_each(?) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
    WHERE j.status = 0 AND j.stage <= ? AND j.exclusive = ?
    ORDER BY j.prio, j.stage DESC, j.pair LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING pair, worker, token, stage, fingerprint, attempt, exclusive";

/// Gives leases back. Their attempts do not count.
pub(crate) const RELEASE: Sql = Sql::pair(
    "
UPDATE job SET status = 0, worker = NULL, deadline = NULL, attempt = max(attempt - 1, 0)
FROM jsonb_each(?) AS item
WHERE job.pair = item.value ->> 0 AND job.worker = item.value ->> 1 AND job.token = item.value ->> 2
    AND job.status = 1
RETURNING pair, token",
    "
UPDATE job SET status = 0, worker = NULL, deadline = NULL, attempt = greatest(job.attempt - 1, 0)
FROM json_array_elements(CAST(? AS json)) AS item (value)
WHERE job.pair = CAST(item.value ->> 0 AS bigint) AND job.worker = CAST(item.value ->> 1 AS bigint)
    AND job.token = CAST(item.value ->> 2 AS bigint) AND job.status + 0 = 1
RETURNING job.pair, job.token",
);

/// Stores a heartbeat, unless the worker has ended, or its last heartbeat is so old that others may consider it dead. A
/// worker that others took for dead is then known to live.
pub(crate) const HEARTBEAT: &str = "
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

/// Adds a claim to a script, in SQLite.
pub(crate) fn add_claim(script: &mut Script, request: &ClaimRequest) -> Statement<Lease> {
    let statement = script.add(match &request.among {
        Some(_) => CLAIM_AMONG,
        None => CLAIM,
    });
    script.bind(request.worker.0);
    script.bind(request.deadline);
    if let Some(among) = &request.among {
        script.bind(among.json.clone());
    }
    script.bind(cursor(request.until));
    script.bind(i64::from(request.exclusive));
    script.bind(request.limit());
    script.bind(request.worker.0);
    script.bind(request.alive_since);
    script.bind(i64::from(request.exclusive));
    statement
}

/// Returns the key by which claims sort pairs.
pub(crate) const fn order(turn: Cursor, pair: i64) -> (Reverse<Cursor>, i64) {
    (Reverse(turn), pair)
}

/// Returns claimed leases in the order of the claim. `RETURNING` promises no order.
pub(crate) fn in_order(mut leases: Vec<Lease>) -> Vec<Lease> {
    leases.sort_by_key(|lease| order(cursor(lease.cursor), lease.pair.0));
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

/// Adds the release of leases to a script.
pub(crate) fn add_release<'l>(
    script: &mut Script,
    leases: impl Iterator<Item = &'l Lease>,
) -> Result<Option<Statement<FencedRow>>> {
    let fences = leases.map(|lease| json!([lease.pair, lease.worker, lease.token]));
    script.add_over(RELEASE, fences)
}

/// Counts released leases.
pub(crate) fn count_released<'l>(leases: impl Iterator<Item = &'l Lease>, deltas: &mut Deltas) {
    for lease in leases {
        let to = lease.counter_key().with_status(JobStatus::Ready);
        deltas.move_job(lease.counter_key(), to);
    }
}
