//! Our queue beside others, in turns within one run.

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
Medians. A pair: one claim and four checkpoints, each durable before the next; all with a write-ahead log and \
synchronous=FULL on every connection. mocban asks as a run does, for all free slots at once. single rows: the same \
rows in the same schema, but a transaction and a statement for each, by workers with connections of their own. \
apalis-sqlite stores no results: a task a stage, each acknowledged, in no order; or a task a pair and four updates of \
one small row. plain: its configuration and pool as they come, tuned: tasks fetched and connections for all that are \
in hand. All tasks are there from the start; now and then \
apalis-sqlite fetches nothing until its heartbeat after 30 s, as it would for its users, and that is in its time.";

/// A queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ReviewOrder {
    Ours,
    Rows,
    /// The other program with its load and set-up.
    Peer(&'static str, &'static str),
}

impl ReviewOrder {
    const PEERS: [Self; 4] = [
        Self::Peer("stages", "plain"),
        Self::Peer("stages", "tuned"),
        Self::Peer("updates", "plain"),
        Self::Peer("updates", "tuned"),
    ];

    fn name(self) -> String {
        match self {
            Self::Ours => "mocban".to_owned(),
            Self::Rows => "single rows".to_owned(),
            Self::Peer(load, set_up) => format!("apalis-sqlite, {load}, {set_up}"),
        }
    }
}

/// A row for each queue and number of workers.
pub(super) async fn table(options: &Options) -> anyhow::Result<String> {
    let heads = ["workers", "queue", "pairs", "pairs/s", "jobs/s", "ours is"];
    let mut table = Table::new("Queues", &heads);
    let mut queues = vec![ReviewOrder::Ours];
    if !options.ours {
        queues.push(ReviewOrder::Rows);
    }
    if options.peer.is_some() {
        queues.extend(ReviewOrder::PEERS);
    }
    for workers in &options.workers {
        let times = times(options, &queues, *workers).await?;
        let ours = times[0];
        for (queue, ms) in queues.iter().zip(times) {
            let rate = options.queue_pairs() as f64 * 1e3 / ms;
            table.push(vec![
                workers.to_string(),
                queue.name(),
                options.queue_pairs().to_string(),
                number(Some(rate), 0),
                number(Some(rate * 4.0), 0),
                format!("{:.1} times", ms / ours),
            ]);
        }
    }
    Ok(table.render(NOTE))
}

/// Median milliseconds of each queue.
async fn times(
    options: &Options,
    queues: &[ReviewOrder],
    workers: usize,
) -> anyhow::Result<Vec<f64>> {
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

async fn time(options: &Options, queue: ReviewOrder, workers: usize) -> anyhow::Result<Duration> {
    let pairs = options.queue_pairs();
    match queue {
        ReviewOrder::Ours => {
            let (world, _) = World::import(pairs)?;
            let catalog = world.catalog().await?;
            let time = work(&world, &catalog, pairs, workers).await?;
            catalog.close().await;
            Ok(time)
        }
        ReviewOrder::Rows => {
            let (world, _) = World::import(pairs)?;
            let path = world.project.catalog_path();
            let catalog = Catalog::open(&path).await?;
            let fake = Fake::enter(&world.project, &catalog, &fingerprints(None)?).await?;
            catalog.close().await;
            loops::work(&path, &fake, pairs, workers).await
        }
        ReviewOrder::Peer(load, set_up) => peer(options, pairs, workers, [load, set_up]),
    }
}

/// Runs the other program, which says how many seconds its queue took.
fn peer(
    options: &Options,
    pairs: usize,
    workers: usize,
    how: [&str; 2],
) -> anyhow::Result<Duration> {
    let program = options.peer.as_ref().context("no other program is given")?;
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let mut command = Command::new(program);
    command.arg(dir.path().join("queue.sqlite"));
    command.args([pairs.to_string(), workers.to_string()]);
    command.args(how);
    let said = process::run(&mut command)?.stdout;
    Ok(Duration::from_secs_f64(said.trim().parse()?))
}
