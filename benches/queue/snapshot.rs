//! Times claims and completions on a catalog in PostgreSQL, with and without a snapshot that another session holds.
//! While the snapshot is held, the server cannot remove the old versions of claimed jobs.

use std::fmt::Write as _;
use std::str::FromStr as _;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mocban::catalog::{Catalog, Lease};
use sqlx::postgres::PgConnectOptions;
use sqlx::{AssertSqlSafe, ConnectOptions as _, Connection as _, PgConnection};

use super::fake::Fake;
use super::options::Options;
use super::postgres::import;
use super::world::fingerprints;

/// Connections, each with a worker.
const CONNECTIONS: usize = 4;
/// How long a line is measured, if the pairs last that long.
const TIME: Duration = Duration::from_secs(36);
/// The schema of each line.
const SCHEMA: &str = "bench_snapshot";
/// Ends the jobs of a claim without results: changes their rows and the counters.
const END: &str = "
WITH ended AS (
    UPDATE job SET status = 3, stage = 4, worker = NULL, deadline = NULL
    WHERE pair = ANY ($1) AND worker = $2 AND status = 1 RETURNING 1)
INSERT INTO counter_part (slot, stage, status, fingerprint, n)
SELECT pg_backend_pid() % 256, stage, status, 0, sign * (SELECT count(*) FROM ended)
FROM (VALUES (0, 1, -1), (4, 3, 1)) AS item (stage, status, sign)
ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n";

/// What is measured.
#[derive(Debug, Clone, Copy)]
struct Load {
    /// Pairs per claim.
    batch: usize,
    /// Whether to store the results of four stages, or only the end of the job.
    has_results: bool,
    is_snapshot_held: bool,
}

/// Pairs per claim, and whether results are stored.
const LOADS: [(usize, bool); 3] = [(64, false), (500, false), (64, true)];

/// The pairs that a load finished, and the times of its claims.
#[derive(Debug, Default)]
struct Finished {
    pairs: usize,
    claims: Vec<Duration>,
}

/// Returns a table of pairs per second.
pub(super) async fn table(options: &Options, url: &str) -> anyhow::Result<String> {
    let pairs = options.sizes()[0];
    let mut table = format!(
        "\n{pairs} pairs, {CONNECTIONS} connections, at most {} s a line\n\n\
         | stored | pairs a claim | snapshot held | pairs | pairs/s | claim p50 / p95 (ms) |\n|---|---|---|---|---|---|\n",
        TIME.as_secs()
    );
    for (batch, has_results) in LOADS {
        for is_snapshot_held in [false, true] {
            let load = Load {
                batch,
                has_results,
                is_snapshot_held,
            };
            let (mut finished, time) = line(url, pairs, load).await?;
            finished.claims.sort();
            let ms = |share: f64| {
                let at = (finished.claims.len().saturating_sub(1) as f64 * share) as usize;
                finished.claims.get(at).map_or(0.0, Duration::as_secs_f64) * 1e3
            };
            writeln!(
                table,
                "| {} | {batch} | {} | {} | {:.0} | {:.1} / {:.1} |",
                if has_results {
                    "results of four stages"
                } else {
                    "end of the job"
                },
                if is_snapshot_held { "yes" } else { "no" },
                finished.pairs,
                finished.pairs as f64 / time.as_secs_f64(),
                ms(0.5),
                ms(0.95)
            )?;
        }
    }
    Ok(table)
}

/// Measures one line in a new schema.
async fn line(url: &str, pairs: usize, load: Load) -> anyhow::Result<(Finished, Duration)> {
    let mut conn = PgConnectOptions::from_str(url)?.connect().await?;
    let drop = || AssertSqlSafe(format!("DROP SCHEMA IF EXISTS {SCHEMA} CASCADE"));
    sqlx::raw_sql(drop()).execute(&mut conn).await?;
    let separator = if url.contains('?') { '&' } else { '?' };
    let url = format!("{url}{separator}options=-c%20search_path%3D{SCHEMA}");
    let catalog = Catalog::connect(&url, true).await?;
    import(&catalog, pairs).await?;
    sqlx::raw_sql("CHECKPOINT").execute(&mut conn).await?;
    let fake = Fake::without_files(&catalog, &fingerprints(None)?).await?;
    let mut holder = PgConnectOptions::from_str(&url)?.connect().await?;
    if load.is_snapshot_held {
        let hold = "BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT FROM job LIMIT 1";
        sqlx::raw_sql(hold).execute(&mut holder).await?;
    }
    let mut tasks = tokio::task::JoinSet::new();
    let begin = Instant::now();
    for _ in 0..CONNECTIONS {
        let catalog = Catalog::connect(&url, false).await?;
        let conn = PgConnectOptions::from_str(&url)?.connect().await?;
        let fake = Arc::new(fake.another_worker(&catalog).await?);
        tasks.spawn(work(catalog, conn, fake, load));
    }
    let mut finished = Finished::default();
    while let Some(ended) = tasks.join_next().await {
        let ended = ended??;
        finished.pairs += ended.pairs;
        finished.claims.extend(ended.claims);
    }
    let time = begin.elapsed();
    holder.close().await?;
    catalog.close().await;
    sqlx::raw_sql(drop()).execute(&mut conn).await?;
    conn.close().await?;
    Ok((finished, time))
}

/// Claims and finishes pairs until none is left or the time is over.
async fn work(
    catalog: Catalog,
    mut conn: PgConnection,
    fake: Arc<Fake>,
    load: Load,
) -> anyhow::Result<Finished> {
    let _waiting = catalog.waiting().await?;
    let begin = Instant::now();
    let mut finished = Finished::default();
    while begin.elapsed() < TIME {
        let claim = Instant::now();
        let leases = catalog.claim(fake.request(load.batch)).await?;
        if leases.is_empty() {
            break;
        }
        finished.claims.push(claim.elapsed());
        finished.pairs += leases.len();
        if load.has_results {
            finish(&catalog, &fake, leases).await?;
            continue;
        }
        let pairs: Vec<i64> = leases.iter().map(|lease| lease.pair().0).collect();
        let end = sqlx::query(END).bind(pairs).bind(fake.worker.0);
        end.execute(&mut conn).await?;
    }
    catalog.end_worker(fake.worker, 2, None).await?;
    catalog.close().await;
    Ok(finished)
}

async fn finish(catalog: &Catalog, fake: &Fake, leases: Vec<Lease>) -> anyhow::Result<()> {
    let stored = leases
        .into_iter()
        .map(|lease| fake.finish_at_once(catalog, lease));
    futures_util::future::join_all(stored)
        .await
        .into_iter()
        .collect()
}
