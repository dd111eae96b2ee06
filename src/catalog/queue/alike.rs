//! Pairs that are alike are looked at once for all of them: the plan and the number of stale pairs without a look at
//! every pair.
//!
//! A job keeps the fingerprint of the result right behind its cursor. Jobs with the same cursor, status and fingerprint fare
//! alike, except for pairs that failed, whose files or attributes moved, or whose settings changed half-way: those are looked at one by one.

use std::collections::BTreeMap;

use serde_json::Value;
use sqlx::SqliteConnection;

use crate::catalog::db::error::Result;
use crate::catalog::queue::claim::PairSelection;
use crate::catalog::queue::fingerprint::{Fingerprints, current_json};
use crate::catalog::queue::job_counts::{census, counted};
use crate::catalog::queue::staleness::{PAGE, Seen, look};

/// The fingerprint that a job keeps when its cursor goes back to a stage: that of the result before it, where that took in
/// those of all results before it.
macro_rules! made {
    ($to:literal) => {
        concat!(
            "(SELECT r.fingerprint FROM stage_result AS r WHERE r.pair = job.pair AND r.stage = ",
            $to,
            " - 1 AND NOT EXISTS (
        SELECT 1 FROM stage_result AS own JOIN fingerprint ON fingerprint.id = own.fingerprint
        WHERE own.pair = r.pair AND own.stage BETWEEN 1 AND r.stage AND fingerprint.upstream IS NOT (
            SELECT fingerprint FROM stage_result AS b WHERE b.pair = r.pair AND b.stage = own.stage - 1)))"
        )
    };
}
pub(crate) use made;

/// Whether a job keeps another fingerprint than that of the result right behind its cursor.
macro_rules! misremembered {
    () => {
        "EXISTS (SELECT 1 FROM stage_result AS r
    WHERE r.pair = job.pair AND r.stage = job.stage - 1 AND r.fingerprint <> job.made)"
    };
}
pub(crate) use misremembered;

/// Pairs that are not noted as moved, with a result whose files or attributes are not what they are now.
macro_rules! unnoted {
    () => {
        "SELECT p.id FROM pair AS p WHERE NOT EXISTS (SELECT 1 FROM moved WHERE moved.pair = p.id) AND EXISTS (
    SELECT 1 FROM job AS j JOIN stage_result AS r ON r.pair = j.pair AND r.stage < j.stage
    WHERE j.pair = p.id AND (r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash OR r.attributes <> p.attributes))"
    };
}
pub(crate) use unnoted;

/// Whether a job fares as those do that are like it.
macro_rules! alike {
    () => {
        "NOT EXISTS (SELECT 1 FROM moved AS m WHERE m.pair = j.pair)
    AND NOT EXISTS (SELECT 1 FROM failure AS f WHERE f.pair = j.pair) AND (j.made IS NOT NULL OR j.stage = 0)"
    };
}

/// Jobs that are alike, how many, and one of them.
pub(crate) const GROUPS: &str = counted!(alike!());

/// Those of a group, in pages by number.
pub(crate) const MEMBERS: &str = concat!(
    "SELECT j.pair FROM job AS j WHERE j.pair > ?1 AND j.stage = ?2 AND j.status = ?3 AND j.made IS ?4 AND ",
    alike!(),
    " ORDER BY j.pair LIMIT ?5"
);

/// The others, in pages by number.
pub(crate) const APART: &str = "
SELECT pair FROM moved WHERE pair > ?1 UNION SELECT pair FROM failure WHERE pair > ?1
UNION SELECT pair FROM job WHERE pair > ?1 AND made IS NULL AND stage > 0 ORDER BY 1 LIMIT ?2";

/// Pairs with a result that would be made otherwise now: by settings from the counts, by files and attributes among those
/// that moved.
pub(crate) const STALE: &str = "
SELECT (SELECT coalesce(sum(n), 0) FROM made WHERE fingerprint NOT IN (SELECT value FROM json_each(?1))) + (
    SELECT count(*) FROM (SELECT pair FROM moved UNION SELECT pair FROM job WHERE made IS NULL AND stage > 0) AS m
        CROSS JOIN job AS j ON j.pair = m.pair CROSS JOIN pair AS p ON p.id = m.pair
    WHERE (j.made IS NULL OR j.made IN (SELECT value FROM json_each(?1))) AND EXISTS (
        SELECT 1 FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND (
            r.fingerprint <> (?1 ->> r.stage) OR r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash OR r.attributes <> p.attributes)))";

