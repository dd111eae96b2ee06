//! Counts and times of a run: for the worker's row in the catalog, and in the text format of Prometheus.

use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use prometheus_client::encoding::prometheus_text;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};

use mocban_core::domain::{ComputeTimes, Stage, WaitReason, WorkerMetrics};
use mocban_system::platform;

/// Version of this program.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Upper bounds of the histogram's buckets in seconds. A stage of a usual pair takes 1 to 100 ms.
const STAGE_BUCKETS: [f64; 15] = [
    0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 60.0, 300.0,
];

/// A label with its value.
type Label = [(&'static str, &'static str); 1];
type Seconds = Counter<f64, AtomicU64>;

/// Counts and times of a run. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct RunMetrics(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    registry: Registry,
    done: Counter,
    failed: Counter,
    stage_seconds: Family<Label, Histogram, fn() -> Histogram>,
    /// The count and microseconds of each stage, because a histogram cannot be read.
    stage_totals: [(AtomicU64, AtomicU64); Stage::COUNT],
    wait_seconds: Family<Label, Seconds>,
    jobs: Gauge,
    leased: Gauge,
    memory: Gauge,
    peak_memory: Gauge,
    /// Pairs whose stages are being committed.
    commits: AtomicU64,
}

impl Default for Shared {
    fn default() -> Self {
        let mut shared = Self {
            registry: Registry::default(),
            done: Counter::default(),
            failed: Counter::default(),
            stage_seconds: Family::new_with_constructor(|| Histogram::new(STAGE_BUCKETS)),
            stage_totals: Default::default(),
            wait_seconds: Family::default(),
            jobs: Gauge::default(),
            leased: Gauge::default(),
            memory: Gauge::default(),
            peak_memory: Gauge::default(),
            commits: AtomicU64::new(0),
        };
        // Show series without observations too.
        for stage in Stage::ALL {
            drop(
                shared
                    .stage_seconds
                    .get_or_create(&[("stage", stage.name())]),
            );
        }
        for reason in WaitReason::ALL {
            drop(shared.wait_seconds.get_or_create(&[("for", reason.name())]));
        }
        shared.register();
        shared
    }
}

impl Shared {
    /// Registers the metrics with their names. The encoder appends the unit, and `_total` to counters.
    fn register(&mut self) {
        let run = self.registry.sub_registry_with_prefix("mocban");
        let build = Info::new([("version", VERSION)]);
        run.register("build", "Version of the program", build);
        let done = "Pairs that this process finished";
        run.register("pairs_done", done, self.done.clone());
        let failed = "Pairs that this process quarantined";
        run.register("pairs_failed", failed, self.failed.clone());
        let leased = "Pairs that this process has leased";
        run.register("pairs_leased", leased, self.leased.clone());
        let jobs = "Pairs that this process processes at the same time";
        run.register("jobs", jobs, self.jobs.clone());
        let stage = ("stage_duration", "Computing time of a stage of a pair");
        run.register_with_unit(stage.0, stage.1, Unit::Seconds, self.stage_seconds.clone());
        let wait = ("wait", "Time that jobs waited, all jobs together");
        run.register_with_unit(wait.0, wait.1, Unit::Seconds, self.wait_seconds.clone());
        let process = self.registry.sub_registry_with_prefix("process");
        for (name, help, gauge) in [
            ("resident_memory", "Memory of the process", &self.memory),
            (
                "resident_memory_peak",
                "Largest memory of the process so far",
                &self.peak_memory,
            ),
        ] {
            process.register_with_unit(name, help, Unit::Bytes, gauge.clone());
        }
    }
}

impl RunMetrics {
    /// Sets how many pairs are processed at the same time.
    pub(super) fn set_jobs(&self, jobs: usize) {
        self.0.jobs.set(jobs as i64);
    }

    /// Sets how many pairs are leased.
    pub(super) fn set_leased(&self, leased: usize) {
        self.0.leased.set(leased as i64);
    }

    pub(super) fn count_done(&self) {
        self.0.done.inc();
    }

    pub(super) fn count_failed(&self) {
        self.0.failed.inc();
    }

    /// Adds the computing time of a stage.
    pub(super) fn add_stage(&self, stage: Stage, elapsed: Duration) {
        let seconds = &self.0.stage_seconds;
        let histogram = seconds.get_or_create(&[("stage", stage.name())]);
        histogram.observe(elapsed.as_secs_f64());
        let (count, us) = &self.0.stage_totals[stage.index()];
        count.fetch_add(1, Ordering::Relaxed);
        us.fetch_add(elapsed.as_micros() as u64, Ordering::Relaxed);
    }

    /// Adds the time that one job waited.
    pub(super) fn add_wait(&self, reason: WaitReason, elapsed: Duration) {
        let seconds = self.0.wait_seconds.get_or_create(&[("for", reason.name())]);
        seconds.inc_by(elapsed.as_secs_f64());
    }

    /// Calls a function that blocks one job, and adds its time.
    pub(super) fn waiting<T>(&self, reason: WaitReason, call: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let returned = call();
        self.add_wait(reason, begun.elapsed());
        returned
    }

    /// Notes that a commit of a pair's stages begins.
    pub(super) fn begin_commit(&self) {
        self.0.commits.fetch_add(1, Ordering::Relaxed);
    }

    /// Notes that a commit of a pair's stages has ended.
    pub(super) fn end_commit(&self) {
        self.0.commits.fetch_sub(1, Ordering::Relaxed);
    }

