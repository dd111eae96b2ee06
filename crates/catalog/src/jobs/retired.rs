//! Retired pairs: a person, a shorter list, or labels without their boxes took them out. A retired pair has no job, so that
//! runs, status, reports and exports leave it out. Its results and verdicts stay, and it may come back.

use std::collections::HashSet;

use serde::Serialize;
use serde_json::json;

use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::{json_array, names_json};
use crate::db::transaction::in_transaction;
use crate::queue::counters::{Deltas, KeyedJob};
use crate::queue::selection::PairSelection;
use crate::{Catalog, Result};
use mocban_core::domain::{JobStatus, PairId, PairName, RetireCause, Stage, UnixMillis};

/// Removes jobs. Their leases end, because no fenced statement finds them any more.
const REMOVE: &str = "
DELETE FROM job WHERE pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1))
RETURNING pair AS unit, stage, status, coalesce(fingerprint, 0) AS fingerprint, token, low_confidence";

const INSERT: &str = "
INSERT INTO retired_pair (pair, stage, is_quarantined, token, fingerprint, low_confidence, cause, at)
SELECT CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint), CAST(value ->> 3 AS bigint),
    CAST(value ->> 4 AS bigint), CAST(value ->> 5 AS bigint), ?2, ?3 FROM json_each(?1) WHERE true
ON CONFLICT (pair) DO NOTHING";

// The statement names the position of a pair that is done.
const _: () = assert!(Stage::COUNT == 4);

/// Builds the statement that gives retired pairs of some names their jobs back, from the condition on the name. If `?2` is
/// 0, pairs that a person retired stay retired; so does a pair whose box is gone. A job whose pair changed meanwhile is
/// stale, so it is dirty. A pair stays quarantined if its failure is stored. The first condition saves looking up all names.
macro_rules! restore {
    ($has_name:literal) => {
        concat!(
            "
INSERT INTO job (pair, stage, status, token, fingerprint, dirty, low_confidence)
SELECT r.pair, r.stage, CASE WHEN r.stage = 4 THEN 3 WHEN r.is_quarantined = 1 AND f.pair IS NOT NULL THEN 4 ELSE 0 END,
    r.token + 1, r.fingerprint, 1, r.low_confidence
FROM retired_pair AS r JOIN pair AS p ON p.id = r.pair LEFT JOIN failure AS f ON f.pair = r.pair
WHERE EXISTS (SELECT 1 FROM retired_pair) AND (?2 = 1 OR r.cause <> 'person') AND (?2 = 0 OR NOT EXISTS (
    SELECT 1 FROM block_character AS c WHERE c.pair = r.pair AND c.state <> 'cut')) AND ",
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

const IDS: &str = "SELECT id FROM pair WHERE name IN (SELECT atom FROM json_each(?1)) ORDER BY id";

const CLEAR: &str = "
DELETE FROM retired_pair WHERE pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";

/// The order of the join keeps SQLite from reading the names of all pairs in their order.
pub(crate) const RETIRED: &str = "
SELECT p.name, r.cause, r.at FROM retired_pair AS r CROSS JOIN pair AS p ON p.id = r.pair ORDER BY p.name";

const RETIRED_PAIR: &str = "
SELECT p.name, r.cause, r.at FROM retired_pair AS r JOIN pair AS p ON p.id = r.pair WHERE p.name = ?1";

/// Retired pairs behind a row id, of a block and a character or of all.
const RETIRED_PAGE: &str = "
SELECT p.id, p.name, p.block, p.character, r.cause, r.at FROM retired_pair AS r JOIN pair AS p ON p.id = r.pair
WHERE r.pair > ?1 AND (?2 IS NULL OR p.block = ?2) AND (?3 IS NULL OR p.character = ?3) ORDER BY r.pair LIMIT ?4";

pub(crate) const RETIRED_COUNT: &str = "SELECT count(*) FROM retired_pair";

/// Jobs of pairs that were not cut from a block.
const LISTED_JOBS: &str = "
SELECT j.pair FROM job AS j WHERE NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = j.pair) ORDER BY j.pair";

/// The pairs of one import of a list or of folders; offset 0 is the newest. Retired ones have no job.
const NTH_IMPORT: &str = "
SELECT p.name, p.imported, (SELECT count(*) FROM job AS j WHERE j.pair = p.id) AS jobs FROM pair AS p
WHERE p.imported = (SELECT q.imported FROM pair AS q
        WHERE NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = q.id)
        GROUP BY q.imported ORDER BY max(q.id) DESC LIMIT 1 OFFSET ?1)
    AND NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = p.id)