/// Takes out pairs in a range of numbers that have been looked after. Leased ones stay: their results are yet to come.
pub(crate) const SETTLE: &str = "
DELETE FROM moved WHERE pair > ?1 AND pair <= ?2 AND EXISTS (
    SELECT 1 FROM job AS j JOIN pair AS p ON p.id = j.pair
    WHERE j.pair = moved.pair AND j.status <> 1 AND NOT EXISTS (
        SELECT 1 FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND (
            r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash OR r.attributes <> p.attributes)))";

/// How many pairs have a result that would be made otherwise now.
pub(crate) async fn stale(conn: &mut SqliteConnection, fingerprints: &Fingerprints) -> Result<u64> {
    let current = current_json(conn, fingerprints).await?;
    let n: i64 = sqlx::query_scalar(STALE)
        .bind(current)
        .fetch_one(conn)
        .await?;
    Ok(n.unsigned_abs())
}

/// Gives every pair's state to `each`, with the number of pairs that are in it.
pub(crate) async fn look_at_all(
    conn: &mut SqliteConnection,
    current: &str,
    mut each: impl FnMut(&Seen, u64),
) -> Result<()> {
    for group in groups(conn, current).await? {
        each(&group.seen, group.pairs);
    }
    let mut after = 0;
    while let Some((page, last)) = look_apart(conn, current, after).await? {
        for seen in &page {
            each(seen, 1);
        }
        after = last;
    }
    Ok(())
}

/// Jobs that fare alike.
pub(crate) struct Group {
    /// One of them, as the look found it.
    pub(crate) seen: Seen,
    /// How many.
    pub(crate) pairs: u64,
    made: Option<i64>,
}

/// All groups; those with earlier stages first, so that where jobs go back to is a group that comes before their own.
pub(crate) async fn groups(conn: &mut SqliteConnection, current: &str) -> Result<Vec<Group>> {
    let found = census(conn, GROUPS).await?;
    let one_of_each: Vec<i64> = found.values().map(|alike| alike.first).collect();
    let seen = look(conn, current, 0, &these(&one_of_each)).await?;
    let seen: BTreeMap<i64, Seen> = seen.into_iter().map(|seen| (seen.pair, seen)).collect();
    let mut groups = Vec::with_capacity(found.len());
    for (standing, alike) in found {
        // In one transaction the look finds what the groups were made of.
        if let Some(seen) = seen.get(&alike.first) {
            groups.push(Group {
                seen: *seen,
                pairs: alike.jobs,
                made: standing.made,
            });
        }
    }
    Ok(groups)
}

/// The next members of a group after a pair.
pub(crate) async fn members(
    conn: &mut SqliteConnection,
    group: &Group,
    after: i64,
) -> Result<Vec<i64>> {
    let query = sqlx::query_scalar(MEMBERS)
        .bind(after)
        .bind(group.seen.cursor)
        .bind(group.seen.status.code())
        .bind(group.made)
        .bind(PAGE as i64);
    Ok(query.fetch_all(conn).await?)
}

/// Looks at the next pairs that are in no group, and tells the last of them; `None` at the end.
pub(crate) async fn look_apart(
    conn: &mut SqliteConnection,
    current: &str,
    after: i64,
) -> Result<Option<(Vec<Seen>, i64)>> {
    let page: Vec<i64> = sqlx::query_scalar(APART)
        .bind(after)
        .bind(PAGE as i64)
        .fetch_all(&mut *conn)
        .await?;
    let Some(last) = page.last().copied() else {
        return Ok(None);
    };
    let seen = look(conn, current, after, &these(&page)).await?;
    Ok(Some((seen, last)))
}

/// Notes which pairs in a range of numbers no longer differ from their files and attributes.
pub(crate) async fn settle(conn: &mut SqliteConnection, after: i64, last: i64) -> Result<()> {
    let query = sqlx::query(SETTLE).bind(after).bind(last);
    query.execute(conn).await?;
    Ok(())
}

fn these(pairs: &[i64]) -> PairSelection {
    PairSelection {
        len: pairs.len(),
        json: Value::from(pairs).to_string(),
    }
}
