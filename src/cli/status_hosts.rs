//! `status --hosts`: the workers of each machine, with what they have done and what they wait for.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::screen::{Palette, Tone};
use super::table::{columns, count};
use super::time_text::rough_duration;
use crate::catalog::{Catalog, WorkerRecord, WorkerState};
use crate::domain::{ComputeTimes, Stage, UnixMillis, WaitReason, WorkerMetrics};

/// Workers without a heartbeat for longer are not shown, in milliseconds.
const SHOWN_MS: i64 = 24 * 3_600_000;

/// The workers of one day.
pub(super) struct WorkerTable {
    now: UnixMillis,
    hosts: BTreeMap<String, Vec<WorkerRecord>>,
}

/// Reads the workers that had a heartbeat within a day.
pub(super) async fn read(catalog: &Catalog, now: UnixMillis) -> anyhow::Result<WorkerTable> {
    let workers = catalog.workers(now - SHOWN_MS).await?;
    Ok(WorkerTable::new(workers, now))
}

/// Sums over one or more workers.
#[derive(Debug, Default)]
struct Totals {
    jobs: u64,
    leased: u64,
    done: u64,
    failed: u64,
    stages: BTreeMap<Stage, ComputeTimes>,
    wait_ms: BTreeMap<WaitReason, u64>,
    /// Time that all jobs had in milliseconds.
    job_ms: u64,
    peak_memory_bytes: Option<u64>,
}

impl Totals {
    /// Sums up the workers. Jobs and memory are those of the workers that are present.
    fn of<'w>(workers: impl IntoIterator<Item = &'w WorkerRecord>, now: UnixMillis) -> Self {
        let mut totals = Self::default();
        for worker in workers {
            totals.leased += worker.leased;
            if let Some(metrics) = &worker.metrics {
                totals.add(metrics);
                if is_present(worker.state(now)) {
                    totals.occupy(metrics);
                }
            }
        }
        totals
    }

    /// Returns the numbers of one worker.
    fn of_one(worker: &WorkerRecord) -> Self {
        let mut totals = Self {
            leased: worker.leased,
            ..Self::default()
        };
        if let Some(metrics) = &worker.metrics {
            totals.add(metrics);
            totals.occupy(metrics);
        }
        totals
    }

    /// Adds what a worker has done.
    fn add(&mut self, metrics: &WorkerMetrics) {
        self.done += metrics.done;
        self.failed += metrics.failed;
        self.job_ms += metrics.jobs * metrics.elapsed_ms;
        for (stage, times) in &metrics.stages {
            let sum = self.stages.entry(*stage).or_default();
            sum.count += times.count;
            sum.ms += times.ms;
        }
        for (reason, ms) in &metrics.wait_ms {
            *self.wait_ms.entry(*reason).or_default() += ms;
        }
    }

    /// Adds what a worker occupies on its host.
    fn occupy(&mut self, metrics: &WorkerMetrics) {
        self.jobs += metrics.jobs;
        if let Some(bytes) = metrics.peak_memory_bytes {
            *self.peak_memory_bytes.get_or_insert_default() += bytes;
        }
    }

    /// Returns the mean computing time of a stage in milliseconds. `None` if the stage was not computed.
    fn stage_ms(&self, stage: Stage) -> Option<f64> {
        let times = self.stages.get(&stage).filter(|times| times.count > 0)?;
        Some(times.ms as f64 / times.count as f64)
    }

    /// Returns the share of their time that the jobs waited.
    fn wait_share(&self, reasons: &[WaitReason]) -> Option<f64> {
        let waits = reasons.iter().filter_map(|reason| self.wait_ms.get(reason));
        let waited: u64 = waits.sum();
        (self.job_ms > 0).then(|| waited as f64 / self.job_ms as f64)
    }

    fn json(&self) -> Map<String, Value> {
        let stages = Stage::ALL.map(|stage| (stage, rounded(self.stage_ms(stage), 1e1)));
        let waits = WaitReason::ALL.map(|reason| {
            let share = self.wait_share(&[reason]);
            (reason, rounded(share, 1e4))
        });
        let object = json!({
            "jobs": self.jobs,
            "leased": self.leased,
            "done": self.done,
            "failed": self.failed,
            "mean_stage_ms": BTreeMap::from(stages),
            "wait_share": BTreeMap::from(waits),
            "peak_memory_bytes": self.peak_memory_bytes,
        });
        match object {
            Value::Object(fields) => fields,
            _ => Map::new(),
        }
    }

    /// Returns the cells of a row after the state.
    fn cells(&self) -> Vec<String> {
        let dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let percent = |share: f64| format!("{:.1} %", share * 100.0);
        let mut cells = vec![self.done.to_string(), self.failed.to_string()];
        for stage in Stage::ALL {
            let ms = self.stage_ms(stage);
            cells.push(dash(ms.map(|ms| format!("{ms:.1}"))));
        }
        for reasons in [
            &[WaitReason::Database] as &[_],
            &[WaitReason::Inputs, WaitReason::Artifacts],
        ] {
            cells.push(dash(self.wait_share(reasons).map(percent)));
        }
        let mib = self
            .peak_memory_bytes
            .map(|bytes| format!("{} MiB", bytes >> 20));
        cells.push(dash(mib));
        cells
    }
}

