//! Measures the time that the catalog and the artifacts add to the time of the stages, on pairs of the demo.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use mocban::catalog::Catalog;
use mocban::config::{Sources, load};
use mocban::runner::{self, RunOptions, Stop};
use mocban::stages::Settings;
use mocban::store::{NewArtifact, Project};

use super::baseline::run_without_catalog;
use super::markdown::{Table, number};
use super::options::Options;
use super::process;
use super::spread::Spread;

const NOTE: &str = "\
Medians. Run: pairs of `demo` in this process, from the open catalog to the summary. Without: the same stages of the \
same pairs on as many threads with the same artifacts, but no catalog; the two alternate. Cores: CPU time of all threads. \
Beside stages: the time in which no thread computes a stage, start and end included, and the CPU time of threads that \
compute no stage: they write files and, in a run, work for catalog and queue. Differences are medians of the differences \
of each round; only the difference of the whole includes changes of the machine's speed between the two. Artifacts: the \
files of the run, written again one after another by one thread, each synced; both include them.";

/// Milliseconds of a run: wall-clock time and CPU time.
#[derive(Debug, Clone, Copy)]
struct RunTimes {
    whole: [f64; 2],
    /// While no thread computed a stage; by threads that compute no stage.
    beside: [f64; 2],
}

/// Measurements over the rounds: wall-clock time and CPU time.
#[derive(Debug, Default)]
struct Measured([Spread; 2]);

impl Measured {
    fn push(&mut self, ms: [f64; 2]) {
        for (spread, ms) in self.0.iter_mut().zip(ms) {
            spread.push(ms);
        }
    }

    fn medians(&mut self) -> [Option<f64>; 2] {
        self.0.each_mut().map(Spread::median)
    }
}

/// Returns a table of milliseconds per pair with and without a catalog.
pub(super) async fn table(options: &Options, pairs: u64) -> anyhow::Result<String> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let fresh = dir.path().join("fresh");
    let path = fresh.to_str().context("a path in UTF-8")?;
    let number_of = pairs.to_string();
    process::mocban(&["demo", path, "--pairs", &number_of, "--no-run"])?;
    let workers = options.workers.first().copied().unwrap_or(2).max(1);
    let mut parts = PARTS.map(|part| (part, Measured::default()));
    let mut artifacts = Spread::default();
    for round in 0..options.repeats.max(1) {
        let project = |name: &str| {
            let to = dir.path().join(format!("{name}-{round}"));
            copy(&fresh, &to)?;
            Ok::<_, anyhow::Error>(Project::open(&to)?)
        };
        let (with, without) = (project("with")?, project("without")?);
        let (run, bare) = if round % 2 == 0 {
            let run = with_catalog(&with, workers).await?;
            (run, self::without(&without, workers).await?)
        } else {
            let bare = self::without(&without, workers).await?;
            (with_catalog(&with, workers).await?, bare)
        };
        let less = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let measured = [
            run.whole,
            bare.whole,
            less(run.whole, bare.whole),
            run.beside,
            bare.beside,
            less(run.beside, bare.beside),
        ];
        for ((_, part), ms) in parts.iter_mut().zip(measured) {
            part.push(ms);
        }
        if round == 0 {
            artifacts.add(artifacts_part(&with)?);
        }
        for project in [&with, &without] {
            std::fs::remove_dir_all(project.dir())?;
        }
    }
    let mut rows: Vec<_> = parts
        .iter_mut()
        .map(|(part, measured)| (*part, measured.medians()))
        .collect();
    rows.push(("artifacts", [artifacts.median(), None]));
    let whole = rows[0].1;
    let heads = ["part", "workers", "ms a pair", "share", "cores", "share"];
    let mut table = Table::new("Share of a run", &heads);
    for (part, times) in rows {
        let mut cells = vec![part.to_owned(), workers.to_string()];
        for (time, whole) in times.into_iter().zip(whole) {
            cells.push(number(time.map(|time| time / pairs as f64), 3));
            let share = time.zip(whole).map(|(time, whole)| 100.0 * time / whole);
            cells.push(share.map_or_else(String::new, |share| format!("{share:.2} %")));
        }
        table.push(cells);
    }
    Ok(table.render(NOTE))
}

