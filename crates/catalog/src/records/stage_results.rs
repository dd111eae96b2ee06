//! Results of stages and metrics, read back for a few pairs at a time.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::{query, query_as};
use crate::db::row::FromRow as _;
use crate::db::rows::json_array;
use crate::records::model::StageRecord;
use mocban_core::domain::{ContentHash, ThresholdMetric};

pub(crate) const STAGE_RESULTS: &str = "
SELECT r.pair, r.stage, r.mesh_hash, r.print_hash, r.outcome, r.files, r.result_hash, r.ms, r.at,
    fingerprint.hash AS fingerprint_hash, fingerprint.fields AS fingerprint_fields
FROM json_each(?1) AS wanted CROSS JOIN stage_result AS r ON r.pair = CAST(wanted.atom AS bigint)
    CROSS JOIN fingerprint ON fingerprint.id = r.fingerprint
ORDER BY r.pair, r.stage";

pub(crate) const METRIC_HASHES: &str = "
SELECT m.pair, m.metric, m.result_hash
FROM json_each(?1) AS wanted CROSS JOIN metric_result AS m ON m.pair = CAST(wanted.atom AS bigint)";

/// Returns stage results by pair, in the order of the stages.
pub(crate) async fn of_pairs(
    conn: &mut Conn,
    pairs: &[i64],
) -> Result<BTreeMap<i64, Vec<StageRecord>>> {
    let query = query(STAGE_RESULTS).bind(json_array(pairs.iter().copied()));
    let mut records: BTreeMap<i64, Vec<StageRecord>> = BTreeMap::new();
    for row in &query.fetch_all(conn).await? {
        let of_pair = records.entry(row.get("pair")?).or_default();
        of_pair.push(StageRecord::from_row(row)?);
    }
    Ok(records)
}

/// Returns the hash of each metric's current result, by pair and metric. A verdict refers to a result by this hash.
pub(crate) async fn metric_hashes(
    conn: &mut Conn,
    pairs: &[i64],
) -> Result<BTreeMap<(i64, ThresholdMetric), ContentHash>> {
    let query = query_as(METRIC_HASHES).bind(json_array(pairs.iter().copied()));
    let found: Vec<(i64, ThresholdMetric, ContentHash)> = query.fetch_all(conn).await?;
    let found = found.into_iter();
    Ok(found
        .map(|(pair, metric, hash)| ((pair, metric), hash))
        .collect())
}