    /// Returns the number of pairs whose stages are being committed.
    pub(super) fn commits(&self) -> u64 {
        self.0.commits.load(Ordering::Relaxed)
    }

    /// Returns the counts and times for the catalog.
    pub(super) fn snapshot(&self, elapsed_ms: u64, stopping: bool) -> WorkerMetrics {
        let stages = Stage::ALL.map(|stage| {
            let (count, us) = &self.0.stage_totals[stage.index()];
            let times = ComputeTimes {
                count: count.load(Ordering::Relaxed),
                ms: us.load(Ordering::Relaxed) / 1000,
            };
            (stage, times)
        });
        let wait_ms = WaitReason::ALL.map(|reason| {
            let seconds = self.0.wait_seconds.get_or_create(&[("for", reason.name())]);
            (reason, (seconds.get() * 1e3) as u64)
        });
        WorkerMetrics {
            version: VERSION.to_owned(),
            jobs: self.0.jobs.get().unsigned_abs(),
            elapsed_ms,
            done: self.0.done.get(),
            failed: self.0.failed.get(),
            stages: stages.into(),
            wait_ms: wait_ms.into(),
            peak_memory_bytes: platform::process_memory().map(|memory| memory.peak),
            stopping,
        }
    }

    /// Returns all metrics in the text format of Prometheus (version 0.0.4).
    pub fn prometheus_text(&self) -> String {
        if let Some(memory) = platform::process_memory() {
            self.0.memory.set(memory.resident as i64);
            self.0.peak_memory.set(memory.peak as i64);
        }
        let mut text = String::new();
        // Writing to a string never fails.
        let _ = prometheus_text::encode(&mut text, &self.0.registry);
        text
    }
}

/// A source that adds up the time of its reads.
#[derive(Debug)]
pub(super) struct TimedRead<'s, S> {
    source: &'s mut S,
    /// Total time of all reads.
    pub(super) elapsed: Duration,
}

impl<'s, S> TimedRead<'s, S> {
    pub(super) const fn new(source: &'s mut S) -> Self {
        Self {
            source,
            elapsed: Duration::ZERO,
        }
    }
}

impl<S: Read> Read for TimedRead<'_, S> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let begun = Instant::now();
        let count = self.source.read(into);
        self.elapsed += begun.elapsed();
        count
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;
    use std::time::Duration;

    use super::{RunMetrics, TimedRead};
    use mocban_core::domain::{ComputeTimes, Stage, WaitReason};

    /// Returns metrics of a run with known counts and times.
    fn known() -> RunMetrics {
        let metrics = RunMetrics::default();
        metrics.set_jobs(8);
        metrics.set_leased(11);
        metrics.count_done();
        metrics.count_done();
        metrics.count_failed();
        for ms in [4, 30, 61_000] {
            metrics.add_stage(Stage::Fit, Duration::from_millis(ms));
        }
        metrics.add_wait(WaitReason::Database, Duration::from_millis(250));
        metrics.add_wait(WaitReason::Database, Duration::from_millis(500));
        metrics
    }

    #[test]
    fn prometheus_text_has_every_metric_with_type_and_unit() {
        let text = known().prometheus_text();
        let mut lines: Vec<_> = text
            .lines()
            .filter(|line| !line.starts_with("process_") && !line.contains("stage=\"depth\""))
            .filter(|line| !line.contains("stage=\"normalize\"") && !line.contains("register"))
            .collect();
        // The order of series with different labels varies.
        lines.sort_unstable();
        insta::assert_snapshot!(lines.join("\n"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_memory_is_that_of_this_process() {
        let text = RunMetrics::default().prometheus_text();
        let value = |name: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|value| value.trim().parse::<u64>().ok())
        };
        let resident = value("process_resident_memory_bytes ").expect("a number");
        let peak = value("process_resident_memory_peak_bytes ").expect("a number");
        assert!(resident > 1 << 20 && peak >= resident, "{text}");
    }

    #[test]
    fn the_snapshot_has_the_same_counts_and_times() {
        let snapshot = known().snapshot(9000, true);
        let counts = (snapshot.jobs, snapshot.done, snapshot.failed);
        assert_eq!(counts, (8, 2, 1));
        let fit = ComputeTimes {
            count: 3,
            ms: 61_034,
        };
        assert_eq!(snapshot.stages[&Stage::Fit], fit);
        assert_eq!(snapshot.stages[&Stage::Register], ComputeTimes::default());
        assert_eq!(snapshot.wait_ms[&WaitReason::Database], 750);
        assert_eq!(snapshot.wait_ms[&WaitReason::Inputs], 0);
        assert!(snapshot.stopping && snapshot.elapsed_ms == 9000);
        let json = serde_json::to_string(&snapshot).expect("JSON");
        assert_eq!(serde_json::from_str(&json).ok(), Some(snapshot));
    }

    #[test]
    fn clones_share_their_counts() {
        let metrics = RunMetrics::default();
        metrics.clone().count_done();
        assert_eq!(metrics.snapshot(0, false).done, 1);
    }

    #[test]
    fn the_time_of_reads_is_added_up() {
        let mut source: &[u8] = b"solid";
        let mut timed = TimedRead::new(&mut source);
        let mut text = String::new();
        timed.read_to_string(&mut text).expect("bytes in memory");
        assert_eq!(text, "solid");
        assert!(timed.elapsed > Duration::ZERO);
    }
}