/// Rows of the table except the last.
const PARTS: [&str; 6] = [
    "run",
    "without a catalog",
    "difference",
    "run, beside stages",
    "without, beside stages",
    "difference beside stages",
];

/// Returns settings and options of all runs.
fn run_options(workers: usize) -> anyhow::Result<(Settings, RunOptions)> {
    let loaded = load(&Sources::default())?;
    let options = RunOptions {
        workers,
        memory: runner::default_memory_limit(),
        ..RunOptions::default()
    };
    Ok((loaded.config.stages, options))
}

/// Runs the project.
async fn with_catalog(project: &Project, workers: usize) -> anyhow::Result<RunTimes> {
    let (settings, options) = run_options(workers)?;
    let catalog = Catalog::open(&project.catalog_path()).await?;
    let watch = Watch::start()?;
    let stop = Stop::new();
    let summary = runner::run(project, &catalog, &settings, &options, &stop, |_| {}).await?;
    let times = watch.stop(summary.compute_time / workers as u32)?;
    catalog.close().await;
    anyhow::ensure!(summary.left == 0, "{} pairs left", summary.left);
    Ok(times)
}

/// Computes the same stages without a catalog.
async fn without(project: &Project, workers: usize) -> anyhow::Result<RunTimes> {
    let (settings, options) = run_options(workers)?;
    let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
    let mut pages = catalog.result_pages(1000);
    let mut pairs = Vec::new();
    while let Some(page) = pages.next().await? {
        pairs.extend(page.into_iter().map(|pair| pair.attributes));
    }
    catalog.close().await;
    let watch = Watch::start()?;
    let compute_time = run_without_catalog(project, &settings, &options, pairs).await?;
    watch.stop(compute_time / workers as u32)
}

/// A stopwatch for wall-clock and CPU time.
struct Watch {
    start: Instant,
    cores: Duration,
    threads: BTreeMap<OsString, u64>,
}

impl Watch {
    fn start() -> anyhow::Result<Self> {
        Ok(Self {
            threads: process::thread_cpu_times()?,
            cores: process::cpu_time(),
            start: Instant::now(),
        })
    }

    /// Stops the measurement. All compute threads must have ended. `compute_time` is their mean computing time.
    fn stop(self, compute_time: Duration) -> anyhow::Result<RunTimes> {
        let (wall, cores) = (self.start.elapsed(), process::cpu_time());
        let threads = process::thread_cpu_times()?.into_iter();
        let since = |(thread, time)| time - self.threads.get(&thread).copied().unwrap_or(0);
        let beside: u64 = threads.map(since).sum();
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        Ok(RunTimes {
            whole: [ms(wall), ms(cores.saturating_sub(self.cores))],
            beside: [ms(wall) - ms(compute_time), beside as f64 / 1e6],
        })
    }
}

/// Copies a folder with its content.
fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    for path in files(from)? {
        let to = to.join(path.strip_prefix(from)?);
        std::fs::create_dir_all(to.parent().context("a folder")?)?;
        std::fs::copy(path, to)?;
    }
    Ok(())
}

/// Returns the time to write all artifacts of a project to another one.
fn artifacts_part(project: &Project) -> anyhow::Result<Duration> {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let other = Project::create(dir.path())?;
    let mut time = Duration::ZERO;
    for path in files(&project.artifacts_dir())? {
        let bytes = std::fs::read(&path)?;
        let file = NewArtifact::new("file", "bin", bytes);
        let start = Instant::now();
        other.write_artifacts(&[file], &|| {})?;
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
