//! Reads pairs with their results for a check. Rows with invalid values do not stop the check.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::query::query;
use crate::db::row::{FromRow as _, Row, from_row};
use crate::db::rows::json_array;
use crate::records::pair_work::KnownInputs;
use crate::records::stage_results::METRIC_HASHES;
use crate::{Catalog, Result};
use mocban_core::domain::{ContentHash, JobStatus, PairId, PairName, Stage, ThresholdMetric};

/// A pair as stored, with unparsed results.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditedPair {
    /// The user's id.
    pub name: PairName,
    /// Id of the pair, with the paths and hashes of its input files as last read.
    pub inputs: KnownInputs,
    /// Status and cursor of the pair's job. `None` if there is no job.
    pub job: Option<(JobStatus, i64)>,
    /// Whether the pair is retired, so that it has no job.
    pub is_retired: bool,
    /// Whether a failure is stored.
    pub has_failure: bool,
    /// Every stored result, also of stages that are to run again. Results with invalid values are left out.
    pub results: BTreeMap<Stage, AuditedResult>,
    /// Hashes of the results of the metrics. Rows with invalid values are left out.
    pub metrics: BTreeMap<ThresholdMetric, ContentHash>,
}

/// Pairs that a check has read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AuditPage {
    /// The pairs, sorted by id.
    pub pairs: Vec<AuditedPair>,
    /// Pairs with an invalid value, and messages.
    pub unreadable: Vec<(PairId, String)>,
    /// Id of the last pair. `None` if there are no more pairs.
    pub last: Option<PairId>,
}

/// A stored result, left unparsed so that a check can also read invalid values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditedResult {
    /// The outcome as JSON text.
    pub outcome: String,
    /// The artifacts as JSON text.
    pub files: String,
    /// Stored hash of the outcome and the artifacts.
    pub result_hash: ContentHash,
}

from_row! { AuditedResult { outcome, files, result_hash } }

pub(crate) const PAGE: &str = "
SELECT p.id, p.name, p.mesh_path, p.mesh_hash, p.mesh_stat, p.print_path, p.print_hash, p.print_stat,
    j.stage, j.status, f.pair IS NOT NULL AS has_failure, r.pair IS NOT NULL AS is_retired
FROM pair AS p LEFT JOIN job AS j ON j.pair = p.id LEFT JOIN failure AS f ON f.pair = p.id
    LEFT JOIN retired_pair AS r ON r.pair = p.id
WHERE p.id > ?1 ORDER BY p.id LIMIT ?2";

pub(crate) const RESULTS: &str = "
SELECT r.pair, r.stage, r.outcome, r.files, r.result_hash
FROM json_each(?1) AS wanted CROSS JOIN stage_result AS r ON r.pair = CAST(wanted.atom AS bigint)";

impl Catalog {
    /// Reads up to `limit` pairs with ids above `after`.
    pub async fn audit_page(&self, after: Option<PairId>, limit: usize) -> Result<AuditPage> {
        let mut conn = self.snapshot().await?;
        let query = query(PAGE).bind(after.map_or(0, |pair| pair.0));
        let found = query.bind(limit as i64).fetch_all(&mut conn).await?;
        let mut page = AuditPage::default();
        for row in &found {
            let id = PairId(row.get("id")?);
            page.last = Some(id);
            match pair(row) {
                Ok(pair) => page.pairs.push(pair),
                Err(error) => page.unreadable.push((id, error.to_string())),
            }
        }
        let ids = json_array(page.pairs.iter().map(|pair| pair.inputs.pair.0));
        let mut results = by_pair(&mut conn, RESULTS, &ids, result).await?;
        let mut metrics = by_pair(&mut conn, METRIC_HASHES, &ids, metric).await?;
        for pair in &mut page.pairs {
            let id = pair.inputs.pair.0;
            pair.results = results.remove(&id).unwrap_or_default();
            pair.metrics = metrics.remove(&id).unwrap_or_default();
        }
        Ok(page)
    }
}

fn pair(row: &Row) -> Result<AuditedPair> {
    let status: Option<JobStatus> = row.get("status")?;
    Ok(AuditedPair {
        name: row.get("name")?,
        inputs: KnownInputs::from_row(row)?,
        job: status.zip(row.get("stage")?),
        is_retired: row.get("is_retired")?,
        has_failure: row.get("has_failure")?,
        results: BTreeMap::new(),
        metrics: BTreeMap::new(),
    })
}

/// Reads the rows of a query with `read` and groups the values by pair. Leaves out rows with invalid values.
async fn by_pair<K: Ord, V>(
    conn: &mut Conn,
    sql: &'static str,
    pairs: &str,
    read: impl Fn(&Row) -> Result<(K, V)>,
) -> Result<BTreeMap<i64, BTreeMap<K, V>>> {
    let mut found: BTreeMap<i64, BTreeMap<K, V>> = BTreeMap::new();
    for row in &query(sql).bind(pairs).fetch_all(conn).await? {
        if let Ok((key, value)) = read(row) {
            let of_pair = found.entry(row.get("pair")?).or_default();
            of_pair.insert(key, value);
        }
    }
    Ok(found)
}

fn result(row: &Row) -> Result<(Stage, AuditedResult)> {
    Ok((row.get("stage")?, AuditedResult::from_row(row)?))
}

fn metric(row: &Row) -> Result<(ThresholdMetric, ContentHash)> {
    Ok((row.get("metric")?, row.get("result_hash")?))
}
