//! Data shared by the tasks of a run: its clock, the intervals of heartbeats and recovery, its worker and until when the
//! leases of that worker are valid. Also how the tasks of pairs and blocks end.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tokio::sync::{mpsc, watch};

use super::block_stages::{BlockStages, block_settings};
use super::error::RunError;
use super::events::RunEvent;
use super::pair_pipeline::PairStages;
use super::run_metrics::RunMetrics;
use super::stop::{Stop, StopLevel};
use mocban_catalog::{Catalog, FingerprintIds, WorkerSettings};
use mocban_core::domain::{Stage, UnixMillis, WorkerId, WorkerMetrics};
use mocban_store::Project;
use mocban_system::failpoint;

/// Intervals of heartbeats and recovery. All workers use the same lease length, so each worker knows when others may
/// consider it dead. Every worker measures time with its own clock. The pairs of a dead worker are ready again within a
/// minute: one lease and two recovery intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timing {
    /// Interval between heartbeats.
    pub(super) heartbeat_every: Duration,
    /// A worker without a heartbeat for this long is dead.
    pub(super) lease: Duration,
    /// Interval between searches for dead workers.
    pub(super) recover_every: Duration,
    /// A living worker loses a lease if it still sends heartbeats this long after the lease's deadline.
    pub(super) deadline_margin: Duration,
}

impl Timing {
    const DEFAULT: Self = Self {
        heartbeat_every: Duration::from_secs(10),
        lease: Duration::from_secs(50),
        recover_every: Duration::from_millis(2500),
        deadline_margin: Duration::from_mins(1),
    };

    /// Returns the intervals of this build. With debug assertions, `MOCBAN_TIME_SCALE=N` divides them by N for tests.
    pub(super) fn of_this_build() -> Self {
        let timing = Self::DEFAULT.divided_by(failpoint::time_scale("MOCBAN_TIME_SCALE"));
        if cfg!(test) {
            timing.with_rare_heartbeats()
        } else {
            timing
        }
    }

    /// Returns intervals with which a run in a unit test sends no heartbeat after its first, at any speed.
    fn with_rare_heartbeats(self) -> Self {
        Self {
            heartbeat_every: self.heartbeat_every * 100,
            lease: self.lease * 100,
            ..self
        }
    }

    fn divided_by(self, scale: u32) -> Self {
        let scale = scale.max(1);
        Self {
            heartbeat_every: self.heartbeat_every / scale,
            lease: self.lease / scale,
            recover_every: self.recover_every / scale,
            deadline_margin: self.deadline_margin / scale,
        }
    }

    /// Returns the time limit for each input file that the scheduler waits for. Even if `MAX_HANGING` files hang, the
    /// scheduler sends its next heartbeat before its leases expire.
    pub(super) fn read_timeout(&self) -> Duration {
        self.heartbeat_every / 5
    }

    /// Returns the length of a lease in milliseconds.
    pub(super) const fn lease_ms(&self) -> i64 {
        self.lease.as_millis() as i64
    }
}

/// A clock that starts at the system's time and advances steadily. If the system's clock is changed during a run, this
/// clock does not follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    start: UnixMillis,
    since: Instant,
}

impl Clock {
    /// Starts at the system's time.
    pub(super) fn start() -> Self {
        let start = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_millis() as UnixMillis);
        Self {
            start,
            since: Instant::now(),
        }
    }

    /// Returns the current time.
    pub(super) fn now(&self) -> UnixMillis {
        self.start + self.since.elapsed().as_millis() as UnixMillis
    }

    /// Returns the milliseconds since the start.
    pub(super) fn elapsed_ms(&self) -> u64 {
        self.since.elapsed().as_millis() as u64
    }
}

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

/// How the task of a pair or block ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobEnd {
    /// Every stage is stored, for a pair up to the run's last one.
    Done,
    /// The job is quarantined.
    Failed,
    /// The job will be retried.
    Retry,
    /// The job was released unfinished.
    Released,
    /// The lease was lost: it expired, the job was recovered, repaired, cut again or retired, or the files are too old to be
    /// stored. Counts neither as done nor as failed.
    LeaseLost,
}

/// What a pair's task reports at its end.
#[derive(Debug)]
pub(super) struct PairReport {
    /// How it ended, or the error that ends the run.
    pub(super) end: Result<JobEnd, RunError>,
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

#[cfg(test)]
mod tests {
    use super::Timing;
    use crate::input_reads::{MAX_HANGING, THREADS};
    use std::time::Duration;

    #[test]
    fn dead_workers_are_found_within_a_minute_and_slow_ones_are_not_taken_for_dead() {
        let Timing {
            heartbeat_every,
            lease,
            recover_every,
            ..
        } = Timing::DEFAULT;
        // One recovery records the last heartbeat. A recovery at least one lease length later finds it unchanged.
        assert!(lease + recover_every * 2 <= Duration::from_mins(1));
        assert!(lease >= heartbeat_every * 4);
    }

    #[test]
    fn files_that_hang_do_not_make_a_worker_lose_its_leases() {
        let timing = Timing::DEFAULT;
        let longest_wait = timing.read_timeout() * MAX_HANGING.div_ceil(THREADS) as u32;
        // The reads may begin just before a heartbeat is due, and two reads may follow each other: one to recover
        // pairs and one to estimate their memory.
        assert!(timing.heartbeat_every + longest_wait * 2 < timing.lease);
    }
}
