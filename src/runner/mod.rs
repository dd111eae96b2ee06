//! The run: workers that lease pairs, run the stages that are left, and checkpoint after each.
//!
//! [`run`] prepares (lock, dead workers' leases, changed inputs and settings), then `dispatch` keeps the slots filled
//! with what `ahead` takes, `worker` takes one pair through its stages, `held` has each stored while the next is
//! computed, and `execute` is the one bridge to the threads that compute.

mod bare;
mod checkpointer;
mod clock;
mod compute_thread;
mod events;
mod filing;
mod input_changes;
mod memory_budget;
mod options;
mod pace;
mod pair_context;
mod pair_task;
mod policy;
mod prefetch;
mod scheduler;
mod stage_executor;
mod stage_output;
mod steps;
mod stop;
#[cfg(test)]
mod tests;
mod timing;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;

pub use bare::bare;
pub use events::{RunEvent, RunSummary};
pub use memory_budget::free_memory;
pub use options::{Rerun, RunOptions};
pub use stage_output::result_hash;
pub use stop::{Stop, StopLevel};

use crate::catalog::{
    Catalog, CatalogError, DeadWorker, FieldChange, Fingerprints, PairSelection, Plan, RerunPolicy,
    StatusCounts, WorkLeft, WorkerInfo,
};
use crate::domain::{PairName, WorkerId};
use crate::page_vec;
use crate::stages::Settings;
use crate::store::{ArtifactError, LockError, Project, RunLock, StoreError};
use clock::Clock;
use pair_task::RunContext;
use scheduler::{RunCounts, Scheduler};
use stage_executor::PipelineExecutor;
use steps::StageExecutor;
use timing::Timing;

/// Why a run could not go on. Pairs that fail are no error: they are in the summary.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Another process runs this project.
    #[error(transparent)]
    InUse(LockError),
    /// The lock files cannot be used.
    #[error(transparent)]
    Lock(LockError),
    /// Processes work on the project with other settings.
    #[error(
        "the run that goes on has other settings{}; give the same ones, or wait until it is over",
        listed(.0)
    )]
    OtherSettings(Vec<FieldChange>),
    /// Pairs were named that are not there.
    #[error("there is no pair {}", .0.iter().map(PairName::as_str).collect::<Vec<_>>().join(", "))]
    NoSuchPair(Vec<PairName>),
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// The project's directory refused.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// An artifact could not be written.
    #[error(transparent)]
    Artifact(#[from] ArtifactError),
}

/// `: register.smoothing_px: 1.0 -> 1.5`, or nothing where it cannot be told what differs.
fn listed(changes: &[FieldChange]) -> String {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    match changes.as_slice() {
        [] => String::new(),
        changes => format!(" ({})", changes.join(", ")),
    }
}

impl From<LockError> for RunError {
    fn from(error: LockError) -> Self {
        match error {
            LockError::InUse { .. } => Self::InUse(error),
            LockError::Io { .. } => Self::Lock(error),
        }
    }
}

/// The fingerprints of these settings.
pub fn fingerprints(settings: &Settings) -> Fingerprints {
    Fingerprints::new(|stage| settings.fingerprint_fields(stage))
}

/// What [`run`] would do, for `--dry-run`. Looks at the input files first, and notes what they are now.
///
/// # Errors
/// When a named pair is not there, or catalog or files refuse.
pub async fn plan(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
) -> Result<Plan, RunError> {
    let among = selection(catalog, options).await?;
    input_changes::inputs(project, catalog, among.as_ref()).await?;
    let names = options.pairs.as_deref();
    Ok(catalog
        .plan(&fingerprints(settings), names, options.again())
        .await?)
}

/// Runs what is left to run. Events go to `on_event` as they happen, from this future.
///
/// # Errors
/// When the project is in use, a named pair is not there, or catalog or disk refuse for good.
pub async fn run(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
    stop: &Stop,
    on_event: impl FnMut(RunEvent) + Send,
) -> Result<RunSummary, RunError> {
    page_vec::keep_memory(options.memory);
    let steps = Arc::new(PipelineExecutor::new(project, settings, options));
    let fingerprints = fingerprints(settings);
    run_steps(
        project,
        catalog,
        &fingerprints,
        steps,
        options,
        stop,
        on_event,
    )
    .await
}

