//! Reads pairs with data from several tables: pages of results, the details of one pair, and failures.

use std::collections::BTreeMap;

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::left_out::{LeftOut, is_counted};
use crate::db::query::{Query, query, query_as};
use crate::db::row::{FromRow as _, Row};
use crate::db::rows::json_array;
use crate::db::value::Json;
use crate::queue::counters::Cursor;
use crate::records::model::{
    FailedPair, MetricRecord, PairAttributes, PairDetail, PairResults, StageRecord, stored_failure,
};
use crate::records::{ground_truth, stage_results, verdicts};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{
    ContentHash, FailureClass, PairName, RegisterOutcome, Stage, ThresholdMetric,
};

/// Selects pairs with their attributes, job, failure and true alignment, without the pairs of `?2` and the true alignments
/// of `?3`.
macro_rules! select_pairs {
    ($condition:literal) => {
        concat!(
            "
SELECT p.id, p.name, p.mesh_path, p.print_path, p.unit, p.scanned_face_down, p.character, p.block, p.meta,
    p.prior, p.mesh_hash, p.print_hash, j.stage, j.status, j.attempt, j.crashes, j.run_at, f.stage AS failed_stage, f.class,
    f.message, f.at AS failed_at, t.body AS truth
FROM pair AS p JOIN job AS j ON j.pair = p.id
    LEFT JOIN failure AS f ON f.pair = p.id AND j.status IN (2, 4)
    LEFT JOIN truth AS t ON t.pair = p.id AND ",
            is_counted!("t.pair", "?3"),
            "
WHERE ",
            is_counted!("p.id", "?2"),
            " AND ",
            $condition
        )
    };
}

pub(crate) const PAGE: &str = select_pairs!("p.name > ?1 ORDER BY p.name LIMIT ?4");
const ONE: &str = select_pairs!("p.name = ?1");
pub(crate) const BY_IDS: &str =
    select_pairs!("p.id IN (SELECT CAST(wanted.atom AS bigint) FROM json_each(?1) AS wanted)");

const OF_LISTED_BLOCK: &str = select_pairs!("p.block = ?1 ORDER BY p.name");

pub(crate) const FAILED: &str = "
SELECT p.name, j.status, f.stage AS failed_stage, f.class, f.message, f.at AS failed_at
FROM job AS j JOIN pair AS p ON p.id = j.pair JOIN failure AS f ON f.pair = j.pair
WHERE j.status = 4 ORDER BY p.name LIMIT ?1";

pub(crate) const FAILED_BY_CLASS: &str = "
SELECT f.class, count(*) FROM job AS j JOIN failure AS f ON f.pair = j.pair
WHERE j.status = 4 GROUP BY f.class";

const ATTEMPTS: &str =
    "SELECT stage, class, message, ms, at FROM attempt WHERE pair = ?1 ORDER BY id";

impl Catalog {
    /// Returns up to `limit` pairs with names above `after`, sorted by name. Returns an empty list at the end.
    pub(crate) async fn results_page(
        &self,
        after: Option<&PairName>,
        limit: usize,
    ) -> Result<Vec<PairResults>> {
        // One transaction gives a consistent view of jobs, results and verdicts, even while a run writes.
        let mut conn = self.snapshot().await?;
        let found = self.bind_left_out(query(PAGE).bind(after.map_or("", PairName::as_str)));
        let found = found.bind(limit as i64).fetch_all(&mut conn).await?;
        assemble(&mut conn, &found, &self.left_out).await
    }

    /// Returns the pairs that a list assigns to a block with this id, sorted by name, without retired pairs.
    pub async fn results_of_listed_block(&self, block: &str) -> Result<Vec<PairResults>> {
        let mut conn = self.snapshot().await?;
        let found = self.bind_left_out(query(OF_LISTED_BLOCK).bind(block));
        let found = found.fetch_all(&mut conn).await?;
        assemble(&mut conn, &found, &self.left_out).await
    }

    /// Returns the details of a pair, or `None` if the pair does not exist.
    pub async fn pair(&self, name: &PairName) -> Result<Option<PairDetail>> {
        let mut conn = self.snapshot().await?;
        let found = self.bind_left_out(query(ONE).bind(name.as_str()));
        let found = found.fetch_all(&mut conn).await?;
        let Some(results) = assemble(&mut conn, &found, &self.left_out).await?.pop() else {
            return Ok(None);
        };
        let row = &found[0];
        let attempts = query_as(ATTEMPTS).bind(row.get::<i64>("id")?);
        Ok(Some(PairDetail {
            results,
            mesh_hash: row.get("mesh_hash")?,
            print_hash: row.get("print_hash")?,
            attempt: row.get("attempt")?,
            crashes: row.get("crashes")?,
            run_at: row.get("run_at")?,
            attempts: attempts.fetch_all(&mut conn).await?,
            verdict_log: verdicts::log(&mut conn, Some(name), &self.left_out).await?,
        }))
    }

