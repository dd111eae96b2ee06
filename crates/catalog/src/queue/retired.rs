//! Retired pairs: pairs whose boxes are gone from the labels of their block. A retired pair has no job, so that runs,
//! status and reports leave it out. Its results and verdicts stay, and it comes back with its box.

use serde_json::json;

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::queue::counters::{Deltas, KeyedJob};
use crate::{Catalog, Result};
use mocban_core::domain::{JobStatus, PairId, PairName, UnixMillis};

/// Removes jobs. Their leases end, because no fenced statement finds them any more.
const REMOVE: &str = "
DELETE FROM job WHERE pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1))
RETURNING pair AS unit, stage, status, coalesce(fingerprint, 0) AS fingerprint, token, low_confidence";

const INSERT: &str = "
INSERT INTO retired_pair (pair, stage, is_quarantined, token, fingerprint, low_confidence, at)
SELECT CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint), CAST(value ->> 3 AS bigint),
    CAST(value ->> 4 AS bigint), CAST(value ->> 5 AS bigint), ?2 FROM json_each(?1) WHERE true
ON CONFLICT (pair) DO NOTHING";

/// Builds the statement that gives retired pairs of some names their jobs back, from the condition on the name. A job
/// whose pair changed meanwhile is stale, so it is dirty. A pair stays quarantined if its failure is stored. The first
/// condition saves looking up all names.
macro_rules! restore {
    ($has_name:literal) => {
        concat!(
            "
INSERT INTO job (pair, stage, status, token, fingerprint, dirty, low_confidence)
SELECT r.pair, r.stage, CASE WHEN r.stage = 4 THEN 3 WHEN r.is_quarantined = 1 AND f.pair IS NOT NULL THEN 4 ELSE 0 END,
    r.token + 1, r.fingerprint, 1, r.low_confidence
FROM retired_pair AS r JOIN pair AS p ON p.id = r.pair LEFT JOIN failure AS f ON f.pair = r.pair
WHERE EXISTS (SELECT 1 FROM retired_pair) AND ",
            $has_name,
            "
RETURNING pair AS unit, stage, status, coalesce(fingerprint, 0) AS fingerprint"
        )
    };
}

/// Restores the jobs of these names. With `IN`, PostgreSQL may read all pairs while it has no statistics.
const RESTORE: Sql = Sql::pair(
    restore!("p.name IN (SELECT atom FROM json_each(?1))"),
    restore!("p.name = ANY (ARRAY(SELECT atom FROM json_each(?1)))"),
);

const CLEAR: &str = "
DELETE FROM retired_pair WHERE pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";

const NAMES: &str =
    "SELECT p.name FROM retired_pair AS r JOIN pair AS p ON p.id = r.pair ORDER BY p.name";

/// A removed job.
struct RemovedJob {
    job: KeyedJob,
    token: i64,
    low_confidence: i64,
}

from_row! { RemovedJob { job in row, token, low_confidence } }

impl Catalog {
    /// Returns the names of the retired pairs, sorted.
    pub async fn retired_pairs(&self) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        query_scalar(NAMES).fetch_all(&mut conn).await
    }
}

/// Retires pairs: removes their jobs and keeps their positions. Pairs without a job are left out. Returns how many
/// pairs it retired.
pub(crate) async fn retire(
    conn: &mut Conn,
    pairs: &[PairId],
    now: UnixMillis,
    deltas: &mut Deltas,
) -> Result<u64> {
    let ids = json_array(pairs.iter().map(|pair| pair.0));
    let removed: Vec<RemovedJob> = query_as(REMOVE).bind(ids).fetch_all(&mut *conn).await?;
    let mut items = Vec::new();
    for one in &removed {
        let KeyedJob { unit: pair, key } = one.job;
        deltas.add(key, -1);
        let is_quarantined = i64::from(key.status == JobStatus::Quarantined);
        let fingerprint = (key.fingerprint != 0).then_some(key.fingerprint);
        let (token, low_confidence) = (one.token, one.low_confidence);
        items.push(json!([
            pair,
            key.cursor,
            is_quarantined,
            token,
            fingerprint,
            low_confidence
        ]));
    }
    query(INSERT)
        .bind(json_array(items))
        .bind(now)
        .execute(conn)
        .await?;
    Ok(removed.len() as u64)
}

/// Gives the retired pairs among these names, a JSON array, their jobs back. Returns how many there were.
pub(crate) async fn restore(conn: &mut Conn, names: &str, deltas: &mut Deltas) -> Result<u64> {
    let restored: Vec<KeyedJob> = query_as(RESTORE).bind(names).fetch_all(&mut *conn).await?;
    for job in &restored {
        deltas.add(job.key, 1);
    }
    if !restored.is_empty() {
        let ids = json_array(restored.iter().map(|job| job.unit));
        query(CLEAR).bind(ids).execute(conn).await?;
    }
    Ok(restored.len() as u64)
}
