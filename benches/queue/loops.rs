//! A simple queue over the same schema, for comparison. Each claim and each checkpoint is a transaction of its own.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use mocban::domain::{ContentHash, Stage};
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{Row as _, SqliteConnection};

use super::fake::Fake;

const CLAIM: &str = "
UPDATE job SET status = 1, worker = ?1, deadline = 1000, token = token + 1, attempt = attempt + 1
WHERE pair = (SELECT pair FROM job WHERE status = 0 ORDER BY prio, stage DESC, pair LIMIT 1)
RETURNING pair, token";
const STEP: &str = "
UPDATE job SET stage = ?2, status = iif(?2 = 4, 3, 1), worker = iif(?2 = 4, NULL, worker),
    deadline = iif(?2 = 4, NULL, 2000), attempt = 1, crashes = 0,
    fingerprint = (SELECT id FROM fingerprint WHERE stage = ?2 - 1)
WHERE pair = ?1 AND token = ?3 AND status = 1";
const RESULT: &str = "
INSERT INTO stage_result
    (pair, stage, fingerprint, mesh_hash, print_hash, attributes, outcome, files, result_hash, ms, worker, at)
VALUES (?1, ?2, (SELECT id FROM fingerprint WHERE stage = ?2), ?3, ?4, ?5, ?6, '{}', ?7, 1, ?8, 1)";
const ATTEMPT: &str = "INSERT INTO attempt (pair, stage, worker, ms, at) VALUES (?1, ?2, ?3, 1, 1)";
const INPUTS: &str = "UPDATE pair SET mesh_hash = ?2, print_hash = ?3 WHERE id = ?1";
const COUNTER: &str = "
UPDATE counter SET n = n + ?3 WHERE stage = ?1 AND status = ?2
    AND fingerprint = coalesce((SELECT id FROM fingerprint WHERE stage = ?1 - 1), 0)";
const METRIC: &str = "INSERT INTO metric_result (pair, metric, result_hash) VALUES (?1, ?2, ?3)";

/// Runs `pairs` pairs through all stages. Each worker has its own connection.
pub(super) async fn work(
    catalog: &Path,
    fake: &Fake,
    pairs: usize,
    workers: usize,
) -> anyhow::Result<Duration> {
    let options = SqliteConnectOptions::new()
        .filename(catalog)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .busy_timeout(Duration::from_mins(5));
    let pool = SqlitePoolOptions::new().max_connections(workers as u32);
    let pool = pool.connect_with(options).await?;
    let left = Arc::new(AtomicUsize::new(pairs));
    let start = Instant::now();
    let mut tasks = tokio::task::JoinSet::new();
    for _ in 0..workers {
        tasks.spawn(run_pairs(pool.clone(), fake.clone(), Arc::clone(&left)));
    }
    while let Some(ended) = tasks.join_next().await {
        ended??;
    }
    let time = start.elapsed();
    pool.close().await;
    Ok(time)
}

async fn run_pairs(pool: SqlitePool, fake: Fake, left: Arc<AtomicUsize>) -> anyhow::Result<()> {
    let mut conn = pool.acquire().await?;
    let one_less = |n: usize| n.checked_sub(1);
    while left
        .fetch_update(Ordering::SeqCst, Ordering::SeqCst, one_less)
        .is_ok()
    {
        let (pair, token) = claim(&mut conn, &fake).await?;
        for stage in Stage::ALL {
            checkpoint(&mut conn, &fake, stage, pair, token).await?;
        }
    }
    Ok(())
}

async fn claim(conn: &mut SqliteConnection, fake: &Fake) -> anyhow::Result<(i64, i64)> {
    sqlx::query("BEGIN IMMEDIATE").execute(&mut *conn).await?;
    let row = sqlx::query(CLAIM).bind(fake.worker.0);
    let row = row.fetch_one(&mut *conn).await?;
    count(conn, (0, 0), (0, 1)).await?;
    sqlx::query("COMMIT").execute(conn).await?;
    Ok((row.try_get(0)?, row.try_get(1)?))
}

async fn checkpoint(
    conn: &mut SqliteConnection,
    fake: &Fake,
    stage: Stage,
    pair: i64,
    token: i64,
) -> anyhow::Result<()> {
    let (done, at) = (fake.done(stage), stage.index() as i64);
    let hash = |hash: Option<ContentHash>| hash.map(|hash| hash.as_bytes().to_vec());
    let mesh = hash(done.provenance.mesh_hash);
    let print = hash(done.provenance.print_hash);
    sqlx::query("BEGIN IMMEDIATE").execute(&mut *conn).await?;
    let step = sqlx::query(STEP).bind(pair).bind(at + 1).bind(token);
    anyhow::ensure!(step.execute(&mut *conn).await?.rows_affected() == 1);
    let result = sqlx::query(RESULT).bind(pair).bind(at).bind(&mesh);
    let result = result
        .bind(&print)
        .bind(done.provenance.attributes)
        .bind(done.outcome);
    let result = result.bind(done.result_hash.as_bytes().to_vec());
    result.bind(fake.worker.0).execute(&mut *conn).await?;
    let attempt = sqlx::query(ATTEMPT).bind(pair).bind(at);
    attempt.bind(fake.worker.0).execute(&mut *conn).await?;
    let inputs = sqlx::query(INPUTS).bind(pair).bind(mesh).bind(print);
    inputs.execute(&mut *conn).await?;
    for metric in done.metrics {
        let row = sqlx::query(METRIC).bind(pair);
        let row = row.bind(metric.outcome.metric.name());
        let row = row.bind(metric.result_hash.as_bytes().to_vec());
        row.execute(&mut *conn).await?;
    }
    let status = if at == 3 { 3 } else { 1 };
    count(conn, (at, 1), (at + 1, status)).await?;
    sqlx::query("COMMIT").execute(conn).await?;
    Ok(())
}

async fn count(
    conn: &mut SqliteConnection,
    from: (i64, i64),
    to: (i64, i64),
) -> anyhow::Result<()> {
    for ((stage, status), n) in [(from, -1), (to, 1)] {
        let query = sqlx::query(COUNTER).bind(stage).bind(status).bind(n);
        query.execute(&mut *conn).await?;
    }
    Ok(())
}
