//! apalis-sqlite under the load of `benches/queue`: a task a pair, four durable updates of a small row while it runs.
//!
//! `peers-queue FILE PAIRS WORKERS` makes a database with as many tasks, works them off with as many in hand at a time,
//! and prints the seconds from the first claim to the last acknowledged task. All connections use a write-ahead log
//! and `synchronous=FULL`; `SqliteStorage::setup` would turn syncing off on one of them, so it gets a pool of its own.

use std::str::FromStr as _;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use apalis::layers::WorkerBuilderExt as _;
use apalis::prelude::*;
use apalis_sqlite::{Config, SqliteStorage};
use sqlx::SqlitePool;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};

/// Between two looks whether all tasks are acknowledged.
const LOOK_EVERY: Duration = Duration::from_millis(5);

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, pairs, workers] = args.as_slice() else {
        anyhow::bail!("give a file, a number of pairs and a number of workers");
    };
    let (pairs, workers): (u32, usize) = (pairs.parse()?, workers.parse()?);
    set_up(path, pairs).await?;
    let pool = pool(path, workers as u32 + 4).await?;
    let time = work(&pool, pairs, workers).await?;
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

/// Makes the tables and the tasks, over connections that are closed again.
async fn set_up(path: &str, pairs: u32) -> anyhow::Result<()> {
    let pool = pool(path, 1).await?;
    SqliteStorage::setup(&pool).await?;
    sqlx::query("CREATE TABLE progress (pair INTEGER PRIMARY KEY, stage INTEGER NOT NULL) STRICT")
        .execute(&pool)
        .await?;
    let mut storage = SqliteStorage::new(&pool).with_config(Config::default().queue("pairs"));
    let mut tasks = futures::stream::iter((0..pairs).map(|pair| TaskBuilder::new(pair).build()));
    storage.push_all(&mut tasks).await.context("the tasks")?;
    sqlx::query("WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i + 1 < ?1) INSERT INTO progress SELECT i, 0 FROM n")
        .bind(pairs)
        .execute(&pool)
        .await?;
    pool.close().await;
    Ok(())
}

/// A pair: four stages that compute nothing, each stored before the next.
async fn pair(pair: u32, pool: Data<SqlitePool>) -> Result<(), BoxDynError> {
    for stage in 1..=4 {
        sqlx::query("UPDATE progress SET stage = ?2 WHERE pair = ?1")
            .bind(pair)
            .bind(stage)
            .execute(&*pool)
            .await?;
    }
    Ok(())
}

async fn work(pool: &SqlitePool, pairs: u32, workers: usize) -> anyhow::Result<Duration> {
    let config = Config::default()
        .queue("pairs")
        .batch_size(workers.max(10))
        .heartbeat_interval(Duration::from_secs(1));
    let storage = SqliteStorage::new(pool).with_config(config);
    let start = Instant::now();
    let worker = WorkerBuilder::new("bench")
        .backend(storage)
        .concurrency(workers)
        .data(pool.clone())
        .build(pair);
    let running = tokio::spawn(async move { worker.run().await });
    let mut left = i64::from(pairs);
    while left > 0 {
        anyhow::ensure!(
            !running.is_finished(),
            "the worker stopped with {left} left"
        );
        tokio::time::sleep(LOOK_EVERY).await;
        let done: i64 = sqlx::query_scalar("SELECT count(*) FROM Jobs WHERE status = 'Done'")
            .fetch_one(pool)
            .await?;
        left = i64::from(pairs) - done;
    }
    Ok(start.elapsed())
}
