//! The block that a process works on: at most one at a time, before any pair. Its task runs the remaining stages one after
//! another on a thread of their own, and stores each result before the next stage begins.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use tokio::sync::oneshot;
use tokio::task::JoinSet;

use super::artifacts::StageArtifacts;
use super::checkpoint::{
    AfterStage, BlockInProgress, ComputedBlockStage, store_failure, store_stage, stored,
};
use super::inputs::{BlockSources, outdated};
use super::memory::BlockMemory;
use crate::block_stages::BlockStageError;
use crate::blocking::{panic_text, task_result, wait_for_end};
use crate::error::RunError;
use crate::events::RunEvent;
use crate::options::RunOptions;
use crate::policy;
use crate::prefetch::Prefetch;
use crate::retry::retried;
use crate::run_context::{JobEnd, RunContext};
use crate::stop::StopLevel;
use mocban_catalog::{
    BlockInputVersions, BlockJob, BlockSelection, BlockWork, Lease, OutstandingBlocks,
};
use mocban_core::domain::cancel::{CancelToken, Cancelled};
use mocban_core::domain::{BlockStage, BlockStageRecord, FailureClass, WorkerId};
use mocban_store::ArtifactError;
use mocban_system::failpoint::{self, Point};
use mocban_system::platform::sleep_active;

/// Times that a stage may find the result of an earlier stage unusable before the block fails.
const MAX_RERUNS: usize = 4;

/// How a block's task ended, or the error that ends the run.
pub(crate) type BlockReport = Result<JobEnd, RunError>;

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
    memory: BlockMemory,
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
            memory: BlockMemory::new(options),
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
            self.memory.estimate(context, &work.attributes).await
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

/// Runs the remaining stages of a leased block. Logs it if the lease is lost.
async fn process_block(
    context: Arc<RunContext>,
    lease: Lease<BlockJob>,
    work: BlockWork,
) -> BlockReport {
    let report = run_stages(context, lease, work).await;
    if matches!(report, Ok(JobEnd::LeaseLost)) {
        tracing::info!(
            "no result of a block is stored: its lease is lost, or its files were written too long ago"
        );
    }
    report
}

async fn run_stages(
    context: Arc<RunContext>,
    lease: Lease<BlockJob>,
    work: BlockWork,
) -> BlockReport {
    let name = work.attributes.name.clone();
    failpoint::hit(lease.cursor(), Point::Claimed, Some(&name));
    let sources = BlockSources::new(&context.project, &work.attributes, context.block_limits);
    let inputs = work.inputs.clone();
    let (mut stage, mut reruns) = (lease.cursor(), 0);
    let mut block = Box::new(BlockInProgress {
        lease,
        work,
        sources,
        inputs,
    });
    loop {
        if context.is_draining() {
            return release(&context, &block.lease).await;
        }
        let after = match run_stage(&context, &mut block, stage).await {
            Ok(computed) => store_stage(&context, block, stage, computed).await,
            Err(Interruption::Rerun(earlier)) if reruns < MAX_RERUNS && earlier < stage => {
                reruns += 1;
                stage = earlier;
                continue;
            }
            Err(Interruption::Rerun(earlier)) => {
                let error = BlockStageError::RerunFrom(earlier);
                store_failure(&context, block, stage, error, None).await
            }
            Err(Interruption::Failed(error, ms)) => {
                store_failure(&context, block, stage, error, ms).await
            }
            Err(Interruption::Stopped) => {
                return release(&context, &block.lease).await;
            }
            Err(Interruption::LeaseLost) => return Ok(JobEnd::LeaseLost),
            Err(Interruption::Store(error)) => {
                return end_without_store(&context, &block.lease, error).await;
            }
            Err(Interruption::Run(error)) => Err(error),
        };
        match after? {
            AfterStage::Continue(next, at) => (block, stage) = (next, at),
            AfterStage::End(end) => return Ok(end),
        }
    }
}

/// Releases a block whose files an object store did not give or take. If the store is unavailable, the block is tried
/// again later. Any other error, such as refused credentials, concerns all blocks and ends the run.
async fn end_without_store(
    context: &RunContext,
    lease: &Lease<BlockJob>,
    error: ArtifactError,
) -> BlockReport {
    let end = release(context, lease).await?;
    if error.is_unavailable() {
        tracing::warn!("{error}; the block is tried again");
        return Ok(end);
    }
    Err(error.into())
}

async fn release(context: &RunContext, lease: &Lease<BlockJob>) -> Result<JobEnd, RunError> {
    let catalog = &context.catalog;
    stored!(catalog.release_block(lease.clone()))?;
    Ok(JobEnd::Released)
}

/// Why a stage has no result.
enum Interruption {
    /// An earlier stage must run again.
    Rerun(BlockStage),
    /// The stage failed, after this many milliseconds.
    Failed(BlockStageError, Option<u64>),
    /// An object store failed.
    Store(ArtifactError),
    /// The run stops at once.
    Stopped,
    /// The lease is lost.
    LeaseLost,
    /// The run cannot go on.
    Run(RunError),
}

impl Interruption {
    /// Describes an error of a stage, which occurred after this many milliseconds.
    fn of(error: BlockStageError, ms: Option<u64>) -> Self {
        match error {
            BlockStageError::RerunFrom(earlier) => Self::Rerun(earlier),
            BlockStageError::Store(error) => Self::Store(error),
            error => Self::Failed(error, ms),
        }
    }
}

