//! What catalog and artifacts cost beside the stages, on the built-in dataset.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::store::{NewArtifact, Project};

use super::markdown::{Table, number};
use super::options::Options;
use super::process;
use super::world::{World, work};

const NOTE: &str = "\
The run: `run` as a process on pairs of `demo`, with as many workers as there are cores. Catalog: as many pairs with \
as many workers and stages that compute nothing. Artifacts: the files of the run stored anew one after another by one \
thread, each synced, as the workers do it side by side.";
/// Times the catalog's part is measured, to have more than a few pairs.
const ENOUGH: u64 = 1_000;

/// Milliseconds a pair of the run and of its durable part.
pub(super) async fn table(options: &Options, pairs: u64) -> anyhow::Result<String> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let path = dir.path().to_str().context("a path that is text")?;
    let number_of = pairs.to_string();
    process::mocban(&["demo", path, "--pairs", &number_of, "--no-run"])?;
    let workers = options.workers.first().copied().unwrap_or(2);
    let jobs = workers.to_string();
    let run = process::mocban(&["-C", path, "run", "--jobs", &jobs])?.time / pairs as u32;
    let catalog = catalog_part(workers).await?;
    let artifacts = artifacts_part(&Project::open(dir.path())?)? / pairs as u32;
    let artifacts = artifacts / workers.max(1) as u32;
    let mut table = Table::new(
        "Share of a run",
        &["part", "workers", "ms a pair", "share of the run"],
    );
    for (part, time) in [("run", run), ("catalog", catalog), ("artifacts", artifacts)] {
        let share = 100.0 * time.as_secs_f64() / run.as_secs_f64();
        table.push(vec![
            part.to_owned(),
            jobs.clone(),
            number(Some(time.as_secs_f64() * 1e3), 3),
            format!("{share:.2} %"),
        ]);
    }
    Ok(table.render(NOTE))
}

/// The catalog's time a pair.
async fn catalog_part(workers: usize) -> anyhow::Result<Duration> {
    let (world, _) = World::import(ENOUGH as usize)?;
    let catalog = world.catalog().await?;
    let time = work(&world, &catalog, ENOUGH as usize, workers).await?;
    catalog.close().await;
    Ok(time / ENOUGH as u32)
}

/// Time to store all artifacts of a project in another one.
fn artifacts_part(project: &Project) -> anyhow::Result<Duration> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let other = Project::create(dir.path())?;
    let mut time = Duration::ZERO;
    for path in files(&project.artifacts_dir())? {
        let bytes = std::fs::read(&path)?;
        let file = NewArtifact {
            role: "file".to_owned(),
            ext: "bin",
            bytes,
        };
        let start = Instant::now();
        other.write_artifacts(&[file])?;
        time += start.elapsed();
    }
    Ok(time)
}

fn files(dir: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else {
            found.push(path);
        }
    }
    Ok(found)
}