/// Returns a number rounded to a multiple of `1 / scale`.
fn rounded(number: Option<f64>, scale: f64) -> Option<f64> {
    number.map(|number| (number * scale).round() / scale)
}

const fn is_present(state: WorkerState) -> bool {
    matches!(state, WorkerState::Alive | WorkerState::Stopping)
}

impl WorkerTable {
    fn new(workers: Vec<WorkerRecord>, now: UnixMillis) -> Self {
        let mut hosts: BTreeMap<String, Vec<WorkerRecord>> = BTreeMap::new();
        for worker in workers {
            hosts.entry(worker.host.clone()).or_default().push(worker);
        }
        Self { now, hosts }
    }

    /// Returns the age of a time in milliseconds. A clock of another machine may be ahead.
    fn age_ms(&self, time: UnixMillis) -> u64 {
        (self.now - time).max(0).unsigned_abs()
    }

    /// Returns the hosts with their workers and sums as JSON.
    pub(super) fn json(&self) -> Value {
        let hosts = self.hosts.iter().map(|(host, workers)| {
            let rows: Vec<_> = workers.iter().map(|worker| self.worker(worker)).collect();
            let total = Totals::of(workers, self.now).json();
            json!({"host": host, "workers": rows, "total": total})
        });
        let all = Totals::of(self.hosts.values().flatten(), self.now).json();
        json!({"schema": 1, "hosts": hosts.collect::<Vec<_>>(), "total": all})
    }

    fn worker(&self, worker: &WorkerRecord) -> Value {
        let version = worker.metrics.as_ref().map(|metrics| &metrics.version);
        let mut object = json!({
            "id": worker.id.0,
            "pid": worker.pid,
            "version": version,
            "state": worker.state(self.now).name(),
            "since": worker.started,
            "heartbeat_age_ms": self.age_ms(worker.heartbeat),
        });
        let totals = Totals::of_one(worker).json();
        if let Value::Object(fields) = &mut object {
            fields.extend(totals);
        }
        object
    }

    /// Returns the hosts with their workers and sums as a table.
    pub(super) fn text(&self, palette: Palette) -> String {
        if self.hosts.is_empty() {
            return "no worker has been seen in the last 24 hours\n".to_owned();
        }
        let strong = |text: &str| palette.paint(Tone::Strong, text);
        let head = [
            "host, pid",
            "version",
            "state",
            "running",
            "heartbeat",
            "done",
            "failed",
            "fit",
            "depth",
            "normalize",
            "register",
            "database",
            "files",
            "memory",
        ];
        let mut rows = vec![head.map(strong).to_vec()];
        for (host, workers) in &self.hosts {
            let present = workers.iter().filter(|one| is_present(one.state(self.now)));
            let state = format!("{} of {} alive", present.count(), workers.len());
            let start = [strong(host), String::new(), state];
            let blank = [const { String::new() }; 2];
            let cells = Totals::of(workers, self.now).cells();
            rows.push([&start[..], &blank, &cells].concat());
            rows.extend(workers.iter().map(|worker| self.row(worker, palette)));
        }
        let number: usize = self.hosts.values().map(Vec::len).sum();
        let (hosts, workers) = (self.hosts.len() as u64, number as u64);
        format!(
            "{}{} on {}; stages: mean ms of a pair; database, files: share of the time waited for them; memory: peak\n",
            columns(rows, "<<<>>>>>>>>>>>"),
            count(workers, "worker"),
            count(hosts, "host"),
        )
    }

