//! Runs a project from start to end: takes the lock, recovers the pairs of dead processes, finds the work, and runs the
//! scheduler.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use super::artifacts_owner::claim_artifacts;
use super::block::inputs;
use super::block::pipeline::BlockPipeline;
use super::block_stages::{BlockStages, block_settings};
use super::error::RunError;
use super::event_log::{log_end, log_event};
use super::events::{RunEvent, RunSummary};
use super::input_changes;
use super::input_reads::{ReadLimits, read_limits};
use super::options::{RunOptions, RunPart};
use super::pair_pipeline::{PairPipeline, PairStages};
use super::policy;
use super::retry::retried;
use super::run_context::{Clock, RunContext, Timing};
use super::run_end::{RunEnd, block_limits, compute, stop_waiting_after_stop};
use super::run_guard::RunGuard;
use super::run_selection::RunSelection;
use super::scheduler::{RunCounts, Scheduler};
use super::stop::Stop;
use super::worker_session::{recover_all, this_process};
use mocban_align::stages::Settings;
use mocban_catalog::{Catalog, FingerprintIds, Fingerprints, PairSelection, WorkerSettings};
use mocban_core::domain::WorkerId;
use mocban_core::page_vec;
use mocban_store::Project;

/// Returns the fingerprints of these settings, one for each stage.
pub fn fingerprints(settings: &Settings) -> Fingerprints {
    Fingerprints::new(|stage| settings.fingerprint_fields(stage))
}

/// What computes the stages of a run.
pub(super) struct RunStages {
    pub(super) pairs: Arc<dyn PairStages>,
    pub(super) blocks: Arc<dyn BlockStages>,
}

/// Runs every stage that has no current result. Passes each event of the run to `on_event` and to the log.
///
/// # Errors
/// Returns an error if a named pair or block does not exist, or if the catalog or the disk cannot be used. Returns an
/// error if another process runs the project, unless this run joins it with the same settings.
pub async fn run(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
    stop: &Stop,
    mut on_event: impl FnMut(RunEvent) + Send,
) -> Result<RunSummary, RunError> {
    page_vec::keep_memory(options.memory);
    let stages = RunStages {
        pairs: Arc::new(PairPipeline::new(project, settings, options)),
        blocks: Arc::new(BlockPipeline::new(options)),
    };
    let fingerprints = fingerprints(settings);
    let ended = run_with(
        project,
        catalog,
        &fingerprints,
        stages,
        options,
        stop,
        |event| {
            log_event(&event);
            on_event(event);
        },
    )
    .await;
    log_end(&ended);
    ended
}

/// Like [`run`], with any stages.
pub(super) async fn run_with(
    project: &Project,
    catalog: &Catalog,
    fingerprints: &Fingerprints,
    stages: RunStages,
    options: &RunOptions,
    stop: &Stop,
    mut on_event: impl FnMut(RunEvent) + Send,
) -> Result<RunSummary, RunError> {
    let clock = Clock::start();
    let mut selection = RunSelection::of(catalog, options.only.as_ref()).await?;
    let fingerprint_ids = catalog.register_fingerprints(fingerprints).await?;
    let mut guard = RunGuard::acquire(project, catalog, options)?;
    claim_artifacts(project, catalog, false).await?;
    let settings = WorkerSettings {
        fingerprints: fingerprint_ids,
        blocks: block_settings(&*stages.blocks),
    };
    guard
        .require_same_settings(catalog, fingerprints, &settings, options.part)
        .await?;
    let worker = catalog
        .register_worker(this_process(), settings, clock.now())
        .await?;
    let start = RunStart {
        project,
        catalog,
        fingerprints,
        blocks: &stages.blocks,
        options,
        selection: selection.as_ref(),
        clock,
        stop,
    };
    // The task is aborted when this function returns.
    let mut waiting = JoinSet::new();
    waiting.spawn(stop_waiting_after_stop(catalog.clone(), stop.clone()));
    if let Err(error) = start.prepare(&mut guard, worker, &mut on_event).await {
        // This error says more than one from ending the worker would.
        let _ = catalog.end_worker(worker, clock.now(), None).await;
        return Err(error);
    }
    let counted = if options.part == RunPart::Plan {
        catalog.end_worker(worker, clock.now(), None).await?;
        (RunCounts::default(), Duration::ZERO)
    } else {
        let (events, received) = mpsc::unbounded_channel();
        let context = Arc::new(start.context(stages.pairs, fingerprint_ids, worker, events));
        let scheduler = Scheduler::new(Arc::clone(&context), selection.clone(), options);
        compute(&context, scheduler, received, &mut on_event).await?
    };
    if let Some(selection) = &mut selection {
        selection.refresh(catalog).await?;
    }
    let (until, selection) = (options.until, selection.as_ref());
    let ended = RunEnd::of(catalog, fingerprints, until, selection, counted);
    Ok(ended.await?.summary(stop, clock))
}

