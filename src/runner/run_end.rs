//! The end of a run: what is left, and its summary.

use std::time::Duration;

use super::error::RunError;
use super::events::{BlockSummary, RunSummary};
use super::options::RunOptions;
use super::policy::Clock;
use super::run_selection::RunSelection;
use super::scheduler::RunCounts;
use super::stop::{Stop, StopLevel};
use crate::catalog::{Catalog, Fingerprints, OutstandingBlocks, StatusCounts, WorkLeft};
use crate::domain::Stage;

/// Returns the largest mesh and the largest other file of a block, with the names of the settings.
pub(super) const fn block_limits(options: &RunOptions) -> [(u64, &'static str); 2] {
    [
        (options.mesh_limits.max_bytes, "limits.mesh.max_bytes"),
        (options.image_limits.max_bytes, "limits.image.max_bytes"),
    ]
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
            status: catalog.status(fingerprints).await?,
            left: catalog.work_left(until, pairs).await?,
            blocks: catalog.outstanding_blocks(blocks).await?,
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
            },
            stopped: is_left && stop.level() > StopLevel::Go,
            too_many_failures: counts.too_many_failures,
            compute_time: self.compute_time,
            elapsed_ms: clock.elapsed_ms(),
            status: self.status,
        }
    }
}