    fn row(&self, worker: &WorkerRecord, palette: Palette) -> Vec<String> {
        let state = worker.state(self.now);
        let tone = match state {
            WorkerState::Alive => Tone::Good,
            WorkerState::Stopping => Tone::Warn,
            WorkerState::Gone => Tone::Bad,
            WorkerState::Ended => Tone::Faint,
        };
        let version = worker.metrics.as_ref().map(|one| one.version.clone());
        let last = match state {
            WorkerState::Alive | WorkerState::Stopping => self.now,
            WorkerState::Gone | WorkerState::Ended => worker.ended.unwrap_or(worker.heartbeat),
        };
        let running = (last - worker.started).max(0).unsigned_abs();
        let start = [
            format!("  {}", worker.pid),
            version.unwrap_or_default(),
            palette.paint(tone, state),
            rough_duration(running),
            format!("{} ago", rough_duration(self.age_ms(worker.heartbeat))),
        ];
        [&start[..], &Totals::of_one(worker).cells()].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::WorkerTable;
    use crate::catalog::WorkerRecord;
    use crate::cli::screen::Palette;
    use crate::domain::{ComputeTimes, Stage, WaitReason, WorkerId, WorkerMetrics};

    const NOW: i64 = 1_800_000_000_000;

    /// A worker with two jobs that has run for 100 s. Its numbers grow with `id`.
    fn worker(id: i64, host: &str) -> WorkerRecord {
        let n = id.unsigned_abs();
        let times = |stage: Stage| ComputeTimes {
            count: 10 * n,
            ms: 10 * n * (stage.index() as u64 + n),
        };
        WorkerRecord {
            id: WorkerId(id),
            host: host.to_owned(),
            pid: 4000 + n as u32,
            started: NOW - 103_000,
            heartbeat: NOW - 3000,
            ended: None,
            died: false,
            leased: 2,
            metrics: Some(WorkerMetrics {
                version: "0.1.0".to_owned(),
                jobs: 2,
                elapsed_ms: 100_000,
                done: 10 * n,
                failed: n,
                stages: Stage::ALL.map(|stage| (stage, times(stage))).into(),
                wait_ms: [
                    (WaitReason::Database, 2000),
                    (WaitReason::Inputs, 30_000 * n),
                    (WaitReason::Artifacts, 1000),
                ]
                .into(),
                peak_memory_bytes: Some(n << 28),
                stopping: false,
            }),
        }
    }

    /// Workers in every state on two hosts.
    fn table() -> WorkerTable {
        let mut stopping = worker(2, "node1");
        if let Some(metrics) = &mut stopping.metrics {
            metrics.stopping = true;
        }
        let silent = WorkerRecord {
            heartbeat: NOW - 61_000,
            ..worker(3, "node2")
        };
        let ended = WorkerRecord {
            ended: Some(NOW - 1000),
            leased: 0,
            ..worker(4, "node2")
        };
        let died = WorkerRecord {
            died: true,
            ..worker(5, "node2")
        };
        let new = WorkerRecord {
            metrics: None,
            heartbeat: NOW + 500,
            ..worker(6, "node2")
        };
        let workers = vec![worker(1, "node1"), stopping, silent, ended, died, new];
        WorkerTable::new(workers, NOW)
    }

    #[test]
    fn workers_are_grouped_by_host_with_sums() {
        insta::assert_snapshot!(table().text(Palette::PLAIN));
    }

    #[test]
    fn means_and_shares_of_a_host_weigh_its_workers_by_their_work() {
        let json = table().json();
        let total = &json["hosts"][0]["total"];
        // 10 pairs of 1 ms and 20 pairs of 2 ms.
        assert_eq!(total["mean_stage_ms"]["fit"], 1.7);
        // 30 s and 60 s of twice 200 s.
        assert_eq!(total["wait_share"]["inputs"], 0.225);
        assert_eq!(total["wait_share"]["database"], 0.01);
        assert_eq!(total["done"], 30);
        assert_eq!(total["peak_memory_bytes"], 3_u64 << 28);
        assert_eq!(json["total"]["done"], 150);
        assert_eq!(json["total"]["jobs"], 4, "of workers that are present");
    }

    #[test]
    fn every_state_and_a_worker_without_metrics_are_in_the_json() {
        let json = table().json();
        let states = |host: usize| {
            let workers = json["hosts"][host]["workers"].as_array().cloned();
            let workers = workers.unwrap_or_default().into_iter();
            workers
                .map(|worker| worker["state"].as_str().unwrap_or_default().to_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(states(0), ["alive", "stopping"]);
        assert_eq!(states(1), ["gone", "ended", "gone", "alive"]);
        let new = &json["hosts"][1]["workers"][3];
        assert_eq!(new["heartbeat_age_ms"], 0, "its clock is ahead");
        assert!(new["version"].is_null() && new["mean_stage_ms"]["fit"].is_null());
        assert!(new["wait_share"]["database"].is_null());
    }

    #[test]
    fn without_workers_the_table_says_so() {
        let table = WorkerTable::new(Vec::new(), NOW);
        assert!(table.text(Palette::PLAIN).starts_with("no worker"));
        assert_eq!(table.json()["hosts"], serde_json::json!([]));
    }
}
