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

/// Longest time of a line without the snapshot.
const PLAIN_TIME: Duration = Duration::from_mins(1);
/// The part of a line that is also measured on its own, at its end.
const LAST_TIME: Duration = Duration::from_secs(30);
/// The schema of each load.
const SCHEMA: &str = "bench_snapshot";
/// Ends the jobs of a claim without results: changes their rows and the counters.
const END: &str = "
WITH ended AS (
    UPDATE job SET status = 3, stage = 4, worker = NULL, deadline = NULL
    WHERE pair = ANY ($1) AND worker = $2 AND status + 0 = 1 RETURNING 1)
INSERT INTO counter_part (stage, status, fingerprint, n)
SELECT stage, status, 0, sign * (SELECT count(*) FROM ended)
FROM (VALUES (0, 1, -1), (4, 3, 1)) AS item (stage, status, sign)
ON CONFLICT (slot, stage, status, fingerprint) DO UPDATE SET n = counter_part.n + excluded.n";

/// What is measured.
#[derive(Debug, Clone, Copy)]
struct Load {
    /// Pairs per claim.
    batch: usize,
    /// Whether to store the results of four stages, or only the end of the job.
    has_results: bool,
}

const LOADS: [Load; 3] = [
    Load {
        batch: 64,
        has_results: false,
    },
    Load {
        batch: 500,
        has_results: false,
    },
    Load {
        batch: 64,
        has_results: true,
    },
];

/// The pairs that a line finished, and the times of its claims.
#[derive(Debug, Default)]
struct Finished {
    pairs: usize,
    /// Of them, those in `LAST_TIME`.
    last_pairs: usize,
    claims: Vec<Duration>,
}

/// Returns a table of pairs per second.
pub(super) async fn table(options: &Options, url: &str) -> anyhow::Result<String> {
    let pairs = options.sizes()[0];
    let mut table = format!(
        "\n{pairs} pairs, {} connections, {} s a line with the snapshot\n\n\
         | stored | pairs a claim | snapshot held | pairs | pairs/s | pairs/s at the end | claim p50 / p95 (ms) |\n\
         |---|---|---|---|---|---|---|\n",
        options.connections, options.seconds
    );
    let mut times = String::new();
    let loads = LOADS.into_iter();
    for load in loads.filter(|load| load.has_results || !options.results_only) {
        times += &lines(options, url, pairs, load, &mut table).await?;
    }
    Ok(table + "\n" + &times)
}

/// Measures a load in a new schema, first without the snapshot, then with it. Appends to the table, and returns the times
/// of the import and of the status.
async fn lines(
    options: &Options,
    url: &str,
    pairs: usize,
    load: Load,
    table: &mut String,
) -> anyhow::Result<String> {
    let mut conn = PgConnectOptions::from_str(url)?.connect().await?;
    let drop = || AssertSqlSafe(format!("DROP SCHEMA IF EXISTS {SCHEMA} CASCADE"));
    sqlx::raw_sql(drop()).execute(&mut conn).await?;
    let separator = if url.contains('?') { '&' } else { '?' };
    let url = format!("{url}{separator}options=-c%20search_path%3D{SCHEMA}");
    let catalog = Catalog::connect_or_create(&url).await?;
    let begin = Instant::now();
    import(&catalog, pairs).await?;
    let imported = begin.elapsed();
    sqlx::raw_sql("CHECKPOINT").execute(&mut conn).await?;
    let fake = Fake::without_files(&catalog, &fingerprints(None)?).await?;
    let begin = Instant::now();
    catalog.status(&fingerprints(None)?).await?;
    let status = begin.elapsed();
    for is_snapshot_held in [false, true] {
        let mut holder = PgConnectOptions::from_str(&url)?.connect().await?;
        let mut limit = Duration::from_secs(options.seconds);
        if is_snapshot_held {
            let hold = "BEGIN ISOLATION LEVEL REPEATABLE READ; SELECT FROM job LIMIT 1";
            sqlx::raw_sql(hold).execute(&mut holder).await?;
        } else {
            limit = limit.min(PLAIN_TIME);
        }
        let mut tasks = tokio::task::JoinSet::new();
        let begin = Instant::now();
        for _ in 0..options.connections {
            let catalog = Catalog::connect(&url).await?;
            let conn = PgConnectOptions::from_str(&url)?.connect().await?;
            let fake = Arc::new(fake.another_worker(&catalog).await?);
            tasks.spawn(work(catalog, conn, fake, load, begin + limit));
        }
        let mut finished = Finished::default();
        while let Some(ended) = tasks.join_next().await {
            let ended = ended??;
            finished.pairs += ended.pairs;
            finished.last_pairs += ended.last_pairs;
            finished.claims.extend(ended.claims);
        }
        let time = begin.elapsed();
        holder.close().await?;
        finished.claims.sort();
        let ms = |share: f64| {
            let at = (finished.claims.len().saturating_sub(1) as f64 * share) as usize;
            finished.claims.get(at).map_or(0.0, Duration::as_secs_f64) * 1e3
        };
        let at_end = if time < limit {
            // No pairs were left.
            "-".to_owned()
        } else {
            let last_time = LAST_TIME.min(limit).as_secs_f64();
            format!("{:.0}", finished.last_pairs as f64 / last_time)
        };
        writeln!(
            table,
            "| {} | {} | {} | {} | {:.0} | {} | {:.1} / {:.1} |",
            if load.has_results {
                "results of four stages"
            } else {
                "end of the job"
            },
            load.batch,
            if is_snapshot_held { "yes" } else { "no" },
            finished.pairs,
            finished.pairs as f64 / time.as_secs_f64(),
            at_end,
            ms(0.5),
            ms(0.95)
        )?;
    }
    catalog.close().await;
    sqlx::raw_sql(drop()).execute(&mut conn).await?;
    conn.close().await?;
    Ok(format!(
        "Import {:.1} s, status {:.1} ms\n",
        imported.as_secs_f64(),
        status.as_secs_f64() * 1e3
    ))
}

/// Claims and finishes pairs until none is left or `end` has passed.
async fn work(
    catalog: Catalog,
    mut conn: PgConnection,
    fake: Arc<Fake>,
    load: Load,
    end: Instant,
) -> anyhow::Result<Finished> {
    let _waiting = catalog.waiting().await?;
    let mut finished = Finished::default();
    while Instant::now() < end {
        let claim = Instant::now();
        let leases = catalog.claim(fake.request(load.batch)).await?;
        if leases.is_empty() {
            break;
        }
        finished.claims.push(claim.elapsed());
        let count = leases.len();
        if load.has_results {
            finish(&catalog, &fake, leases).await?;
        } else {
            let pairs: Vec<i64> = leases.iter().map(|lease| lease.pair().0).collect();
            let query = sqlx::query(END).bind(pairs).bind(fake.worker.0);
            query.execute(&mut conn).await?;
        }
        finished.pairs += count;
        let left = end.saturating_duration_since(Instant::now());
        finished.last_pairs += if left < LAST_TIME { count } else { 0 };
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
