//! Compares the queue with others, which take turns within one run.

use std::process::Command;
use std::time::Duration;

use anyhow::Context as _;
use mocban::catalog::Catalog;

use super::fake::Fake;
use super::loops;
use super::markdown::{Table, number};
use super::options::Options;
use super::process;
use super::spread::Spread;
use super::world::{World, fingerprints, work};

const NOTE: &str = "\
Medians. A pair is one claim and four checkpoints, each durable before the next one; all queues use a write-ahead log \
and synchronous=FULL on every connection. mocban claims for all free slots at once, as a run does. single rows: the \
same rows in the same schema, but one transaction per claim and checkpoint and one statement per row, with one \
connection per worker. apalis-sqlite stores no results: either one task per stage, each acknowledged, in any order, or \
one task per pair and four updates of one small row. plain: its default configuration and pool; tuned: it fetches tasks \
and opens connections for all pairs in progress. All tasks exist from the start. Sometimes apalis-sqlite fetches nothing \
until its heartbeat after 30 s, as it would for its users; its time includes this.";

/// A queue to compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Queue {
    Mocban,
    SingleRows,
    /// apalis-sqlite with its load and configuration.
    Peer(&'static str, &'static str),
}

impl Queue {
    const PEERS: [Self; 4] = [
        Self::Peer("stages", "plain"),
        Self::Peer("stages", "tuned"),
        Self::Peer("updates", "plain"),
        Self::Peer("updates", "tuned"),
    ];

    fn name(self) -> String {
        match self {
            Self::Mocban => "mocban".to_owned(),
            Self::SingleRows => "single rows".to_owned(),
            Self::Peer(load, configuration) => format!("apalis-sqlite, {load}, {configuration}"),
        }
    }
}

/// Returns a table with a row for each queue and number of workers.
pub(super) async fn table(options: &Options) -> anyhow::Result<String> {
    let heads = [
        "workers",
        "queue",
        "pairs",
        "pairs/s",
        "jobs/s",
        "mocban is",
    ];
    let mut table = Table::new("Queues", &heads);
    let mut queues = vec![Queue::Mocban];
    if !options.ours {
        queues.push(Queue::SingleRows);
    }
    if options.peer.is_some() {
        queues.extend(Queue::PEERS);
    }
    for workers in &options.workers {
        let times = times(options, &queues, *workers).await?;
        let mocban = times[0];
        for (queue, ms) in queues.iter().zip(times) {
            let rate = options.queue_pairs() as f64 * 1e3 / ms;
            table.push(vec![
                workers.to_string(),
                queue.name(),
                options.queue_pairs().to_string(),
                number(Some(rate), 0),
                number(Some(rate * 4.0), 0),
                format!("{:.1} times", ms / mocban),
            ]);
        }
    }
    Ok(table.render(NOTE))
}

/// Returns the median milliseconds of each queue.
async fn times(options: &Options, queues: &[Queue], workers: usize) -> anyhow::Result<Vec<f64>> {
    let mut spreads: Vec<_> = queues.iter().map(|_| Spread::default()).collect();
    for _ in 0..options.repeats.max(1) {
        for (queue, spread) in queues.iter().zip(&mut spreads) {
            spread.add(time(options, *queue, workers).await?);
        }
    }
    let medians = spreads.iter_mut().map(Spread::median);
    let medians: Option<Vec<_>> = medians.collect();
    medians.context("nothing was measured")
}

async fn time(options: &Options, queue: Queue, workers: usize) -> anyhow::Result<Duration> {
    let pairs = options.queue_pairs();
    match queue {
        Queue::Mocban => {
            let (world, _) = World::import(pairs)?;
            let catalog = world.catalog().await?;
            let time = work(&world, &catalog, pairs, workers).await?;
            catalog.close().await;
            Ok(time)
        }
        Queue::SingleRows => {
            let (world, _) = World::import(pairs)?;
            let path = world.project.catalog_path();
            let catalog = Catalog::open(&path).await?;
            let fake = Fake::register(&world.project, &catalog, &fingerprints(None)?).await?;
            catalog.close().await;
            loops::work(&path, &fake, pairs, workers).await
        }
        Queue::Peer(load, configuration) => peer(options, pairs, workers, [load, configuration]),
    }
}

/// Runs the other program, which prints how many seconds its queue took.
fn peer(
    options: &Options,
    pairs: usize,
    workers: usize,
    arguments: [&str; 2],
) -> anyhow::Result<Duration> {
    let program = options.peer.as_ref().context("--peer is missing")?;
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let mut command = Command::new(program);
    command.arg(dir.path().join("queue.sqlite"));
    command.args([pairs.to_string(), workers.to_string()]);
    command.args(arguments);
    let printed = process::run(&mut command)?.stdout;
    Ok(Duration::from_secs_f64(printed.trim().parse()?))
}