/// [`run`] with any steps.
async fn run_steps(
    project: &Project,
    catalog: &Catalog,
    fingerprints: &Fingerprints,
    steps: Arc<dyn StageExecutor>,
    options: &RunOptions,
    stop: &Stop,
    mut on_event: impl FnMut(RunEvent) + Send,
) -> Result<RunSummary, RunError> {
    let clock = Clock::start();
    let among = selection(catalog, options).await?;
    let fingerprint_ids = catalog.register_fingerprints(fingerprints).await?;
    let mut lock = RunLock::acquire(project, options.join)?;
    agree(catalog, &mut lock, fingerprints).await?;
    let worker = catalog
        .register_worker(this_process(), fingerprint_ids, clock.now())
        .await?;
    let prepared = async {
        let recovered = take_over(project, catalog, &mut lock, worker, clock).await?;
        find_work(
            project,
            catalog,
            fingerprints,
            options,
            among.as_ref(),
            clock,
        )
        .await?;
        announce(catalog, options, among.as_ref(), recovered, &mut on_event).await
    };
    if let Err(error) = prepared.await {
        // What went wrong says more than that the end could not be noted either.
        let _ = catalog.end_worker(worker, clock.now()).await;
        return Err(error);
    }
    let (events, mut received) = mpsc::unbounded_channel();
    let shared = RunContext {
        catalog: catalog.clone(),
        project: project.clone(),
        steps,
        fingerprints: fingerprint_ids,
        clock,
        timing: Timing::of_this_build(),
        stop: stop.clone(),
        drain: Stop::new(),
        until: options.until,
        stage_limit: options.stage_limit,
        events,
        at_work_us: AtomicU64::new(0),
    };
    let shared = Arc::new(shared);
    let mut dispatch = Scheduler::new(Arc::clone(&shared), worker, among.clone(), options);
    let outcome = dispatch.run(&mut received, &mut on_event).await;
    // Said also after an error, so that this worker's end is not taken for a crash.
    let ended = catalog.end_worker(dispatch.worker(), clock.now()).await;
    let tally = outcome?;
    ended?;
    let status = catalog.status(fingerprints).await?;
    let left = catalog.work_left(options.until, among.as_ref()).await?;
    Ok(summary(&tally, left, status, &shared))
}

/// Sends back what changed and what is asked for, and makes ready what is due.
async fn find_work(
    project: &Project,
    catalog: &Catalog,
    fingerprints: &Fingerprints,
    options: &RunOptions,
    among: Option<&PairSelection>,
    clock: Clock,
) -> Result<(), RunError> {
    input_changes::inputs(project, catalog, among).await?;
    catalog
        .requeue_stale(fingerprints, among, options.again())
        .await?;
    let longest = policy::longest_backoff_ms();
    catalog.release_due_backoffs(clock.now(), longest).await?;
    Ok(())
}

/// Tells what lies before the run.
async fn announce(
    catalog: &Catalog,
    options: &RunOptions,
    among: Option<&PairSelection>,
    recovered: u64,
    on_event: &mut (impl FnMut(RunEvent) + Send),
) -> Result<(), RunError> {
    let left = catalog.work_left(options.until, among).await?;
    on_event(RunEvent::Started {
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

/// Holds this process to the settings of those that work already; the first one's settings are the run's.
async fn agree(
    catalog: &Catalog,
    lock: &mut RunLock,
    fingerprints: &Fingerprints,
) -> Result<(), RunError> {
    if lock.is_alone() {
        lock.set_terms(&fingerprints.terms())?;
        return Ok(());
    }
    let terms = lock.terms()?;
    if terms == fingerprints.terms() {
        return Ok(());
    }
    let changes = catalog.changes_from(&terms, fingerprints).await?;
    Err(RunError::OtherSettings(changes))
}

/// Brings back what a dead process left, where the lock proves that no other lives.
async fn take_over(
    project: &Project,
    catalog: &Catalog,
    lock: &mut RunLock,
    me: WorkerId,
    clock: Clock,
) -> Result<u64, RunError> {
    if !lock.is_alone() {
        return Ok(0);
    }
    let recovered = catalog
        .recover(DeadWorker::AllExcept(me), clock.now())
        .await?;
    input_changes::poisoned(project, catalog, &recovered.poisoned).await?;
    project.clear_temporary()?;
    lock.admit()?;
    Ok(recovered.ready)
}

async fn selection(
    catalog: &Catalog,
    options: &RunOptions,
) -> Result<Option<PairSelection>, RunError> {
    let Some(names) = &options.pairs else {
        return Ok(None);
    };
    let unknown = catalog.unknown_names(names).await?;
    if !unknown.is_empty() {
        return Err(RunError::NoSuchPair(unknown));
    }
    Ok(Some(catalog.select(names).await?))
}

fn summary(
    tally: &RunCounts,
    left: WorkLeft,
    status: StatusCounts,
    shared: &RunContext,
) -> RunSummary {
    RunSummary {
        done: tally.done,
        failed: tally.failed,
        stages: tally.stages,
        left: left.pairs,
        failed_in_all: left.quarantined,
        stopped: left.pairs > 0 && shared.stop.level() > StopLevel::Go,
        too_many_failures: tally.too_many_failures,
        at_work: Duration::from_micros(shared.at_work_us.load(Ordering::Relaxed)),
        elapsed_ms: shared.clock.elapsed_ms(),
        status,
    }
}

/// This process as the catalog knows it.
fn this_process() -> WorkerInfo {
    let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
    WorkerInfo {
        host: rustix::system::uname()
            .nodename()
            .to_string_lossy()
            .into_owned(),
        pid: std::process::id(),
        boot_id: boot_id.map(|id| id.trim().to_owned()),
    }
}

impl RunOptions {
    /// What to take up besides what changed.
    fn again(&self) -> RerunPolicy {
        match self.rerun {
            None | Some(Rerun::Stale) => RerunPolicy::Changed,
            Some(Rerun::Failed) => RerunPolicy::Failed,
            Some(Rerun::All) => RerunPolicy::All(self.from),
        }
    }
}
