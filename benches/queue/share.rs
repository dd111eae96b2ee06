//! What catalog and artifacts cost beside the stages, on the built-in dataset.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::catalog::Catalog;
use mocban::config::{Sources, load};
use mocban::runner::{self, RunOptions, Stop};
use mocban::stages::Settings;
use mocban::store::{NewArtifact, Project};

use super::markdown::{Table, number};
use super::options::Options;
use super::process;
use super::spread::Spread;

const NOTE: &str = "\
Medians. Run: pairs of `demo` by the library in this process, from the open catalog to the summary. Without: the same \
stages of the same pairs on as many threads, with the same artifacts, and nothing noted of them; in turns with the run. \
Difference: what the catalog, the queue and the run's loop cost. Cores: time of all cores that the process took. Idle: \
what is left of the run's time when no thread of a stage is at work, its start and its end included. Artifacts: the \
files of the run stored anew one after another by one thread, each synced; a part of both.";

/// What a run took.
#[derive(Debug, Clone, Copy)]
struct Took {
    wall: Duration,
    /// Of all cores together.
    cores: Duration,
}

/// What is measured over the rounds.
#[derive(Debug, Default)]
struct Measured {
    wall: Spread,
    cores: Spread,
}

impl Measured {
    fn add(&mut self, took: Took) {
        self.wall.add(took.wall);
        self.cores.add(took.cores);
    }

    /// Median milliseconds: wall, cores.
    fn medians(&mut self) -> anyhow::Result<[f64; 2]> {
        let medians = [self.wall.median(), self.cores.median()];
        let [Some(wall), Some(cores)] = medians else {
            anyhow::bail!("nothing was measured");
        };
        Ok([wall, cores])
    }
}

/// Milliseconds a pair with a catalog and without one.
pub(super) async fn table(options: &Options, pairs: u64) -> anyhow::Result<String> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let fresh = dir.path().join("fresh");
    let path = fresh.to_str().context("a path that is text")?;
    let number_of = pairs.to_string();
    process::mocban(&["demo", path, "--pairs", &number_of, "--no-run"])?;
    let workers = options.workers.first().copied().unwrap_or(2).max(1);
    let (mut run, mut bare, mut idle) =
        (Measured::default(), Measured::default(), Spread::default());
    for round in 0..options.repeats.max(1) {
        let project = |name: &str| {
            let to = dir.path().join(format!("{name}-{round}"));
            copy(&fresh, &to)?;
            Ok::<_, anyhow::Error>(Project::open(&to)?)
        };
        let (with, rest) = with_catalog(&project("with")?, workers).await?;
        run.add(with);
        idle.add(rest);
        bare.add(without(&project("without")?, workers).await?);
    }
    let artifacts = artifacts_part(&Project::open(&dir.path().join("with-0"))?)?;
    let (run, bare) = (run.medians()?, bare.medians()?);
    let rows = [
        ("run", run.map(Some)),
        ("without a catalog", bare.map(Some)),
        ("difference", [0, 1].map(|of| Some(run[of] - bare[of]))),
        ("idle", [idle.median(), None]),
        ("artifacts", [Some(artifacts.as_secs_f64() * 1e3), None]),
    ];
    let heads = ["part", "workers", "ms a pair", "share", "cores", "share"];
    let mut table = Table::new("Share of a run", &heads);
    for (part, times) in rows {
        let mut cells = vec![part.to_owned(), workers.to_string()];
        for (time, whole) in times.iter().zip(run) {
            cells.push(number(time.map(|time| time / pairs as f64), 3));
            let share = time.map(|time| format!("{:.2} %", 100.0 * time / whole));
            cells.push(share.unwrap_or_default());
        }
        table.push(cells);
    }
    Ok(table.render(NOTE))
}

/// What every run of this program is asked to do.
fn asked(workers: usize) -> anyhow::Result<(Settings, RunOptions)> {
    let loaded = load(&Sources::default())?;
    let options = RunOptions {
        workers,
        memory: runner::free_memory(),
        ..RunOptions::default()
    };
    Ok((loaded.config.stages, options))
}

/// Runs the project: what that took, and for how much of it a core was idle.
async fn with_catalog(project: &Project, workers: usize) -> anyhow::Result<(Took, Duration)> {
    let (settings, options) = asked(workers)?;
    let catalog = Catalog::open(&project.catalog_path()).await?;
    let watch = Watch::start();
    let stop = Stop::new();
    let summary = runner::run(project, &catalog, &settings, &options, &stop, |_| {}).await?;
    let took = watch.stop();
    catalog.close().await;
    anyhow::ensure!(summary.left == 0, "{} pairs left", summary.left);
    let idle = took.wall.saturating_sub(summary.at_work / workers as u32);
    Ok((took, idle))
}

/// Computes the same and files it.
async fn without(project: &Project, workers: usize) -> anyhow::Result<Took> {
    let (settings, options) = asked(workers)?;
    let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
    let mut pages = catalog.result_pages(1000);
    let mut pairs = Vec::new();
    while let Some(page) = pages.next().await? {
        pairs.extend(page.into_iter().map(|pair| pair.facts));
    }
    catalog.close().await;
    let wanted = pairs.len();
    let watch = Watch::start();
    let done = runner::bare(project, &settings, &options, pairs).await;
    let took = watch.stop();
    anyhow::ensure!(done == wanted, "{done} pairs done of {wanted}");
    Ok(took)
}

/// Measures what passes from its start.
struct Watch {
    start: Instant,
    cores: Duration,
}

impl Watch {
    fn start() -> Self {
        Self {
            start: Instant::now(),
            cores: process::time_of_cores(),
        }
    }

    fn stop(self) -> Took {
        Took {
            wall: self.start.elapsed(),
            cores: process::time_of_cores().saturating_sub(self.cores),
        }
    }
}

/// Copies a folder with all that is in it.
fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    for path in files(from)? {
        let to = to.join(path.strip_prefix(from)?);
        std::fs::create_dir_all(to.parent().context("a folder")?)?;
        std::fs::copy(path, to)?;
    }
    Ok(())
}

/// Time to store all artifacts of a project in another one.
fn artifacts_part(project: &Project) -> anyhow::Result<Duration> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let other = Project::create(dir.path())?;
    let mut time = Duration::ZERO;
    for path in files(&project.artifacts_dir())? {
        let bytes = std::fs::read(&path)?;
        let file = NewArtifact::new("file", "bin", bytes);
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
