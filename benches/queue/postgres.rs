//! Times claims and checkpoints on a catalog in PostgreSQL, with several connections.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mocban::catalog::{Catalog, ImportChunk, ImportRow, ImportTerms};
use mocban::domain::PairName;
use tokio::sync::mpsc;

use super::fake::Fake;
use super::options::Options;
use super::world::fingerprints;

/// Connections and pairs per claim.
const LOADS: [(usize, usize); 6] = [(1, 16), (1, 64), (4, 16), (4, 64), (16, 16), (16, 64)];
/// How long each load runs.
const TIME: Duration = Duration::from_secs(5);
/// Rows in one message of the import.
const ROWS: usize = 10_000;

/// Returns a table of pairs per second. A pair is claimed, and its four stages are stored in one commit.
pub(super) async fn table(options: &Options, url: &str) -> anyhow::Result<String> {
    let catalog = Catalog::connect_or_create(url).await?;
    let pairs = options.sizes()[0];
    let begin = Instant::now();
    import(&catalog, pairs).await?;
    let mut table = format!(
        "\nImport of {pairs} pairs: {:.1} s\n\n| connections | pairs a claim | pairs/s | claim p50 / p95 (ms) |\n|---|---|---|---|\n",
        begin.elapsed().as_secs_f64()
    );
    let fake = Fake::without_files(&catalog, &fingerprints(None)?).await?;
    for (connections, batch) in LOADS {
        let mut tasks = tokio::task::JoinSet::new();
        for _ in 0..connections {
            let catalog = Catalog::connect(url).await?;
            let fake = Arc::new(fake.another_worker(&catalog).await?);
            tasks.spawn(load(catalog, fake, batch));
        }
        let (mut done, mut claims) = (0, Vec::new());
        while let Some(ended) = tasks.join_next().await {
            let (pairs, times) = ended??;
            done += pairs;
            claims.extend(times);
        }
        claims.sort();
        let ms = |share: f64| {
            let at = ((claims.len() - 1) as f64 * share) as usize;
            claims[at].as_secs_f64() * 1e3
        };
        writeln!(
            table,
            "| {connections} | {batch} | {:.0} | {:.1} / {:.1} |",
            f64::from(done) / TIME.as_secs_f64(),
            ms(0.5),
            ms(0.95)
        )?;
    }
    let begin = Instant::now();
    catalog.status(&fingerprints(None)?).await?;
    writeln!(
        table,
        "\n`status`: {:.1} ms",
        begin.elapsed().as_secs_f64() * 1e3
    )?;
    catalog.close().await;
    Ok(table)
}

/// Claims and stores pairs on one connection until the time is over. Returns their number and the times of the claims.
async fn load(
    catalog: Catalog,
    fake: Arc<Fake>,
    batch: usize,
) -> anyhow::Result<(u32, Vec<Duration>)> {
    let _waiting = catalog.waiting().await?;
    let begin = Instant::now();
    let (mut done, mut claims) = (0, Vec::new());
    while begin.elapsed() < TIME {
        let claim = Instant::now();
        let leases = catalog.claim(fake.request(batch)).await?;
        claims.push(claim.elapsed());
        anyhow::ensure!(
            leases.len() == batch,
            "no more pairs; give a larger --pairs"
        );
        let stored = leases
            .into_iter()
            .map(|lease| fake.finish_at_once(&catalog, lease));
        for stored in futures_util::future::join_all(stored).await {
            stored?;
            done += 1;
        }
    }
    catalog.end_worker(fake.worker, 2, None).await?;
    catalog.close().await;
    Ok((done, claims))
}

/// Imports pairs.
pub(super) async fn import(catalog: &Catalog, pairs: usize) -> anyhow::Result<()> {
    let (sender, rows) = mpsc::channel(2);
    let send = async move {
        for first in (0..pairs).step_by(ROWS) {
            let rows = (first..pairs.min(first + ROWS)).map(row);
            let rows: Result<Vec<_>, _> = rows.collect();
            sender.send(ImportChunk::Rows(rows?)).await?;
        }
        sender.send(ImportChunk::End).await?;
        anyhow::Ok(())
    };
    let (sent, stored) = tokio::join!(send, catalog.import_all(rows, ImportTerms::default(), 1));
    stored?;
    sent
}

fn row(number: usize) -> anyhow::Result<ImportRow> {
    Ok(ImportRow {
        name: format!("p{number:08}")
            .parse::<PairName>()
            .map_err(anyhow::Error::msg)?,
        mesh_path: "mesh.stl".to_owned(),
        print_path: "print.png".to_owned(),
        unit: None,
        scanned_face_down: None,
        character: None,
        block: None,
        meta: serde_json::Map::new(),
        prior: None,
    })
}
