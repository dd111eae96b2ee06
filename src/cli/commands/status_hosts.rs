//! `status --hosts`: the workers of each machine, with what they have done and what they wait for.

use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::table::{columns, count};
use mocban_catalog::{WorkerRecord, WorkerState};
use mocban_core::domain::{Stage, WaitReason};
use mocban_project::hosts::WorkerTable;
use mocban_project::worker_totals::{WorkerTotals, is_present};
use mocban_system::time_text::rough_duration;

/// Returns the hosts with their workers and sums as a table.
pub(crate) fn table_text(table: &WorkerTable, palette: Palette) -> String {
    if table.hosts.is_empty() {
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
    for (host, workers) in &table.hosts {
        let present = workers
            .iter()
            .filter(|one| is_present(one.state(table.now)));
        let state = format!("{} of {} alive", present.count(), workers.len());
        let start = [strong(host), String::new(), state];
        let blank = [const { String::new() }; 2];
        let cells = cells(&WorkerTotals::of(workers, table.now));
        rows.push([&start[..], &blank, &cells].concat());
        rows.extend(
            workers
                .iter()
                .map(|worker| worker_row(table, worker, palette)),
        );
    }
    let number: usize = table.hosts.values().map(Vec::len).sum();
    let (hosts, workers) = (table.hosts.len() as u64, number as u64);
    format!(
        "{}{} on {}; stages: mean ms of a pair; database, files: share of the time waited for them; memory: peak\n",
        columns(rows, "<<<>>>>>>>>>>>"),
        count(workers, "worker"),
        count(hosts, "host"),
    )
}

fn worker_row(table: &WorkerTable, worker: &WorkerRecord, palette: Palette) -> Vec<String> {
    let state = worker.state(table.now);
    let tone = match state {
        WorkerState::Alive => Tone::Good,
        WorkerState::Stopping => Tone::Warn,
        WorkerState::Gone => Tone::Bad,
        WorkerState::Ended => Tone::Faint,
    };
    let version = worker.metrics.as_ref().map(|one| one.version.clone());
    let last = match state {
        WorkerState::Alive | WorkerState::Stopping => table.now,
        WorkerState::Gone | WorkerState::Ended => worker.ended.unwrap_or(worker.heartbeat),
    };
    let running = (last - worker.started).max(0).unsigned_abs();
    let start = [
        format!("  {}", worker.pid),
        version.unwrap_or_default(),
        palette.paint(tone, state),
        rough_duration(running),
        format!("{} ago", rough_duration(table.age_ms(worker.heartbeat))),
    ];
    [&start[..], &cells(&WorkerTotals::of_one(worker))].concat()
}

/// Returns the cells of a row after the state.
fn cells(totals: &WorkerTotals) -> Vec<String> {
    let dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let percent = |share: f64| format!("{:.1} %", share * 100.0);
    let mut cells = vec![totals.done.to_string(), totals.failed.to_string()];
    for stage in Stage::ALL {
        let ms = totals.stage_ms(stage);
        cells.push(dash(ms.map(|ms| format!("{ms:.1}"))));
    }
    for reasons in [
        &[WaitReason::Database] as &[_],
        &[WaitReason::Inputs, WaitReason::Artifacts],
    ] {
        cells.push(dash(totals.wait_share(reasons).map(percent)));
    }
    let mib = totals
        .peak_memory_bytes
        .map(|bytes| format!("{} MiB", bytes >> 20));
    cells.push(dash(mib));
    cells
}

#[cfg(test)]
mod tests {
    use super::{WorkerTable, table_text};
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
        insta::assert_snapshot!(table_text(&table(), Palette::PLAIN));
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
        assert!(table_text(&table, Palette::PLAIN).starts_with("no worker"));
        assert_eq!(table.json()["hosts"], serde_json::json!([]));
    }
}
