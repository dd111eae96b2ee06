//! Statements that take leases, keep them alive and give them back.

use std::cmp::Reverse;

use serde_json::json;

use crate::catalog::db::dialect::Sql;
use crate::catalog::db::error::Result;
use crate::catalog::db::script::{Script, Statement};
use crate::catalog::queue::counters::{Cursor, Deltas, cursor};
use crate::catalog::queue::lease::{FencedRow, Lease};
use crate::catalog::queue::selection::PairSelection;
use crate::domain::{JobStatus, Stage, UnixMillis, WorkerId};
use crate::failpoint::{self, Point};

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

/// Where a claim on a server begins: behind this pair among those with the same next stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Behind {
    /// The next stage.
    pub(crate) turn: Cursor,
    pub(crate) pair: i64,
    /// Whether to search all pairs if there are too few behind this one.
    pub(crate) or_anywhere: bool,
}

impl Behind {
    /// Begins behind the pair of a lease.
    pub(crate) const fn pair_of(lease: &Lease) -> Self {
        Self {
            turn: cursor(lease.cursor),
            pair: lease.pair.0,
            or_anywhere: true,
        }
    }

    /// Returns whether a leased pair is behind this one and has the same next stage.
    pub(crate) const fn is_before(self, lease: &Lease) -> bool {
        cursor(lease.cursor) == self.turn && lease.pair.0 > self.pair
    }

    /// Returns whether a leased pair is behind this one in the order of claims.
    pub(crate) fn is_before_in_order(self, lease: &Lease) -> bool {
        order(cursor(lease.cursor), lease.pair.0) > order(self.turn, self.pair)
    }
}

/// Builds the text that selects ready jobs for PostgreSQL from the tables, a condition and a limit. It skips jobs that
/// another process is about to lease.
macro_rules! ready_in_postgres {
    ($from:literal, $condition:literal, $limit:literal) => {
        concat!(
            "SELECT j.pair FROM ",
            $from,
            " WHERE j.status = 0",
            $condition,
            " AND j.stage <= ? AND j.exclusive = ?
        ORDER BY j.prio, j.turn DESC, j.pair LIMIT ",
            $limit,
            " FOR UPDATE OF j SKIP LOCKED"
        )
    };
}

/// Builds the text of a claim for PostgreSQL from the text that selects its jobs. An exclusive job excludes only leases
/// on the same host. A worker whose settings are not those of the last plan gets nothing.
macro_rules! claim_in_postgres {
    ($($ready:tt)*) => {
        concat!(
            "
UPDATE job SET status = 1, worker = ?, deadline = ?, token = job.token + 1, attempt = job.attempt + 1
FROM worker AS me
WHERE job.pair = ANY (ARRAY(
        ",
            $($ready)*,
            "))
    AND me.id = ? AND me.ended IS NULL AND me.heartbeat >= ?
    AND coalesce((SELECT fingerprints = me.fingerprints FROM run_settings), true)
    AND NOT EXISTS (
        SELECT 1 FROM job AS other JOIN worker AS its ON its.id = other.worker
        WHERE other.status = 1 AND its.host = me.host AND (other.exclusive = 1 OR ? = 1))
RETURNING job.pair, job.worker, job.token, job.stage, job.fingerprint, job.attempt, job.exclusive"
        )
    };
}

/// Leases the first ready jobs in the order of the index `job_ready`. While an exclusive job is leased, no worker holds
/// another lease. The limit is `+?`, which hides its value from SQLite's query planner. With a plain `?`, SQLite would
/// prepare the statement again each time.
pub(crate) const CLAIM: Sql = Sql::pair(
    "
UPDATE job SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT pair FROM job WHERE status = 0 AND stage <= ? AND exclusive = ?
    ORDER BY prio, stage DESC, pair LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING pair, worker, token, stage, fingerprint, attempt, exclusive",
    claim_in_postgres!(ready_in_postgres!("job AS j", "", "?")),
);

/// Like [`CLAIM`], but leases only selected pairs.
pub(crate) const CLAIM_AMONG: Sql = Sql::pair(
    "
UPDATE job SET status = 1, worker = ?, deadline = ?, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT j.pair FROM json_each(?) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
    WHERE j.status = 0 AND j.stage <= ? AND j.exclusive = ?
    ORDER BY j.prio, j.stage DESC, j.pair LIMIT +?)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ? AND ended IS NULL AND heartbeat >= ?)
    AND NOT EXISTS (SELECT 1 FROM job WHERE status = 1 AND (exclusive = 1 OR ?))
RETURNING pair, worker, token, stage, fingerprint, attempt, exclusive",
    claim_in_postgres!(ready_in_postgres!(
        "json_each(?) AS wanted JOIN job AS j ON j.pair = CAST(wanted.atom AS bigint)",
        "",
        "?"
    )),
);

