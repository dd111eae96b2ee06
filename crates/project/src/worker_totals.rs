//! Sums over workers, as `status --hosts` shows them.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use mocban_catalog::{WorkerRecord, WorkerState};
use mocban_core::domain::{ComputeTimes, Stage, UnixMillis, WaitReason, WorkerMetrics};

/// Sums over one or more workers.
#[derive(Debug, Default)]
pub struct WorkerTotals {
    jobs: u64,
    leased: u64,
    /// Pairs done.
    pub done: u64,
    /// Pairs failed.
    pub failed: u64,
    stages: BTreeMap<Stage, ComputeTimes>,
    wait_ms: BTreeMap<WaitReason, u64>,
    /// Time that all jobs had in milliseconds.
    job_ms: u64,
    /// Sum of the largest memory of each process in bytes, if it is known.
    pub peak_memory_bytes: Option<u64>,
}

impl WorkerTotals {
    /// Sums up the workers. Jobs and memory are those of the workers that are present.
    pub fn of<'w>(workers: impl IntoIterator<Item = &'w WorkerRecord>, now: UnixMillis) -> Self {
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
    pub fn of_one(worker: &WorkerRecord) -> Self {
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
    pub fn stage_ms(&self, stage: Stage) -> Option<f64> {
        let times = self.stages.get(&stage).filter(|times| times.count > 0)?;
        Some(times.ms as f64 / times.count as f64)
    }

    /// Returns the share of their time that the jobs waited.
    pub fn wait_share(&self, reasons: &[WaitReason]) -> Option<f64> {
        let waits = reasons.iter().filter_map(|reason| self.wait_ms.get(reason));
        let waited: u64 = waits.sum();
        (self.job_ms > 0).then(|| waited as f64 / self.job_ms as f64)
    }

    /// Returns the sums as fields of a JSON object.
    pub(crate) fn json(&self) -> Map<String, Value> {
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
}

/// Returns a number rounded to a multiple of `1 / scale`.
fn rounded(number: Option<f64>, scale: f64) -> Option<f64> {
    number.map(|number| (number * scale).round() / scale)
}

/// Returns whether a worker still works, as far as is known.
pub const fn is_present(state: WorkerState) -> bool {
    matches!(state, WorkerState::Alive | WorkerState::Stopping)
}
