//! Results of stages and metrics, read back for a few pairs at a time.

use std::collections::BTreeMap;

use serde_json::Value;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::records::model::StageRecord;
use crate::domain::{ContentHash, ThresholdMetric};

pub(crate) const STAGE_RESULTS: &str = "
SELECT r.pair, r.stage, r.mesh_hash, r.print_hash, r.outcome, r.files, r.result_hash, r.ms, r.at,
    fingerprint.hash AS fingerprint_hash, fingerprint.fields AS fingerprint_fields
FROM json_each(?1) AS wanted CROSS JOIN stage_result AS r ON r.pair = wanted.value
    CROSS JOIN fingerprint ON fingerprint.id = r.fingerprint
ORDER BY r.pair, r.stage";

pub(crate) const METRIC_HASHES: &str = "
SELECT m.pair, m.metric, m.result_hash
FROM json_each(?1) AS wanted CROSS JOIN metric_result AS m ON m.pair = wanted.value";

/// Stage results by pair, in the order of the stages.
pub(crate) async fn of_pairs(
    conn: &mut SqliteConnection,
    pairs: &[i64],
) -> Result<BTreeMap<i64, Vec<StageRecord>>> {
    let found = sqlx::query(STAGE_RESULTS)
        .bind(Value::from(pairs).to_string())
        .fetch_all(conn)
        .await?;
    let mut records: BTreeMap<i64, Vec<StageRecord>> = BTreeMap::new();
    for row in &found {
        let pair = row.try_get("pair")?;
        records.entry(pair).or_default().push(record(row)?);
    }
    Ok(records)
}

fn record(row: &sqlx::sqlite::SqliteRow) -> Result<StageRecord> {
    let hash =
        |column: &str| -> Result<ContentHash> { rows::hash(&row.try_get::<Vec<u8>, _>(column)?) };
    let print: Option<Vec<u8>> = row.try_get("print_hash")?;
    Ok(StageRecord {
        stage: rows::stage(row.try_get("stage")?)?,
        outcome: serde_json::from_str(&row.try_get::<String, _>("outcome")?)?,
        files: serde_json::from_str(&row.try_get::<String, _>("files")?)?,
        result_hash: hash("result_hash")?,
        fingerprint_hash: hash("fingerprint_hash")?,
        fingerprint_fields: serde_json::from_str(&row.try_get::<String, _>("fingerprint_fields")?)?,
        mesh_hash: hash("mesh_hash")?,
        print_hash: rows::hash_option(print.as_deref())?,
        ms: row.try_get::<i64, _>("ms")?.unsigned_abs(),
        at: row.try_get("at")?,
    })
}

/// Hashes that verdicts on the current results are bound to, by pair and metric.
pub(crate) async fn metric_hashes(
    conn: &mut SqliteConnection,
    pairs: &[i64],
) -> Result<BTreeMap<(i64, ThresholdMetric), ContentHash>> {
    let found = sqlx::query(METRIC_HASHES)
        .bind(Value::from(pairs).to_string())
        .fetch_all(conn)
        .await?;
    found
        .iter()
        .map(|row| {
            let metric = rows::name(&row.try_get::<String, _>(1)?)?;
            let hash = rows::hash(&row.try_get::<Vec<u8>, _>(2)?)?;
            Ok(((row.try_get(0)?, metric), hash))
        })
        .collect()
}
