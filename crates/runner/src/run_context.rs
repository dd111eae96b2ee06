//! Data shared by the tasks of a run, and the report of a pair's task.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::{mpsc, watch};

use super::block_stages::{BlockStages, block_settings};
use super::error::RunError;
use super::events::RunEvent;
use super::pair_pipeline::PairStages;
use super::run_metrics::RunMetrics;
use super::stop::{Stop, StopLevel};
use super::timing::{Clock, Timing};
use mocban_catalog::{Catalog, FingerprintIds, WorkerSettings};
use mocban_core::domain::{Stage, UnixMillis, WorkerId, WorkerMetrics};
use mocban_store::Project;

/// What all pairs of a run have in common.
pub(super) struct RunContext {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) pairs: Arc<dyn PairStages>,
    /// Computes the stages of blocks.
    pub(super) blocks: Arc<dyn BlockStages>,
    /// Largest mesh and largest other file of a block in bytes, with the names of the settings.
    pub(super) block_limits: [(u64, &'static str); 2],
    pub(super) fingerprints: FingerprintIds,
    pub(super) clock: Clock,
    pub(super) timing: Timing,
    /// This process as a worker. Another one if its leases have expired.
    pub(super) worker: watch::Sender<WorkerId>,
    /// Raised from outside, by a signal.
    pub(super) stop: Stop,
    /// Raised by the run itself, such as after too many failures.
    pub(super) drain: Stop,
    /// Last stage to run.
    pub(super) until: Stage,
    /// Longest time for one stage of one pair.
    pub(super) stage_timeout: Duration,
    pub(super) events: mpsc::UnboundedSender<RunEvent>,
    /// Microseconds that stages were computed, all threads together.
    pub(super) compute_us: AtomicU64,
    pub(super) metrics: RunMetrics,
}

/// How a pair's task ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PairEnd {
    /// Every stage up to the run's last one is stored.
    Done,
    /// The pair is quarantined.
    Failed,
    /// The pair will be retried.
    Retry,
    /// The pair was released unfinished.
    Released,
    /// The lease was lost: it expired, another process of the run recovered the job, or the files are too old to be stored.
    LeaseLost,
}

/// What a pair's task reports at its end.
#[derive(Debug)]
pub(super) struct PairReport {
    /// How it ended, or the error that ends the run.
    pub(super) end: Result<PairEnd, RunError>,
    /// Number of stages that were computed and stored.
    pub(super) stages: u64,
}

impl RunContext {
    /// Returns whether no new stage may begin.
    pub(super) fn is_draining(&self) -> bool {
        self.stop.level().max(self.drain.level()) >= StopLevel::Drain
    }

    /// Returns the stage after `done`. Returns `None` if `done` is the run's last stage, or if no new stage may begin.
    pub(super) fn next_stage(&self, done: Stage) -> Option<Stage> {
        done.next()
            .filter(|next| *next <= self.until && !self.is_draining())
    }

    /// Returns the id under which this process works now.
    pub(super) fn worker_id(&self) -> WorkerId {
        *self.worker.borrow()
    }

    /// Waits until this process works under another id than `worker`, whose leases have expired. The scheduler changes the id
    /// after a refused heartbeat; what waits here is cancelled: stages of pairs by `Checkpointer::closed`, and those of blocks
    /// by `on_thread` in `block/task.rs`.
    pub(super) async fn expired(&self, worker: WorkerId) {
        let mut now = self.worker.subscribe();
        // The sender lives in `self`, so the channel cannot close while this waits.
        let _ = now.wait_for(|now| *now != worker).await;
    }

    /// Returns when a stage that begins now has to be finished: the `deadline` of its lease, which is used only to recover it.
    pub(super) fn deadline(&self) -> UnixMillis {
        self.clock.now() + self.stage_timeout.as_millis() as i64
    }

    /// Returns when a stage of a block that begins now has to be finished. Reading its files may take as long as
    /// computing it.
    pub(super) fn block_deadline(&self) -> UnixMillis {
        self.deadline() + self.stage_timeout.as_millis() as i64
    }

    /// Returns the time one lease length ago. A worker's leases are valid if its last heartbeat is not older than this.
    pub(super) fn alive_since(&self) -> UnixMillis {
        self.clock.now() - self.timing.lease_ms()
    }

    /// Adds to the time that stages were computed.
    pub(super) fn add_compute_time(&self, stage: Stage, elapsed: Duration) {
        let us = elapsed.as_micros() as u64;
        self.compute_us.fetch_add(us, Ordering::Relaxed);
        self.metrics.add_stage(stage, elapsed);
    }

    /// Returns the settings of this run for the worker's row in the catalog.
    pub(super) fn worker_settings(&self) -> WorkerSettings {
        WorkerSettings {
            fingerprints: self.fingerprints,
            blocks: block_settings(&*self.blocks),
        }
    }

    /// Returns the counts and times of this run for the worker's row in the catalog.
    pub(super) fn worker_metrics(&self) -> WorkerMetrics {
        let elapsed_ms = self.clock.elapsed_ms();
        self.metrics.snapshot(elapsed_ms, self.is_draining())
    }

    /// Sends an event to the caller of the run.
    pub(super) fn emit(&self, event: RunEvent) {
        // Sending fails after a fatal error, because the receiver is gone. Nobody needs the event in that case.
        let _ = self.events.send(event);
    }
}

impl PairReport {
    /// A pair whose processing ended with an error of the run.
    pub(super) const fn failed(error: RunError) -> Self {
        Self {
            end: Err(error),
            stages: 0,
        }
    }
}
