//! Creates many completed pairs by copying the rows of one pair in SQL.

use std::path::Path;

use sqlx::sqlite::{SqliteConnectOptions, SqliteSynchronous};
use sqlx::{ConnectOptions as _, Connection as _};

const COPIES: [&str; 5] = [
    "INSERT INTO stage_result (pair, stage, fingerprint, mesh_hash, print_hash, attributes, outcome, files, result_hash, ms,
        worker, at)
    SELECT j.pair, r.stage, r.fingerprint, r.mesh_hash, r.print_hash, r.attributes, r.outcome, r.files, r.result_hash, r.ms,
        r.worker, r.at
    FROM job AS j CROSS JOIN stage_result AS r ON r.pair = 1 WHERE j.pair > ?1 AND j.pair <= ?2",
    "INSERT INTO metric_result (pair, metric, result_hash, confidence, iou)
    SELECT j.pair, m.metric, m.result_hash, (j.pair * 7919 % 100000) / 100000.0, (j.pair * 104729 % 100000) / 100000.0
    FROM job AS j CROSS JOIN metric_result AS m ON m.pair = 1 WHERE j.pair > ?1 AND j.pair <= ?2",
    "INSERT INTO attempt (pair, stage, worker, ms, at)
    SELECT j.pair, a.stage, a.worker, a.ms, a.at
    FROM job AS j CROSS JOIN attempt AS a ON a.pair = 1 WHERE j.pair > ?1 AND j.pair <= ?2",
    "UPDATE pair SET mesh_hash = one.mesh_hash, mesh_stat = one.mesh_stat, print_hash = one.print_hash,
        print_stat = one.print_stat
    FROM (SELECT * FROM pair WHERE id = 1) AS one WHERE pair.id > ?1 AND pair.id <= ?2",
    "UPDATE job SET stage = 4, status = 3, attempt = 1, token = 1, fingerprint = (SELECT fingerprint FROM job WHERE pair = 1)
    WHERE pair > ?1 AND pair <= ?2",
];

const COUNT: &str = "
UPDATE counter SET n = (SELECT count(*) FROM job AS j WHERE j.stage = counter.stage AND j.status = counter.status
    AND coalesce(j.fingerprint, 0) = counter.fingerprint)";

/// Pairs per statement, so that the write-ahead log stays small.
const CHUNK: usize = 100_000;

/// Copies the results of the first pair to the pairs `after + 1` to `last`.
pub(super) async fn copy(catalog: &Path, after: usize, last: usize) -> anyhow::Result<()> {
    let options = SqliteConnectOptions::new()
        .filename(catalog)
        .synchronous(SqliteSynchronous::Off);
    let mut conn = options.connect().await?;
    for from in (after..last).step_by(CHUNK) {
        let to = last.min(from + CHUNK);
        for sql in COPIES {
            let query = sqlx::query(sql).bind(from as i64).bind(to as i64);
            query.execute(&mut conn).await?;
        }
    }
    sqlx::query(COUNT).execute(&mut conn).await?;
    sqlx::query("PRAGMA wal_checkpoint(TRUNCATE)")
        .execute(&mut conn)
        .await?;
    Ok(conn.close().await?)
}