/// Reads the versions of the input files and computes a stage.
async fn run_stage(
    context: &Arc<RunContext>,
    block: &mut BlockInProgress,
    stage: BlockStage,
) -> Result<ComputedBlockStage, Interruption> {
    context.emit(RunEvent::BlockStageStarted {
        block: block.work.attributes.name.clone(),
        stage,
    });
    let (sources, known) = (block.sources.clone(), block.inputs.clone());
    let worker = block.lease.worker();
    let read = move |_: &AtomicBool| {
        let versions = sources.versions(stage, &known);
        Ok(versions.map_err(|error| (error, sources.missing())))
    };
    let versions = on_thread(context, worker, read).await?;
    let versions = match versions.map_err(|error| Interruption::of(error, None))? {
        Ok(versions) => versions,
        Err((error, missing)) => {
            let BlockInputVersions { mesh, page, labels } = missing;
            let seen = &mut block.inputs;
            seen.mesh = mesh.or_else(|| seen.mesh.take());
            seen.page = page.or_else(|| seen.page.take());
            seen.labels = labels.or_else(|| seen.labels.take());
            return Err(Interruption::of(error, None));
        }
    };
    let earlier = outdated(stage, &block.inputs, &versions);
    let BlockInputVersions { mesh, page, labels } = versions;
    let seen = BlockInputVersions {
        mesh: mesh.or_else(|| block.inputs.mesh.take()),
        page: page.or_else(|| block.inputs.page.take()),
        labels: labels.or_else(|| block.inputs.labels.take()),
    };
    if let Some(earlier) = earlier {
        block.inputs = seen;
        return Err(Interruption::Rerun(earlier));
    }
    if seen != block.work.inputs {
        // Before the computation, so that a later run knows which files it failed on if the process dies.
        let (catalog, lease) = (&context.catalog, &block.lease);
        let stored = stored!(catalog.store_leased_inputs(
            lease.clone(),
            seen.clone(),
            context.alive_since()
        ));
        if !stored.map_err(|error| Interruption::Run(error.into()))? {
            return Err(Interruption::LeaseLost);
        }
        block.work.inputs = seen.clone();
    }
    block.inputs = seen;
    let results = block.work.results.iter();
    let earlier: Vec<_> = results
        .filter(|record| record.stage < stage)
        .cloned()
        .collect();
    compute(context, block, stage, earlier).await
}

/// Computes a stage on its own thread.
async fn compute(
    context: &Arc<RunContext>,
    block: &BlockInProgress,
    stage: BlockStage,
    earlier: Vec<BlockStageRecord>,
) -> Result<ComputedBlockStage, Interruption> {
    let begun = Instant::now();
    let (sources, read) = (block.sources.clone(), block.inputs.clone());
    let points = block.work.control_points.clone();
    let points = points.filter(|points| read.have(points));
    let inner = Arc::clone(context);
    let outcome = on_thread(context, block.lease.worker(), move |stop| {
        let inputs = sources.inputs(points);
        let artifacts = StageArtifacts::new(&inner.project, &inputs.name, stage);
        let output = inner
            .blocks
            .run(stage, &inputs, &earlier, &artifacts, stop)?;
        sources.check_unchanged(&read)?;
        failpoint::hit(stage, Point::Computed, Some(&inputs.name));
        Ok((output, artifacts.finish()?))
    })
    .await?;
    let ms = begun.elapsed().as_millis() as u64;
    match outcome {
        Ok((output, (files, began))) => Ok(ComputedBlockStage {
            output,
            files,
            ms,
            began,
        }),
        Err(error) => Err(Interruption::of(error, Some(ms))),
    }
}

/// Runs blocking work on a thread of its own, with a flag that requests a stop. Waits for at most as long as one stage
/// may take; then, after an immediate stop of the run, and when the leases of `worker` have expired, cancels the work and
/// waits until its memory is free.
async fn on_thread<T: Send + 'static>(
    context: &RunContext,
    worker: WorkerId,
    work: impl FnOnce(&AtomicBool) -> Result<T, BlockStageError> + Send + 'static,
) -> Result<Result<T, BlockStageError>, Interruption> {
    let failed =
        |class, text: String| Interruption::Failed(BlockStageError::failed(class, text), None);
    let token = CancelToken::default();
    let (sender, mut receiver) = oneshot::channel();
    let inner = token.clone();
    let thread = std::thread::Builder::new().name("block".to_owned());
    let spawned = thread.spawn(move || {
        let work = || {
            let outcome = inner.run(|| work(inner.flag()));
            outcome.unwrap_or_else(|Cancelled| Err(BlockStageError::Stopped))
        };
        let outcome = catch_unwind(AssertUnwindSafe(work));
        // The receiver is gone if the thread was abandoned.
        let _ = sender.send(outcome.map_err(|payload| panic_text(&*payload)));
    });
    if let Err(error) = spawned {
        let text = format!("the system gave no thread: {error}");
        return Err(failed(FailureClass::Resource, text));
    }
    let interruption = tokio::select! {
        biased;
        outcome = &mut receiver => return match outcome {
            Ok(Ok(outcome)) => Ok(outcome),
            Ok(Err(text)) => Err(failed(FailureClass::Bug, text)),
            Err(_) => Err(failed(FailureClass::Bug, "the block's thread ended without a result".to_owned())),
        },
        () = context.stop.reached(StopLevel::Now) => Interruption::Stopped,
        () = context.expired(worker) => Interruption::LeaseLost,
        () = sleep_active(context.stage_timeout) => {
            let seconds = context.stage_timeout.as_secs_f64();
            failed(FailureClass::Resource, format!("the stage took longer than {seconds} s (run.stage_timeout_s)"))
        }
    };
    token.cancel();
    wait_for_end(receiver).await;
    Err(interruption)
}
