//! The current results of pairs, which verdicts judge.

use std::collections::{BTreeMap, BTreeSet};

use crate::Result;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::query_as;
use crate::db::rows::json_array;
use mocban_core::domain::{ContentHash, PairName, ThresholdMetric};

/// Selects the current results of pairs. A pair that is not done, or is retired, has one row whose metric is NULL.
const JUDGED: Sql = Sql::pair(
    "
SELECT p.name, p.id AS pair, m.metric, m.result_hash FROM pair AS p
    LEFT JOIN job AS j ON j.pair = p.id LEFT JOIN metric_result AS m ON m.pair = p.id AND j.status = 3
WHERE p.name IN (SELECT atom FROM json_each(?1)) ORDER BY p.id, m.metric",
    "
SELECT p.name, p.id AS pair, m.metric, m.result_hash FROM pair AS p
    LEFT JOIN job AS j ON j.pair = p.id LEFT JOIN metric_result AS m ON m.pair = p.id AND j.status = 3
WHERE p.name = ANY (ARRAY(SELECT atom FROM json_each(?1))) ORDER BY p.id, m.metric",
);

/// A result that a verdict judges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct JudgedResult {
    pub(crate) pair: i64,
    pub(crate) metric: ThresholdMetric,
    pub(crate) hash: ContentHash,
}

/// Returns the current results of the pairs, by name. A pair that is not done, or is retired, has none.
pub(crate) async fn current_results(
    conn: &mut Conn,
    names: BTreeSet<&str>,
) -> Result<BTreeMap<PairName, Vec<JudgedResult>>> {
    let found: Vec<(PairName, i64, Option<ThresholdMetric>, Option<ContentHash>)> =
        query_as(JUDGED)
            .bind(json_array(names))
            .fetch_all(conn)
            .await?;
    let mut results: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (name, pair, metric, hash) in found {
        results.entry(name).or_default().extend(
            metric
                .zip(hash)
                .map(|(metric, hash)| JudgedResult { pair, metric, hash }),
        );
    }
    Ok(results)
}
