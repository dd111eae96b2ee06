//! Reads pairs with their results for a check. Rows with invalid values do not stop the check.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::query::query;
use crate::db::row::{FromRow as _, Row, from_row};
use crate::db::rows::json_array;
use crate::queue::lease::MetricResult;
use crate::records::pair_work::{self, KnownInputs};
use crate::{Catalog, Result};
use mocban_core::domain::{
    ContentHash, Disagreement, JobStatus, MetricOutcome, PairId, PairName, Scores, Stage,
    ThresholdMetric,
};

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
    /// The rows of the metrics. Rows with invalid values are left out.
    pub metrics: BTreeMap<ThresholdMetric, MetricResult>,
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

const METRICS: &str = "
SELECT m.* FROM json_each(?1) AS wanted CROSS JOIN metric_result AS m ON m.pair = CAST(wanted.atom AS bigint)";

impl Catalog {
    /// Reads up to `limit` pairs with ids above `after`.
    ///
    /// # Errors
    /// Returns an error if a database operation fails.
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
        let mut metrics = by_pair(&mut conn, METRICS, &ids, metric).await?;
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
        inputs: pair_work::known_inputs(row)?,
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

fn metric(row: &Row) -> Result<(ThresholdMetric, MetricResult)> {
    let metric = row.get("metric")?;
    let result = MetricResult {
        outcome: MetricOutcome {
            metric,
            threshold_level: row.get("threshold_level")?,
            threshold_depth: row.get("threshold_depth")?,
            print_from_depth: row.get("print_from_depth")?,
            angle_deg: row.get("angle_deg")?,
            scale: row.get("scale")?,
            shift_px: [row.get("shift_x_px")?, row.get("shift_y_px")?],
            scores: Scores {
                ssim: row.get("ssim")?,
                nl_ssim: row.get("nl_ssim")?,
                iou: row.get("iou")?,
                iou_box: row.get("iou_box")?,
                dice: row.get("dice")?,
                density_print: row.get("density_print")?,
                density_depth: row.get("density_depth")?,
            },
            disagreement: Disagreement {
                pieces: row.get("disagreements")?,
                missing_ink: row.get("missing_ink")?,
                missing_wood: row.get("missing_wood")?,
            },
            margin: row.get("margin")?,
            confidence: row.get("confidence")?,
            at_bound: row.get("at_bound")?,
        },
        result_hash: row.get("result_hash")?,
    };
    Ok((metric, result))
}
