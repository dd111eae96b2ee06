//! The block that a process works on: at most one at a time, before any pair.

use std::sync::Arc;

use tokio::task::JoinSet;

use super::memory::{BLOCK_BYTES, EstimatedBlock, map_bytes};
use super::task::{BlockReport, process_block};
use crate::blocking::task_result;
use crate::error::RunError;
use crate::input_reads::{ReadLimits, read_each};
use crate::options::RunOptions;
use crate::policy;
use crate::prefetch::Prefetch;
use crate::retry::retried;
use crate::run_context::{JobEnd, RunContext};
use crate::stop::StopLevel;
use mocban_catalog::{BlockAttributes, BlockSelection, OutstandingBlocks};
use mocban_core::domain::WorkerId;
use mocban_core::raster;

/// What a run has counted about blocks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct BlockRunCounts {
    pub(crate) done: u64,
    pub(crate) failed: u64,
}

/// The slot of a process for a block.
pub(crate) struct BlockSlot {
    context: Arc<RunContext>,
    /// The blocks of this run; `None` for all.
    selection: Option<BlockSelection>,
    image_limits: raster::ImageLimits,
    /// Memory for the height maps of a block.
    map_bytes: u64,
    /// Whether a claim may find a block.
    may_find_one: bool,
    /// The next block needs memory that a running pair has to return first.
    waits_for_memory: bool,
    task: JoinSet<BlockReport>,
    pub(crate) counts: BlockRunCounts,
}

impl BlockSlot {
    pub(crate) fn new(
        context: Arc<RunContext>,
        selection: Option<BlockSelection>,
        options: &RunOptions,
    ) -> Self {
        Self {
            context,
            may_find_one: selection
                .as_ref()
                .is_none_or(|selection| !selection.is_empty()),
            selection,
            image_limits: options.limits.image,
            map_bytes: map_bytes(options.memory),
            waits_for_memory: false,
            task: JoinSet::new(),
            counts: BlockRunCounts::default(),
        }
    }

    /// Returns whether a block is in progress.
    pub(crate) fn is_busy(&self) -> bool {
        !self.task.is_empty()
    }

    /// Notes that a running pair returned its memory.
    pub(crate) const fn memory_was_freed(&mut self) {
        self.waits_for_memory = false;
    }

    /// Claims a block and starts its task, unless one is in progress. Returns whether one is in progress now, or waits
    /// for the memory of running pairs. In both cases no pair may be claimed.
    pub(crate) async fn start(
        &mut self,
        worker: WorkerId,
        pairs: &mut Prefetch,
    ) -> Result<bool, RunError> {
        if self.is_busy() || self.waits_for_memory {
            return Ok(true);
        }
        if !self.may_find_one {
            return Ok(false);
        }
        let context = &self.context;
        let (deadline, alive_since) = (context.block_deadline(), context.alive_since());
        let (catalog, selection) = (&context.catalog, self.selection.as_ref());
        let claimed = retried!(catalog.claim_block(worker, deadline, alive_since, selection))?;
        let Some((lease, work)) = claimed else {
            self.may_find_one = false;
            return Ok(false);
        };
        let bytes = if pairs.is_memory_limited() {
            self.estimate(&work.attributes).await
        } else {
            0
        };
        if !pairs.reserve_for_block(&work.attributes.name, bytes) {
            // Pairs that wait for a slot start before the block is claimed again, but no others are claimed.
            self.waits_for_memory = true;
            retried!(catalog.release_block(lease.clone()))?;
            return Ok(true);
        }
        let task = process_block(Arc::clone(&self.context), lease, work);
        self.task.spawn(task);
        Ok(true)
    }

    /// Estimates the memory that a block needs, in bytes. Reads the headers of its files.
    async fn estimate(&self, attributes: &BlockAttributes) -> u64 {
        let block = EstimatedBlock {
            project: self.context.project.clone(),
            attributes: attributes.clone(),
            limits: self.image_limits,
            map_bytes: self.map_bytes,
        };
        let limits = ReadLimits {
            timeout: self.context.timing.read_timeout(),
            stop: self.context.stop.clone(),
            until: StopLevel::Drain,
        };
        let estimated = read_each(vec![block], &limits).await;
        estimated
            .into_iter()
            .flatten()
            .next()
            .unwrap_or(BLOCK_BYTES)
    }

    /// Waits for the end of the block in progress. Returns `None` at once if there is none.
    pub(crate) async fn ended(&mut self) -> Option<BlockReport> {
        self.task.join_next().await.map(task_result)
    }

    /// Counts a block that ended.
    pub(crate) fn count(&mut self, ended: BlockReport) -> Result<(), RunError> {
        self.may_find_one = true;
        match ended? {
            JobEnd::Done => self.counts.done += 1,
            JobEnd::Failed => self.counts.failed += 1,
            JobEnd::Retry | JobEnd::Released | JobEnd::LeaseLost => {}
        }
        Ok(())
    }

    /// Returns how many blocks any process has yet to finish.
    pub(crate) async fn outstanding(&self) -> Result<OutstandingBlocks, RunError> {
        let (catalog, selection) = (&self.context.catalog, self.selection.as_ref());
        Ok(retried!(catalog.outstanding_blocks(selection))?)
    }

    /// Ends back-offs that are due, and finds out whether a claim may find a block.
    pub(crate) async fn poll(&mut self) -> Result<(), RunError> {
        let left = self.outstanding().await?;
        let (now, longest) = (self.context.clock.now(), policy::longest_backoff_ms());
        let is_due = left.next_due.is_some_and(|due| due <= now);
        if is_due {
            let catalog = &self.context.catalog;
            retried!(catalog.release_due_blocks(now, longest))?;
        }
        self.may_find_one = is_due || left.ready > 0;
        Ok(())
    }
}