ORDER BY p.name";

/// Counts the pairs that the newest import of a list or of folders added, up to `?1`. Reads the newer pairs of blocks, and then
/// at most `?1` pairs: an import adds its pairs in one transaction. On a server, pairs of blocks may lie between them.
const LAST_IMPORT_COUNTS: &str = "
WITH newest AS (SELECT q.id, q.imported FROM pair AS q
    WHERE NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = q.id) ORDER BY q.id DESC LIMIT 1)
SELECT imported, count(*) AS pairs, count(job) AS jobs, count(CASE WHEN retired_at = latest THEN 1 END) AS retired_last
FROM (SELECT p.imported, j.pair AS job, r.at AS retired_at, max(r.at) OVER () AS latest
    FROM (SELECT q.id, q.imported FROM pair AS q
        WHERE q.id <= (SELECT id FROM newest) ORDER BY q.id DESC LIMIT ?1) AS p
    LEFT JOIN job AS j ON j.pair = p.id LEFT JOIN retired_pair AS r ON r.pair = p.id
    WHERE p.imported = (SELECT imported FROM newest)
        AND NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.pair = p.id)) AS added
GROUP BY imported";

/// Number of pairs in one statement.
const CHUNK: usize = 2_000;

/// A pair that is out of all counts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RetiredPair {
    /// The pair.
    pub name: PairName,
    /// Who retired it.
    pub cause: RetireCause,
    /// When.
    pub at: UnixMillis,
}

from_row! { RetiredPair { name, cause, at } }

/// A retired pair in a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedRetiredPair {
    /// Its row id, behind which the next page of the list begins.
    pub id: i64,
    /// The pair.
    pub retired: RetiredPair,
    /// Its block, if given.
    pub block: Option<String>,
    /// Its character, if given.
    pub character: Option<String>,
}

from_row! { ListedRetiredPair { id, retired in row, block, character } }

/// A pair that an import of a list or of folders added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportedPair {
    /// The pair.
    pub name: PairName,
    /// When it was imported for the first time.
    pub imported: UnixMillis,
    /// 0 if it is retired, else 1.
    pub jobs: i64,
}

from_row! { ImportedPair { name, imported, jobs } }

/// How many pairs the newest import added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LastImport {
    /// When they were imported for the first time.
    pub imported: UnixMillis,
    /// Number of counted pairs, with the retired ones.
    pub pairs: u64,
    /// Number of counted pairs that are not retired.
    pub jobs: u64,
    /// Number of counted pairs that were retired last, all at the same time. An undo brings only these back.
    pub retired_last: u64,
}

from_row! { LastImport { imported, pairs, jobs, retired_last } }

/// A removed job.
struct RemovedJob {
    job: KeyedJob,
    token: i64,
    low_confidence: i64,
}

from_row! { RemovedJob { job in row, token, low_confidence } }

const RETIRED_AMONG: &str =
    "SELECT pair FROM retired_pair WHERE pair IN (SELECT CAST(atom AS bigint) FROM json_each(?1))";

impl Catalog {
    /// Returns the retired ones of some pairs.
    pub async fn retired_among(&self, pairs: &PairSelection) -> Result<HashSet<PairId>> {
        let mut conn = self.read_conn().await?;
        let retired = query_scalar(RETIRED_AMONG).bind(&pairs.json);
        let retired: Vec<PairId> = retired.fetch_all(&mut conn).await?;
        Ok(retired.into_iter().collect())
    }

    /// Returns the retired pairs, sorted by name.
    pub async fn retired_pairs(&self) -> Result<Vec<RetiredPair>> {
        let mut conn = self.read_conn().await?;
        query_as(RETIRED).fetch_all(&mut conn).await
    }