    /// Returns the pairs with these row ids, in this order, without retired pairs.
    pub(crate) async fn results_of(
        &self,
        conn: &mut Conn,
        ids: &[i64],
    ) -> Result<Vec<PairResults>> {
        let wanted = json_array(ids.iter().copied());
        let found = self.bind_left_out(query(BY_IDS).bind(wanted));
        let found = found.fetch_all(conn).await?;
        let pairs = assemble(conn, &found, &self.left_out).await?;
        let mut by_id = BTreeMap::new();
        for (row, pair) in found.iter().zip(pairs) {
            by_id.insert(row.get::<i64>("id")?, pair);
        }
        Ok(ids.iter().filter_map(|id| by_id.remove(id)).collect())
    }

    /// Binds the parameters `?2` and `?3` of [`PAGE`], [`ONE`], [`BY_IDS`] and [`OF_LISTED_BLOCK`].
    fn bind_left_out<R>(&self, query: Query<R>) -> Query<R> {
        let query = query.bind(self.left_out.of(ChecksummedTable::Pair));
        query.bind(self.left_out.of(ChecksummedTable::Truth))
    }

    /// Returns up to `limit` quarantined pairs, sorted by name.
    pub async fn failures(&self, limit: usize) -> Result<Vec<FailedPair>> {
        let mut conn = self.read_conn().await?;
        let query = query(FAILED).bind(limit as i64);
        let found = query.fetch_all(&mut conn).await?;
        let failed = found.iter().map(|row| {
            Ok(FailedPair {
                name: row.get("name")?,
                status: row.get("status")?,
                failure: stored_failure(row)?
                    .ok_or_else(|| CatalogError::Corrupt("a failure without a stage".to_owned()))?,
            })
        });
        failed.collect()
    }

    /// Counts the quarantined pairs by failure class. Leaves out classes without pairs.
    pub async fn failure_counts(&self) -> Result<Vec<(FailureClass, u64)>> {
        let mut conn = self.read_conn().await?;
        let query = query_as(FAILED_BY_CLASS);
        let mut counts: Vec<(FailureClass, u64)> = query.fetch_all(&mut conn).await?;
        counts.sort_unstable();
        Ok(counts)
    }
}

/// Adds results, metrics and verdicts to rows of pairs.
async fn assemble(conn: &mut Conn, found: &[Row], left_out: &LeftOut) -> Result<Vec<PairResults>> {
    let ids = found.iter().map(|row| row.get("id"));
    let ids = ids.collect::<Result<Vec<i64>, _>>()?;
    let mut stages = stage_results::of_pairs(conn, &ids).await?;
    let hashes = stage_results::metric_hashes(conn, &ids).await?;
    let verdicts = verdicts::of_pairs(conn, &ids, left_out).await?;
    let mut with_truth = Vec::new();
    for (row, id) in found.iter().zip(&ids) {
        if row.get::<Option<String>>("truth")?.is_some() {
            with_truth.push(*id);
        }
    }
    let mut places = ground_truth::print_places(conn, &with_truth).await?;
    let mut assemble_pair = |row: &Row, id: i64| {
        let cursor: Cursor = row.get("stage")?;
        let mut records = stages.remove(&id).unwrap_or_default();
        records.retain(|record| (record.stage.index() as Cursor) < cursor);
        let truth: Option<Json<_>> = row.get("truth")?;
        Ok(PairResults {
            attributes: PairAttributes::from_row(row)?,
            status: row.get("status")?,
            next_stage: usize::try_from(cursor).ok().and_then(Stage::from_index),
            failure: stored_failure(row)?,
            metrics: metrics(id, &records, &hashes, &verdicts)?,
            stages: records,
            truth: truth.map(|Json(body)| body),
            print_place: places.remove(&id),
        })
    };
    let pairs = found.iter().zip(ids);
    let pairs = pairs
        .map(|(row, id)| assemble_pair(row, id).map_err(|error: CatalogError| error.in_pair(id)));
    pairs.collect()
}

/// Returns the metrics of a pair, with the verdicts on their current results. Returns none if the pair is not done.
fn metrics(
    pair: i64,
    stages: &[StageRecord],
    hashes: &BTreeMap<(i64, ThresholdMetric), ContentHash>,
    verdicts: &BTreeMap<(i64, ThresholdMetric), Vec<verdicts::ResultVerdict>>,
) -> Result<Vec<MetricRecord>> {
    let Some(record) = stages.iter().find(|record| record.stage == Stage::Register) else {
        return Ok(Vec::new());
    };
    let outcome: RegisterOutcome = record.parse()?;
    let mut found = Vec::with_capacity(outcome.metrics.len());
    for outcome in outcome.metrics {
        let key = (pair, outcome.metric);
        let Some(result_hash) = hashes.get(&key).copied() else {
            let text = format!("pair {pair} has no row of {}", outcome.metric);
            return Err(CatalogError::Corrupt(text));
        };
        let (current, older): (Vec<_>, Vec<_>) = verdicts
            .get(&key)
            .into_iter()
            .flatten()
            .partition(|counted| counted.result_hash == result_hash);
        found.push(MetricRecord {
            outcome,
            result_hash,
            verdicts: current
                .iter()
                .map(|counted| counted.verdict.clone())
                .collect(),
            older_verdicts: older.len() as u64,
        });
    }
    found.sort_by_key(|record| {
        ThresholdMetric::ALL
            .iter()
            .position(|metric| *metric == record.outcome.metric)
    });
    Ok(found)
}
