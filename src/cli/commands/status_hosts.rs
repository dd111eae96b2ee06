//! `status --hosts`: the workers of each machine, with what they have done and what they wait for.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::table::{columns, count};
use mocban_catalog::{Catalog, WorkerRecord, WorkerState};
use mocban_core::domain::UnixMillis;
use mocban_project::ProjectResult;
use mocban_project::worker_totals::{WorkerTotals, is_present};
use mocban_system::time_text::rough_duration;

/// Workers without a heartbeat for longer are not shown, in milliseconds.
const SHOWN_MS: i64 = 24 * 3_600_000;

/// The workers of one day.
pub(crate) struct WorkerTable {
    now: UnixMillis,
    hosts: BTreeMap<String, Vec<WorkerRecord>>,
}

/// Reads the workers that had a heartbeat within a day.
pub(crate) async fn read(catalog: &Catalog, now: UnixMillis) -> ProjectResult<WorkerTable> {
    let workers = catalog.workers(now - SHOWN_MS).await?;
    Ok(WorkerTable::new(workers, now))
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
    pub(crate) fn json(&self) -> Value {
        let hosts = self.hosts.iter().map(|(host, workers)| {
            let rows: Vec<_> = workers.iter().map(|worker| self.worker(worker)).collect();
            let total = WorkerTotals::of(workers, self.now).json();
            json!({"host": host, "workers": rows, "total": total})
        });
        let all = WorkerTotals::of(self.hosts.values().flatten(), self.now).json();
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
        let totals = WorkerTotals::of_one(worker).json();
        if let Value::Object(fields) = &mut object {
            fields.extend(totals);
        }
        object
    }

    /// Returns the hosts with their workers and sums as a table.
    pub(crate) fn text(&self, palette: Palette) -> String {
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
            let cells = WorkerTotals::of(workers, self.now).cells();
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
        [&start[..], &WorkerTotals::of_one(worker).cells()].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::WorkerTable;
    use crate::cli::output::screen::Palette;
    use mocban_catalog::WorkerRecord;
    use mocban_core::domain::{ComputeTimes, Stage, WaitReason, WorkerId, WorkerMetrics};

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