    /// Returns a retired pair, or `None` if no retired pair has this name.
    pub async fn retired_pair(&self, name: &PairName) -> Result<Option<RetiredPair>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(RETIRED_PAIR).bind(name.as_str());
        query.fetch_optional(&mut conn).await
    }

    /// Returns up to `limit` retired pairs with row ids above `after`, of a block and a character if given, in the order of
    /// import.
    pub async fn retired_page(
        &self,
        (block, character): (Option<&str>, Option<&str>),
        after: i64,
        limit: usize,
    ) -> Result<Vec<ListedRetiredPair>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(RETIRED_PAGE).bind(after).bind(block);
        let query = query.bind(character).bind(limit as i64);
        query.fetch_all(&mut conn).await
    }

    /// Counts the retired pairs, for whatever cause.
    pub async fn retired_count(&self) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        query_scalar(RETIRED_COUNT).fetch_one(&mut conn).await
    }

    /// Returns the pairs of one import of a list or of folders, sorted by name. `later` is the number of later imports that
    /// added pairs.
    pub async fn import_before(&self, later: u32) -> Result<Vec<ImportedPair>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(NTH_IMPORT).bind(i64::from(later));
        query.fetch_all(&mut conn).await
    }

    /// Counts the pairs that the newest import of a list or of folders added, at most the last `most` of them. `None` if
    /// there was none.
    pub async fn last_import_counts(&self, most: u64) -> Result<Option<LastImport>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(LAST_IMPORT_COUNTS).bind(most.cast_signed());
        query.fetch_optional(&mut conn).await
    }

    /// Retires pairs for a person. Their leases end. Returns how many were not retired before.
    pub async fn retire_pairs(&self, names: &[PairName], now: UnixMillis) -> Result<u64> {
        let names = names.to_vec();
        in_transaction!(self, |conn| {
            let mut deltas = Deltas::default();
            let mut retired = 0;
            for chunk in names.chunks(CHUNK) {
                let pairs = query_scalar(IDS).bind(names_json(chunk));
                let pairs: Vec<PairId> = pairs.fetch_all(&mut *conn).await?;
                retired += retire(conn, &pairs, RetireCause::Person, now, &mut deltas).await?;
            }
            deltas.apply(conn).await?;
            Ok(retired)
        })
    }

    /// Gives retired pairs their jobs back, except for pairs whose boxes are gone from the labels of their blocks. Returns
    /// how many came back.
    pub async fn restore_pairs(&self, names: &[PairName]) -> Result<u64> {
        let names = names.to_vec();
        in_transaction!(self, |conn| {
            let mut deltas = Deltas::default();
            let mut restored = 0;
            for chunk in names.chunks(CHUNK) {
                restored += restore(conn, &names_json(chunk), true, &mut deltas).await?;
            }
            deltas.apply(conn).await?;
            Ok(restored)
        })
    }
}

/// Retires pairs: removes their jobs and keeps their positions. Pairs without a job are left out. Returns how many
/// pairs it retired.
pub(crate) async fn retire(
    conn: &mut Conn,
    pairs: &[PairId],
    cause: RetireCause,
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
        .bind(cause.name())
        .bind(now)
        .execute(conn)
        .await?;
    Ok(removed.len() as u64)
}

/// Retires the pairs that a list does not have, except for pairs of blocks. Returns how many.
pub(crate) async fn retire_unlisted(
    conn: &mut Conn,
    listed: &HashSet<i64>,
    now: UnixMillis,
    deltas: &mut Deltas,
) -> Result<u64> {
    let jobs: Vec<PairId> = query_scalar(LISTED_JOBS).fetch_all(&mut *conn).await?;
    let gone: Vec<PairId> = jobs
        .into_iter()
        .filter(|pair| !listed.contains(&pair.0))
        .collect();
    let mut retired = 0;
    for chunk in gone.chunks(CHUNK) {
        retired += retire(conn, chunk, RetireCause::List, now, deltas).await?;
    }
    Ok(retired)
}

/// Returns how many of these pairs are retired.
pub(crate) async fn count_retired(conn: &mut Conn, pairs: &[i64]) -> Result<u64> {
    let retired = query_scalar(RETIRED_AMONG).bind(json_array(pairs.iter().copied()));
    let retired: Vec<PairId> = retired.fetch_all(conn).await?;
    Ok(retired.len() as u64)
}

/// Gives the retired pairs among these names, a JSON array, their jobs back: for a person, those with a box if they were
/// cut from a block; otherwise those without a person as cause. Returns how many there were.
pub(crate) async fn restore(
    conn: &mut Conn,
    names: &str,
    is_person: bool,
    deltas: &mut Deltas,
) -> Result<u64> {
    let restored = query_as(RESTORE).bind(names).bind(i64::from(is_person));
    let restored: Vec<KeyedJob> = restored.fetch_all(&mut *conn).await?;
    for job in &restored {
        deltas.add(job.key, 1);
    }
    if !restored.is_empty() {
        let ids = json_array(restored.iter().map(|job| job.unit));
        query(CLEAR).bind(ids).execute(conn).await?;
    }
    Ok(restored.len() as u64)
}
