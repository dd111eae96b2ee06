//! The workers of each machine, with what they have done and what they wait for.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::error::ProjectResult;
use crate::worker_totals::WorkerTotals;
use mocban_catalog::{Catalog, WorkerRecord};
use mocban_core::domain::UnixMillis;

/// Workers without a heartbeat for longer are not shown, in milliseconds.
const SHOWN_MS: i64 = 24 * 3_600_000;

/// The workers of one day.
#[derive(Debug)]
pub struct WorkerTable {
    /// When they were read.
    pub now: UnixMillis,
    /// The workers of each host.
    pub hosts: BTreeMap<String, Vec<WorkerRecord>>,
}

impl WorkerTable {
    /// Reads the workers that had a heartbeat within a day.
    pub async fn read(catalog: &Catalog, now: UnixMillis) -> ProjectResult<Self> {
        Ok(Self::new(catalog.workers(now - SHOWN_MS).await?, now))
    }

    /// Groups workers by host.
    pub fn new(workers: Vec<WorkerRecord>, now: UnixMillis) -> Self {
        let mut hosts: BTreeMap<String, Vec<WorkerRecord>> = BTreeMap::new();
        for worker in workers {
            hosts.entry(worker.host.clone()).or_default().push(worker);
        }
        Self { now, hosts }
    }

    /// Returns the age of a time in milliseconds. A clock of another machine may be ahead.
    pub fn age_ms(&self, time: UnixMillis) -> u64 {
        (self.now - time).max(0).unsigned_abs()
    }

    /// Returns the hosts with their workers and sums as JSON.
    pub fn json(&self) -> Value {
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
}