/// Like [`CLAIM`], but leases jobs behind a position first, and others only if there are too few. Only for PostgreSQL.
/// The two conditions on `turn` are an equality that the planner does not recognize. With a plain one, it may read the
/// primary key, which is in the same order but contains all jobs.
pub(crate) const CLAIM_BEHIND: &str = claim_in_postgres!(
    "WITH behind AS MATERIALIZED (
        ",
    ready_in_postgres!(
        "job AS j",
        " AND j.prio = 0 AND j.turn <= ? AND j.turn >= ? AND j.pair > ?",
        "?"
    ),
    "), anywhere AS MATERIALIZED (
        ",
    ready_in_postgres!(
        "job AS j",
        " AND NOT (j.prio = 0 AND j.turn = ? AND j.pair > ?)",
        "greatest(? - (SELECT count(*) FROM behind), 0)"
    ),
    ")
        SELECT pair FROM behind UNION ALL SELECT pair FROM anywhere"
);

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
    AND job.token = CAST(item.value ->> 2 AS bigint) AND job.status = 1
RETURNING job.pair, job.token",
);

/// Stores a heartbeat, unless the worker has ended, or its last heartbeat is so old that others may consider it dead.
pub(crate) const HEARTBEAT: &str = "
UPDATE worker SET heartbeat = ?, metrics = coalesce(?, metrics)
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

/// Adds a claim to a script. `behind` is only for a claim on a server that is neither exclusive nor for named pairs.
pub(crate) fn add_claim(
    script: &mut Script,
    request: &ClaimRequest,
    behind: Option<Behind>,
) -> Statement<Lease> {
    let slots = if request.exclusive {
        request.slots.min(1)
    } else {
        request.slots
    } as i64;
    let bind_search = |script: &mut Script, slots: i64| {
        script.bind(cursor(request.until));
        script.bind(i64::from(request.exclusive));
        script.bind(slots);
    };
    let statement = match (&request.among, behind) {
        (Some(_), _) => script.add(CLAIM_AMONG),
        (None, Some(_)) => script.add(CLAIM_BEHIND),
        (None, None) => script.add(CLAIM),
    };
    script.bind(request.worker.0);
    script.bind(request.deadline);
    if let Some(among) = &request.among {
        script.bind(among.json.clone());
    }
    if let Some(behind) = behind {
        script.bind(behind.turn);
        script.bind(behind.turn);
        script.bind(behind.pair);
        bind_search(script, slots);
        script.bind(behind.turn);
        script.bind(behind.pair);
        bind_search(script, if behind.or_anywhere { slots } else { 0 });
    } else {
        bind_search(script, slots);
    }
    script.bind(request.worker.0);
    script.bind(request.alive_since);
    script.bind(i64::from(request.exclusive));
    statement
}

/// Returns the key by which claims sort pairs.
const fn order(turn: Cursor, pair: i64) -> (Reverse<Cursor>, i64) {
    (Reverse(turn), pair)
}

/// Counts claimed leases, and returns them in the order of the claim.
pub(crate) fn count_claimed(mut leases: Vec<Lease>, deltas: &mut Deltas) -> Vec<Lease> {
    // RETURNING promises no order.
    leases.sort_by_key(|lease| order(cursor(lease.cursor), lease.pair.0));
    for lease in &leases {
        let from = lease.counter_key().with_status(JobStatus::Ready);
        deltas.move_job(from, lease.counter_key());
        failpoint::hit(lease.cursor, Point::Claiming, None);
    }
    leases
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
