//! What catalog and artifacts cost beside the stages, on the built-in dataset.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::catalog::Catalog;
use mocban::config::{Preset, Sources, Start, load};
use mocban::runner::{self, RunOptions, Stop};
use mocban::store::{NewArtifact, Project};

use super::markdown::{Table, number};
use super::options::Options;
use super::process;

const NOTE: &str = "\
The run: pairs of `demo`, with as many workers as there are cores, by the library in this process. Idle: what is left of \
the cores' time when no thread of a stage is at work: waits for the catalog, task switches, the start of the run and its \
end, when the last worker has nobody beside it. Its threads: the time that the cores spend on the threads of catalog \
and run loop beside that, a share each. Both together are at most what the run would be faster without a catalog. \
Artifacts: the files of the run stored anew one after another by one thread, each synced, as the workers do it side by \
side; in the run that is part of the stages' time.";

/// Milliseconds a pair of the run and of its durable part.
pub(super) async fn table(options: &Options, pairs: u64) -> anyhow::Result<String> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let path = dir.path().to_str().context("a path that is text")?;
    let number_of = pairs.to_string();
    process::mocban(&["demo", path, "--pairs", &number_of, "--no-run"])?;
    let workers = options.workers.first().copied().unwrap_or(2).max(1);
    let [run, idle, threads] = run(&Project::open(dir.path())?, workers).await?;
    let artifacts = artifacts_part(&Project::open(dir.path())?)? / workers as u32;
    let mut table = Table::new(
        "Share of a run",
        &["part", "workers", "ms a pair", "share of the run"],
    );
    for (part, time) in [
        ("run", run),
        ("idle", idle),
        ("catalog's threads", threads),
        ("artifacts", artifacts),
    ] {
        let share = 100.0 * time.as_secs_f64() / run.as_secs_f64();
        let ms = time.as_secs_f64() * 1e3 / pairs as f64;
        table.push(vec![
            part.to_owned(),
            workers.to_string(),
            number(Some(ms), 3),
            format!("{share:.2} %"),
        ]);
    }
    Ok(table.render(NOTE))
}

/// Runs the project: how long it takes, for how much of that a core is idle, and how much of it goes to threads that
/// are no stage's.
async fn run(project: &Project, workers: usize) -> anyhow::Result<[Duration; 3]> {
    let config = load(&Sources {
        start: Start::Preset(Preset::Default),
        env: Vec::new(),
        sets: Vec::new(),
    })?;
    let options = RunOptions {
        workers,
        ..RunOptions::default()
    };
    let catalog = Catalog::open(&project.catalog_path()).await?;
    let stages = &config.config.stages;
    let (start, before) = (Instant::now(), process::time_of_threads()?);
    let summary = runner::run(project, &catalog, stages, &options, &Stop::new(), |_| {}).await?;
    let (time, after) = (start.elapsed(), process::time_of_threads()?);
    catalog.close().await;
    anyhow::ensure!(summary.left == 0, "{} pairs left", summary.left);
    let idle = time.saturating_sub(summary.at_work / workers as u32);
    Ok([time, idle, after.saturating_sub(before) / workers as u32])
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