/// What a run works on, before its scheduler starts.
struct RunStart<'a> {
    project: &'a Project,
    catalog: &'a Catalog,
    fingerprints: &'a Fingerprints,
    blocks: &'a Arc<dyn BlockStages>,
    options: &'a RunOptions,
    selection: Option<&'a RunSelection>,
    clock: Clock,
    stop: &'a Stop,
}

impl RunStart<'_> {
    /// Recovers pairs of dead processes, plans unless others do, and reports how much work there is.
    async fn prepare(
        &self,
        guard: &mut RunGuard,
        worker: WorkerId,
        on_event: &mut (impl FnMut(RunEvent) + Send),
    ) -> Result<(), RunError> {
        let (catalog, options) = (self.catalog, self.options);
        let recovered = self.recover(guard, worker).await?;
        if options.part != RunPart::Work && guard.lock_planning(catalog).await? {
            let planned = self.plan().await;
            guard.unlock_planning(catalog).await?;
            planned?;
        }
        let (until, pairs) = (options.until, self.pairs());
        let left = retried!(catalog.work_left(until, pairs))?;
        let blocks = self.selection.map(|selection| &selection.blocks);
        let blocks = retried!(catalog.outstanding_blocks(blocks))?;
        on_event(RunEvent::Started {
            blocks: blocks.left(),
            pairs: left.pairs,
            stages: left.by_stage.iter().sum(),
            by_stage: left.by_stage,
            workers: options.workers,
        });
        if recovered > 0 {
            on_event(RunEvent::Recovered { pairs: recovered });
        }
        Ok(())
    }

    /// Looks at the inputs, requeues pairs to run again, and ends back-offs that are due.
    async fn plan(&self) -> Result<(), RunError> {
        let (catalog, options) = (self.catalog, self.options);
        let limits = read_limits(options, self.stop);
        input_changes::store_changes(self.project, catalog, self.pairs(), &limits).await?;
        let (fingerprints, selection) = (self.fingerprints, self.pairs());
        retried!(catalog.requeue_stale(fingerprints, selection, options.rerun))?;
        let (now, longest) = (self.clock.now(), policy::longest_backoff_ms());
        retried!(catalog.release_due_backoffs(now, longest))?;
        self.plan_blocks(&limits).await
    }

    /// Looks at the inputs of blocks, requeues blocks to run again, and ends back-offs that are due.
    async fn plan_blocks(&self, limits: &ReadLimits) -> Result<(), RunError> {
        let (catalog, rerun) = (self.catalog, self.options.rerun);
        let selection = self.selection.map(|selection| &selection.blocks);
        inputs::store_changes(self.project, catalog, selection, limits).await?;
        let settings = block_settings(&**self.blocks);
        retried!(catalog.requeue_stale_blocks(&settings, rerun, selection))?;
        let (now, longest) = (self.clock.now(), policy::longest_backoff_ms());
        retried!(catalog.release_due_blocks(now, longest))?;
        Ok(())
    }

    /// Returns what the tasks of the run share.
    fn context(
        &self,
        pairs: Arc<dyn PairStages>,
        fingerprints: FingerprintIds,
        worker: WorkerId,
        events: mpsc::UnboundedSender<RunEvent>,
    ) -> RunContext {
        let options = self.options;
        RunContext {
            catalog: self.catalog.clone(),
            project: self.project.clone(),
            pairs,
            blocks: Arc::clone(self.blocks),
            block_limits: block_limits(options),
            fingerprints,
            clock: self.clock,
            timing: Timing::of_this_build(),
            worker: watch::Sender::new(worker),
            stop: self.stop.clone(),
            drain: Stop::new(),
            until: options.until,
            stage_timeout: options.stage_timeout,
            events,
            compute_us: AtomicU64::new(0),
            metrics: options.metrics.clone(),
        }
    }

    /// Returns the selected pairs, or `None` for all.
    fn pairs(&self) -> Option<&PairSelection> {
        self.selection.map(|selection| &selection.pairs)
    }

    /// Recovers the leases of dead processes, then lets other processes join. Does nothing if other processes may hold
    /// valid leases. Returns how many pairs are ready again.
    async fn recover(&self, guard: &mut RunGuard, worker: WorkerId) -> Result<u64, RunError> {
        let Some(lock) = guard.exclusive() else {
            return Ok(0);
        };
        let limits = read_limits(self.options, self.stop);
        let now = self.clock.now();
        let ready = recover_all(self.project, self.catalog, worker, &limits, now).await?;
        self.project.clear_temporary()?;
        lock.downgrade()?;
        Ok(ready)
    }
}
