//! Runs apalis-sqlite under the load of `benches/queue`, in four ways.
//!
//! `peers-queue FILE PAIRS WORKERS LOAD SET-UP` creates a database with the tasks and runs them, WORKERS at a time. It
//! prints the seconds from the first claim to the last acknowledged task.
//!
//! - LOAD `stages`: four tasks per pair, one per stage, each acknowledged separately. The order of the stages is not
//!   enforced, and no result is stored. LOAD `updates`: one task per pair, and four committed updates of one small row
//!   while the task runs.
//! - SET-UP `plain`: the default configuration and a default pool. SET-UP `tuned`: larger batches of fetched tasks, and
//!   at least one connection per worker.
//!
//! All connections use a write-ahead log and `synchronous=FULL`. `SqliteStorage::setup` would turn syncing off on its
//! connection, so a separate pool is used for it. All tasks exist from the start.

mod load;

use std::str::FromStr as _;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use apalis::layers::WorkerBuilderExt as _;
use apalis::prelude::*;
use apalis_sqlite::{Config, SqliteStorage};
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};

use load::Load;

/// Time between two checks whether all tasks are acknowledged.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Connections of a default pool.
const PLAIN_CONNECTIONS: u32 = 10;

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, pairs, workers, load, set_up] = args.as_slice() else {
        anyhow::bail!("give a file, a number of pairs, a number of workers, a load and a set-up");
    };
    let (pairs, workers): (u32, usize) = (pairs.parse()?, workers.parse()?);
    let load = Load::named(load).context("a load is `stages` or `updates`")?;
    let (config, connections) = match set_up.as_str() {
        "plain" => (Config::default(), PLAIN_CONNECTIONS),
        "tuned" => (
            Config::default().batch_size(2 * workers.max(32)),
            workers as u32 + 4,
        ),
        _ => anyhow::bail!("a set-up is `plain` or `tuned`"),
    };
    let config = config.queue("pairs");
    fill(path, pairs, load, &config).await?;
    let pool = pool(path, connections).await?;
    let time = work(&pool, load.tasks(pairs), workers, load, config).await?;
    println!("{}", time.as_secs_f64());
    Ok(())
}

async fn pool(path: &str, connections: u32) -> anyhow::Result<SqlitePool> {
    let options = SqliteConnectOptions::from_str(path)?
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .busy_timeout(Duration::from_secs(300));
    let pool = SqlitePoolOptions::new().max_connections(connections);
    Ok(pool.connect_with(options).await?)
}

/// Creates the tables and the tasks. Closes its connections afterwards.
async fn fill(path: &str, pairs: u32, load: Load, config: &Config) -> anyhow::Result<()> {
    let pool = pool(path, 1).await?;
    SqliteStorage::setup(&pool).await?;
    load.prepare(&pool, pairs).await?;
    let mut storage = SqliteStorage::new(&pool).with_config(config.clone());
    let tasks = (0..load.tasks(pairs)).map(|task| TaskBuilder::new(task).build());
    let mut tasks = futures::stream::iter(tasks);
    storage.push_all(&mut tasks).await.context("the tasks")?;
    pool.close().await;
    Ok(())
}

async fn task(task: u32, pool: Data<SqlitePool>, load: Data<Load>) -> Result<(), BoxDynError> {
    Ok(load.work(&pool, task).await?)
}

async fn work(
    pool: &SqlitePool,
    tasks: u32,
    workers: usize,
    load: Load,
    config: Config,
) -> anyhow::Result<Duration> {
    let storage = SqliteStorage::new(pool).with_config(config);
    let start = Instant::now();
    let worker = WorkerBuilder::new("bench")
        .backend(storage)
        .concurrency(workers)
        .data(pool.clone())
        .data(load)
        .build(task);
    let running = tokio::spawn(async move { worker.run().await });
    let mut left = i64::from(tasks);
    while left > 0 {
        anyhow::ensure!(
            !running.is_finished(),
            "the worker stopped with {left} left"
        );
        tokio::time::sleep(LOOK_EVERY).await;
        let done: i64 = sqlx::query_scalar("SELECT count(*) FROM Jobs WHERE status = 'Done'")
            .fetch_one(pool)
            .await?;
        left = i64::from(tasks) - done;
    }
    Ok(start.elapsed())
}
