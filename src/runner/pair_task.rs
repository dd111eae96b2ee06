//! One pair's way: the stages that are left, a checkpoint after each.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;

use super::RunError;
use super::checkpointer::Checkpointer;
use super::clock::Clock;
use super::compute_thread::{ComputeEvent, ComputeThread};
use super::events::RunEvent;
use super::input_changes;
use super::pair_context::PairContext;
use super::policy::{self, FailedAttempt};
use super::steps::StageExecutor;
use super::stop::{Stop, StopLevel};
use super::timing::Timing;
use crate::catalog::{
    Catalog, FailureAction, FingerprintIds, InputVersions, Lease, PairWork, StageFailure,
};
use crate::domain::{Failure, FailureClass, PairName, Stage, UnixMillis};
use crate::failpoint::{self, Point};
use crate::store::Project;

/// What the pairs of a run have in common.
pub(super) struct RunContext {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) steps: Arc<dyn StageExecutor>,
    pub(super) fingerprints: FingerprintIds,
    pub(super) clock: Clock,
    pub(super) timing: Timing,
    pub(super) stop: Stop,
    /// Raised when the run drains for a reason of its own.
    pub(super) drain: Stop,
    pub(super) until: Stage,
    pub(super) stage_limit: Duration,
    pub(super) events: mpsc::UnboundedSender<RunEvent>,
    /// Microseconds that threads were computing stages.
    pub(super) at_work_us: AtomicU64,
}

/// How a pair left its worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PairEnd {
    /// Done as far as the run goes.
    Done,
    /// Quarantined.
    Failed,
    /// To be tried again.
    Later,
    /// Given back unfinished.
    GivenBack,
    /// Somebody else has it now.
    Lost,
}

/// What a worker has to say at the end of a pair.
#[derive(Debug)]
pub(super) struct PairReport {
    pub(super) end: PairEnd,
    /// Stages that were computed and stored.
    pub(super) stages: u64,
    /// Why the run cannot go on, if it cannot.
    pub(super) fatal: Option<RunError>,
}

/// What is stored with a failure even when the pair in hand is gone.
struct PairInputs {
    name: PairName,
    attributes: String,
    mesh_path: String,
    print_path: String,
    inputs: InputVersions,
}

/// What went wrong.
struct FailedStage {
    failure: Failure,
    /// Whether another try may go better.
    is_transient: bool,
    /// Input files as read, where the pair came back.
    inputs: Option<InputVersions>,
    ms: Option<u64>,
}

impl RunContext {
    /// Whether nothing new is to be begun.
    pub(super) fn is_draining(&self) -> bool {
        self.stop.level().max(self.drain.level()) >= StopLevel::Drain
    }

    pub(super) fn deadline(&self) -> UnixMillis {
        self.clock.now() + self.stage_limit.as_millis() as i64
    }

    /// How far back this process's last sign of life may lie for its leases to stand.
    pub(super) fn alive_since(&self) -> UnixMillis {
        self.clock.now() - self.timing.lease_ms()
    }

    fn note(&self, took: Duration) {
        let us = took.as_micros() as u64;
        self.at_work_us.fetch_add(us, Ordering::Relaxed);
    }

    pub(super) fn tell(&self, event: RunEvent) {
        // The run may have ended by an error; then nobody listens any more.
        let _ = self.events.send(event);
    }
}

/// A pair that its thread is done with.
pub(super) enum PairOutcome {
    /// All is stored.
    Ended(PairReport),
    /// Its last stages are on their way: what is left is to wait until it is [`Checkpointer::done`].
    Storing(Checkpointer),
}

/// Takes a leased pair through the stages that are left. Each is computed while those before it are on their way to the
/// disk.
pub(super) async fn work(shared: Arc<RunContext>, lease: Lease, work: PairWork) -> PairOutcome {
    let stage = lease.cursor();
    let pair = Box::new(PairContext::new(work));
    failpoint::hit(stage, Point::Claimed, Some(&pair.attributes.name));
    let mut held = Checkpointer::new(Arc::clone(&shared), pair.attributes.name.clone(), lease);
    match through(&shared, &mut held, stage, pair).await {
        Ok(PairEnd::Done) if held.is_storing() => PairOutcome::Storing(held),
        end => PairOutcome::Ended(held.report(end).await),
    }
}

