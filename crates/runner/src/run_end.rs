//! The last part of a run: runs the scheduler, ends the worker, counts what is left, and makes the summary.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::sync::mpsc;

use super::error::RunError;
use super::events::{BlockSummary, RunEvent, RunSummary};
use super::options::RunOptions;
use super::retry::retried;
use super::run_context::{Clock, RunContext};
use super::run_selection::RunSelection;
use super::scheduler::{RunCounts, Scheduler};
use super::stop::{Stop, StopLevel};
use mocban_catalog::{Catalog, Fingerprints, OutstandingBlocks, StatusCounts, WorkLeft};
use mocban_core::domain::Stage;

/// Returns the largest mesh and the largest other file of a block, with the names of the settings.
pub(super) const fn block_limits(options: &RunOptions) -> [(u64, &'static str); 2] {
    [
        (options.limits.mesh.max_bytes, "limits.mesh.max_bytes"),
        (options.limits.image.max_bytes, "limits.image.max_bytes"),
    ]
}

/// Time after a stop request during which a run still waits for an unavailable database server.
const UNAVAILABLE_AFTER_STOP: Duration = Duration::from_secs(2);

/// Runs the scheduler and ends the worker. Returns what was counted, and for how long stages were computed.
pub(super) async fn compute(
    context: &RunContext,
    mut scheduler: Scheduler,
    mut events: mpsc::UnboundedReceiver<RunEvent>,
    on_event: &mut (impl FnMut(RunEvent) + Send),
) -> Result<(RunCounts, Duration), RunError> {
    let catalog = &context.catalog;
    let counts = scheduler.run(&mut events, on_event).await;
    // End the worker in the catalog even after an error. Otherwise the next run would count a crash.
    let (worker, now) = (context.worker_id(), context.clock.now());
    let metrics = context.worker_metrics();
    let ended = retried!(catalog.end_worker(worker, now, Some(&metrics)));
    // A lost log explains other errors.
    let ended = match ended {
        Err(error) if error.log_loss().is_some() => return Err(error.into()),
        ended => ended,
    };
    let counts = counts?;
    ended?;
    let computed = Duration::from_micros(context.compute_us.load(Ordering::Relaxed));
    Ok((counts, computed))
}

/// Ends all waits for an unavailable database server, [`UNAVAILABLE_AFTER_STOP`] after a first stop request or at once
/// after a second.
pub(super) async fn stop_waiting_after_stop(catalog: Catalog, stop: Stop) {
    stop.reached(StopLevel::Drain).await;
    let second = stop.reached(StopLevel::Now);
    let _ = tokio::time::timeout(UNAVAILABLE_AFTER_STOP, second).await;
    catalog.stop_waiting();
}

/// What is known when a run has ended.
pub(super) struct RunEnd {
    pub(super) counts: RunCounts,
    pub(super) left: WorkLeft,
    pub(super) blocks: OutstandingBlocks,
    pub(super) status: StatusCounts,
    pub(super) compute_time: Duration,
}

impl RunEnd {
    /// Counts what is left. `counted` is what the run has counted, and for how long stages were computed.
    pub(super) async fn of(
        catalog: &Catalog,
        fingerprints: &Fingerprints,
        until: Stage,
        selection: Option<&RunSelection>,
        counted: (RunCounts, Duration),
    ) -> Result<Self, RunError> {
        let pairs = selection.map(|selection| &selection.pairs);
        let blocks = selection.map(|selection| &selection.blocks);
        let (counts, compute_time) = counted;
        Ok(Self {
            counts,
            status: retried!(catalog.status(fingerprints))?,
            left: retried!(catalog.work_left(until, pairs))?,
            blocks: retried!(catalog.outstanding_blocks(blocks))?,
            compute_time,
        })
    }

    /// Returns the summary of the run.
    pub(super) fn summary(self, stop: &Stop, clock: Clock) -> RunSummary {
        let Self {
            counts,
            left,
            blocks,
            ..
        } = self;
        let is_left = left.pairs > 0 || blocks.left() > 0;
        RunSummary {
            done: counts.done,
            failed: counts.failed,
            stages: counts.stages,
            left: left.pairs,
            failed_in_all: left.quarantined,
            blocks: BlockSummary {
                done: counts.blocks.done,
                failed: counts.blocks.failed,
                left: blocks.left(),
                failed_in_all: blocks.quarantined,
                pairs: counts.cut,
            },
            stopped: is_left && stop.level() > StopLevel::Go,
            too_many_failures: counts.too_many_failures,
            compute_time: self.compute_time,
            elapsed_ms: clock.elapsed_ms(),
            status: self.status,
        }
    }
}
