//! Statements that take leases, in SQLite and in PostgreSQL, and end back-offs, for pairs and blocks.

use std::cmp::Reverse;

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_as;
use crate::db::script::{Script, Statement};
use crate::queue::counters::{CounterKey, Cursor, Deltas, cursor};
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

/// Leases the first ready jobs in SQLite, for pairs in the order of the index `job_ready`. While a pair must run exclusively,
/// no worker leases anything. The limit is `+?`, which hides its value from SQLite's query planner. With a plain `?`, SQLite
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
const fn order(turn: Cursor, unit: i64) -> (Reverse<Cursor>, i64) {
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

/// Builds the text that selects ready jobs from the tables, a condition and a limit. It skips jobs that another process
/// is about to lease.
macro_rules! ready {
    ($from:expr, $condition:literal, $limit:literal) => {
        concat!(
            "SELECT j.{unit} FROM ",
            $from,
            " WHERE j.status = 0 AND j.stage <= ?4",
            $condition,
            "
        ORDER BY {prio}j.{turn} DESC, j.{unit} LIMIT ",
            $limit,
            " FOR UPDATE OF j SKIP LOCKED"
        )
    };
}

/// The tables of a claim that leases only the pairs `?6`.
macro_rules! selected {
    () => {
        "json_each(?6) AS wanted JOIN {job} AS j ON j.{unit} = CAST(wanted.atom AS bigint)"
    };
}

/// Builds the text of a claim from the text that selects its jobs, and the condition on leases that exclude it. Only
/// leases on the same host do. A worker whose settings are not those of the last plan gets nothing.
macro_rules! claim {
    ($excluded_by:literal, $($ready:tt)*) => {
        Template::new(concat!(
            "
WITH claimed AS (
    UPDATE {job} SET status = 1, worker = ?1, deadline = ?2, token = {job}.token + 1, attempt = {job}.attempt + 1
    FROM worker AS me
    WHERE {job}.{unit} = ANY (ARRAY(
        ",
            $($ready)*,
            "))
        AND me.id = ?1 AND me.ended IS NULL AND me.heartbeat >= ?3
        AND coalesce((SELECT {settings} = me.{settings} FROM run_settings), true)
        AND NOT EXISTS (
            SELECT 1 FROM job AS other JOIN worker AS its ON its.id = other.worker
            WHERE other.status = 1 AND its.host = me.host",
            $excluded_by,
            ")
    RETURNING {job}.{unit} AS unit, {job}.worker, {job}.token, {job}.stage, {fingerprint} AS fingerprint, {job}.attempt,
        {exclusive} AS exclusive){and_count_claimed}
SELECT * FROM claimed"
        ))
    };
}

/// Leases the first ready jobs in the order of the index `job_ready`, in PostgreSQL.
static SERVER_CLAIM: Template = claim!(
    " AND other.exclusive = 1",
    ready!("{job} AS j", " AND {exclusive} = 0", "?5")
);

/// Leases the first ready job that must run exclusively.
static SERVER_CLAIM_EXCLUSIVE: Template =
    claim!("", ready!("{job} AS j", " AND {exclusive} = 1", "?5"));

/// Like [`SERVER_CLAIM`], but leases only the pairs `?6`.
static SERVER_CLAIM_AMONG: Template = claim!(
    " AND other.exclusive = 1",
    ready!(selected!(), " AND {exclusive} = 0", "?5")
);

/// Like [`SERVER_CLAIM_EXCLUSIVE`], but leases only one of the pairs `?6`.
static SERVER_CLAIM_AMONG_EXCLUSIVE: Template =
    claim!("", ready!(selected!(), " AND {exclusive} = 1", "?5"));

/// Like [`SERVER_CLAIM`], but leases jobs with the turn `?6` behind the pair `?7` first, and others only if there are too few
/// and the limit `?8` permits it. The two conditions on `turn` are an equality that the planner does not recognize. With
/// a plain one, it may read the primary key, which is in the same order but contains all jobs.
static SERVER_CLAIM_BEHIND: Template = claim!(
    " AND other.exclusive = 1",
    "WITH behind AS MATERIALIZED (
        ",
    ready!(
        "job AS j",
        " AND j.exclusive = 0 AND j.prio = 0 AND j.turn <= ?6 AND j.turn >= ?6 AND j.pair > ?7",
        "?5"
    ),
    "), anywhere AS MATERIALIZED (
        ",
    ready!(
        "job AS j",
        " AND j.exclusive = 0 AND NOT (j.prio = 0 AND j.turn = ?6 AND j.pair > ?7)",
        "greatest(?8 - (SELECT count(*) FROM behind), 0)"
    ),
    ")
        SELECT pair FROM behind UNION ALL SELECT pair FROM anywhere"
);

/// Returns the statements of claims in PostgreSQL.
#[cfg(test)]
pub(crate) fn server_texts() -> [String; 5] {
    [
        &SERVER_CLAIM,
        &SERVER_CLAIM_AMONG,
        &SERVER_CLAIM_BEHIND,
        &SERVER_CLAIM_EXCLUSIVE,
        &SERVER_CLAIM_AMONG_EXCLUSIVE,
    ]
    .map(|text| text.of::<PairJob>().postgres_query())
}

/// Returns the statements that read the leases of the host.
#[cfg(test)]
pub(crate) fn exclusive_server_texts() -> [String; 2] {
    [&SERVER_CLAIM_EXCLUSIVE, &SERVER_CLAIM_AMONG_EXCLUSIVE]
        .map(|text| text.of::<PairJob>().postgres_query())
}

/// Where a claim on a server begins: behind this pair among those with the same next stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClaimCursor {
    /// The next stage.
    pub(crate) turn: Cursor,
    pub(crate) pair: i64,
    /// Whether to search all pairs if there are too few behind this one.
    pub(crate) or_anywhere: bool,
}

impl ClaimCursor {
    /// Begins behind the pair of a lease.
    pub(crate) const fn pair_of(lease: &Lease) -> Self {
        Self {
            turn: cursor(lease.cursor),
            pair: lease.unit.0,
            or_anywhere: true,
        }
    }

    /// Returns whether a leased pair is behind this one and has the same next stage.
    pub(crate) const fn is_before(self, lease: &Lease) -> bool {
        cursor(lease.cursor) == self.turn && lease.unit.0 > self.pair
    }

    /// Returns whether a leased pair is behind this one in the order of claims.
    pub(crate) fn is_before_in_order(self, lease: &Lease) -> bool {
        order(cursor(lease.cursor), lease.unit.0) > order(self.turn, self.pair)
    }
}

/// Leases jobs in PostgreSQL, in one statement that also counts pairs and commits by itself, so a claim takes one round trip.
/// Returns the leases in the order of the claim. `behind` is only for a claim of pairs that is neither exclusive nor for
/// selected pairs.
///
/// # Errors
/// Returns an error if a database operation fails. The leases may exist nevertheless, if the reply was lost.
pub(crate) async fn claim_on_server<K: StoredKind>(
    conn: &mut Conn,
    request: &ClaimRequest<K>,
    behind: Option<ClaimCursor>,
) -> Result<Vec<Lease<K>>> {
    let text = match (&request.selection, request.exclusive, behind) {
        (Some(_), false, _) => &SERVER_CLAIM_AMONG,
        (Some(_), true, _) => &SERVER_CLAIM_AMONG_EXCLUSIVE,
        (None, true, _) => &SERVER_CLAIM_EXCLUSIVE,
        (None, false, Some(_)) => &SERVER_CLAIM_BEHIND,
        (None, false, None) => &SERVER_CLAIM,
    };
    let mut claim = query_as(text.of::<K>())
        .bind(request.worker.0)
        .bind(request.deadline)
        .bind(request.alive_since)
        .bind(position::<K>(request.until))
        .bind(request.limit());
    if let Some(selection) = &request.selection {
        claim = claim.bind(K::ids(selection).into_owned());
    } else if let Some(behind) = behind.filter(|_| !request.exclusive) {
        let anywhere = if behind.or_anywhere {
            request.limit()
        } else {
            0
        };
        claim = claim.bind(behind.turn).bind(behind.pair).bind(anywhere);
    }
    Ok(in_order(claim.fetch_all(conn).await?))
}