async fn through(
    shared: &Arc<RunContext>,
    held: &mut Checkpointer,
    mut stage: Stage,
    pair: Box<PairContext>,
) -> Result<PairEnd, RunError> {
    let mut known = PairInputs::of(&pair);
    let (limit, asked) = (shared.stage_limit, Arc::clone(shared));
    let next = move |done| next(&asked, done);
    let mut computing = match ComputeThread::begin(&shared.steps, stage, pair, next) {
        Ok(computing) => computing,
        Err(error) => {
            let text = format!("the system gave no thread for {stage}: {error}");
            let blame = FailedStage::bare(FailureClass::Resource, text);
            return fail(shared, held, stage, known, blame).await;
        }
    };
    loop {
        let blame = match computing.next(limit, &shared.stop).await {
            ComputeEvent::Started(begun, inputs) => {
                (stage, known.inputs) = (begun, inputs);
                let pair = known.name.clone();
                shared.tell(RunEvent::StageStarted { pair, stage });
                continue;
            }
            ComputeEvent::Finished(finished, next) => {
                shared.note(finished.took);
                if !held.store(*finished).await? {
                    return Ok(PairEnd::Lost);
                }
                match next {
                    Some(_) => continue,
                    None if stage < shared.until => return Ok(PairEnd::GivenBack),
                    None => return Ok(PairEnd::Done),
                }
            }
            ComputeEvent::Failed {
                failure,
                is_transient,
                inputs,
                took,
            } => {
                shared.note(took);
                FailedStage {
                    failure,
                    is_transient,
                    inputs: Some(inputs),
                    ms: Some(took.as_millis() as u64),
                }
            }
            ComputeEvent::Panicked(text) => FailedStage::bare(FailureClass::Bug, text),
            ComputeEvent::TimedOut => {
                let text = format!("{stage} took longer than {} s", limit.as_secs_f64());
                FailedStage::bare(FailureClass::Resource, text)
            }
            ComputeEvent::Stopped => return Ok(PairEnd::GivenBack),
        };
        return fail(shared, held, stage, known, blame).await;
    }
}

/// The stage after this one, if the run goes so far.
fn next(shared: &RunContext, done: Stage) -> Option<Stage> {
    done.next()
        .filter(|next| *next <= shared.until && !shared.is_draining())
}

/// Stores a failure and tells of it.
async fn fail(
    shared: &RunContext,
    held: &mut Checkpointer,
    stage: Stage,
    known: PairInputs,
    blame: FailedStage,
) -> Result<PairEnd, RunError> {
    let Some(lease) = held.lease().await? else {
        return Ok(PairEnd::Lost);
    };
    let inputs = match blame.inputs {
        Some(inputs) => inputs,
        None => known.inputs(&shared.project).await,
    };
    let now = shared.clock.now();
    let failed = FailedAttempt {
        pair: lease.pair(),
        class: blame.failure.class,
        is_transient: blame.is_transient,
        attempt: lease.attempt(),
        exclusive: lease.exclusive(),
    };
    let action = policy::action(failed, now);
    let failed = StageFailure {
        stage,
        failure: blame.failure.clone(),
        action,
        fingerprint: shared.fingerprints.of(stage),
        attributes: known.attributes,
        inputs,
        ms: blame.ms,
        at: now,
        alive_since: shared.alive_since(),
    };
    if !shared.catalog.fail(lease, failed).await? {
        return Ok(PairEnd::Lost);
    }
    let (event, end) = told(shared, stage, action, known.name, blame.failure, now);
    shared.tell(event);
    Ok(end)
}

/// What is told of a failure, and how the pair leaves its worker.
fn told(
    shared: &RunContext,
    stage: Stage,
    action: FailureAction,
    pair: PairName,
    failure: Failure,
    now: UnixMillis,
) -> (RunEvent, PairEnd) {
    let wait_ms = match action {
        FailureAction::BackOff { run_at } => (run_at - now).unsigned_abs(),
        FailureAction::RetryExclusive => 0,
        FailureAction::Quarantine => {
            let skipped = (shared.until.index() + 1).saturating_sub(stage.index()) as u64;
            let event = RunEvent::PairFailed {
                pair,
                stage,
                failure,
                skipped,
            };
            return (event, PairEnd::Failed);
        }
    };
    let event = RunEvent::PairBackingOff {
        pair,
        stage,
        failure,
        wait_ms,
    };
    (event, PairEnd::Later)
}

impl PairInputs {
    fn of(pair: &PairContext) -> Self {
        Self {
            name: pair.attributes.name.clone(),
            attributes: pair.attributes_json.clone(),
            mesh_path: pair.attributes.mesh_path.clone(),
            print_path: pair.attributes.print_path.clone(),
            inputs: pair.inputs.clone(),
        }
    }

    /// The input files as they were read, or as they are now where the reader was lost: a file that is mended later
    /// must be told from the one that failed.
    async fn inputs(&self, project: &Project) -> InputVersions {
        let seen = self.inputs.clone();
        let paths = [&self.mesh_path, &self.print_path].map(|path| project.input_path(path));
        let look = move || InputVersions {
            mesh: seen.mesh.or_else(|| input_changes::seen_now(&paths[0])),
            print: seen.print.or_else(|| input_changes::seen_now(&paths[1])),
        };
        match tokio::task::spawn_blocking(look).await {
            Ok(inputs) => inputs,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
}

impl FailedStage {
    /// A failure after which nothing is left of the pair in hand.
    fn bare(class: FailureClass, text: String) -> Self {
        Self {
            failure: Failure::new(class, text),
            is_transient: false,
            inputs: None,
            ms: None,
        }
    }
}
