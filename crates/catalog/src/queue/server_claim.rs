//! Claims in PostgreSQL, of pairs and blocks. One statement leases them and counts pairs, so a claim takes one round trip and commits by
//! itself.

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_as;
use crate::queue::claim::{ClaimRequest, in_order, order};
use crate::queue::counters::{Cursor, cursor};
use crate::queue::kind::{StoredKind, Template};
use crate::queue::lease::{Lease, position};
#[cfg(test)]
use crate::queue::pair_job::PairJob;

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

/// Leases the first ready jobs in the order of the index `job_ready`.
static CLAIM: Template = claim!(
    " AND other.exclusive = 1",
    ready!("{job} AS j", " AND {exclusive} = 0", "?5")
);

/// Leases the first ready job that must run exclusively.
static CLAIM_EXCLUSIVE: Template = claim!("", ready!("{job} AS j", " AND {exclusive} = 1", "?5"));

/// Like [`CLAIM`], but leases only the pairs `?6`.
static CLAIM_AMONG: Template = claim!(
    " AND other.exclusive = 1",
    ready!(selected!(), " AND {exclusive} = 0", "?5")
);

/// Like [`CLAIM_EXCLUSIVE`], but leases only one of the pairs `?6`.
static CLAIM_AMONG_EXCLUSIVE: Template =
    claim!("", ready!(selected!(), " AND {exclusive} = 1", "?5"));

/// Like [`CLAIM`], but leases jobs with the turn `?6` behind the pair `?7` first, and others only if there are too few
/// and the limit `?8` permits it. The two conditions on `turn` are an equality that the planner does not recognize. With
/// a plain one, it may read the primary key, which is in the same order but contains all jobs.
static CLAIM_BEHIND: Template = claim!(
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

/// Returns the statements of claims.
#[cfg(test)]
pub(crate) fn texts() -> [String; 5] {
    [
        &CLAIM,
        &CLAIM_AMONG,
        &CLAIM_BEHIND,
        &CLAIM_EXCLUSIVE,
        &CLAIM_AMONG_EXCLUSIVE,
    ]
    .map(|text| text.of::<PairJob>().postgres_query())
}

/// Returns the statements that read the leases of the host.
#[cfg(test)]
pub(crate) fn exclusive_texts() -> [String; 2] {
    [&CLAIM_EXCLUSIVE, &CLAIM_AMONG_EXCLUSIVE].map(|text| text.of::<PairJob>().postgres_query())
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

/// Leases jobs, and returns the leases in the order of the claim. `behind` is only for a claim of pairs that is neither
/// exclusive nor for selected pairs.
///
/// # Errors
/// Returns an error if a database operation fails. The leases may exist nevertheless, if the reply was lost.
pub(crate) async fn claim<K: StoredKind>(
    conn: &mut Conn,
    request: &ClaimRequest<K>,
    behind: Option<ClaimCursor>,
) -> Result<Vec<Lease<K>>> {
    let text = match (&request.selection, request.exclusive, behind) {
        (Some(_), false, _) => &CLAIM_AMONG,
        (Some(_), true, _) => &CLAIM_AMONG_EXCLUSIVE,
        (None, true, _) => &CLAIM_EXCLUSIVE,
        (None, false, Some(_)) => &CLAIM_BEHIND,
        (None, false, None) => &CLAIM,
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
