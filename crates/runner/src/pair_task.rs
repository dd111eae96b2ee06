//! The task of one pair: starts the pair's thread, passes each stage to the checkpointer, cancels the thread if
//! later stages cannot be stored, and stores a failure.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;

use super::blocking::{panic_text, wait_for_end};
use super::checkpointer::{Checkpointer, PairFailure};
use super::error::RunError;
use super::events::RunEvent;
use super::failed_stage::{FailedStage, PairSummary, timeout_text};
use super::folder_check::check_folders;
use super::pair_context::{PairContext, reading_after_stop};
use super::pair_stage::{ComputedStage, run_stage};
use super::run_context::{JobEnd, PairReport, RunContext};
use super::stage_output::PairStageError;
use super::stop::{Stop, StopLevel};
use mocban_catalog::{InputVersions, Lease, PairWork};
use mocban_core::domain::cancel::{CancelGuard, CancelToken, Cancelled};
use mocban_core::domain::{FailureClass, Stage, WaitReason};
use mocban_store::ArtifactError;
use mocban_system::failpoint::{self, Point};
use mocban_system::platform::sleep_active;

/// What is left to do for a pair when its stages are computed.
pub(super) enum PairOutcome {
    /// Nothing.
    Ended(PairReport),
    /// To wait until its last stages are stored.
    Storing(Checkpointer),
}

/// What happens on a pair's thread.
#[derive(Debug)]
enum ComputeEvent {
    /// A stage starts. The input files as read so far.
    Started(Stage, InputVersions),
    /// A stage is computed. The stage that follows, if any.
    Finished(Box<ComputedStage>, Option<Stage>),
    /// A stage failed or panicked; this is the last event.
    Failed(FailedStage),
    /// An object store failed; this is the last event.
    StoreFailed(ArtifactError),
    /// A stage took too long.
    TimedOut,
    /// The run is to stop at once.
    Stopped,
    /// Later stages cannot be stored: the lease is lost, or an earlier stage was not stored.
    Cancelled,
}

/// The thread that computes the stages of a pair one after another. If this handle is dropped, the computation is cancelled.
///
/// Each pair has its own thread instead of one from a pool. A stage past its deadline is cancelled; if it hangs in the
/// system, its thread can be abandoned without blocking other pairs. All stages of a pair run on the same thread, because
/// waking another thread for each stage can leave a core idle for some milliseconds.
#[derive(Debug)]
struct ComputeThread {
    /// Closed when the thread has returned the pair's memory.
    events: mpsc::UnboundedReceiver<ComputeEvent>,
    token: CancelGuard,
}

impl ComputeThread {
    /// Starts a thread that computes a pair's stages from `first` on.
    ///
    /// # Errors
    /// Returns an error if the system cannot start a thread. In that case the pair's data is lost.
    fn start(
        context: Arc<RunContext>,
        first: Stage,
        pair: Box<PairContext>,
    ) -> std::io::Result<Self> {
        let (sender, events) = mpsc::unbounded_channel();
        let token = CancelToken::default();
        let inner = token.clone();
        let thread = std::thread::Builder::new().name(pair.attributes.name.to_string());
        thread.spawn(move || run_stages(&context, first, pair, &inner, &sender))?;
        Ok(Self {
            events,
            token: CancelGuard(token),
        })
    }

    /// Cancels the computation and waits until the pair's memory is free, so that no other pair gets it before.
    async fn end(mut self) {
        self.token.0.cancel();
        let ended = async { while self.events.recv().await.is_some() {} };
        wait_for_end(ended).await;
    }

    /// Waits for the next event, for at most as long as one stage may take. Time while the process is suspended does not
    /// count.
    async fn next_event(&mut self, timeout: Duration, stop: &Stop) -> ComputeEvent {
        tokio::select! {
            biased;
            event = self.events.recv() => event.unwrap_or_else(|| {
                panicked("the pair's thread ended without an event".to_owned())
            }),
            () = stop.reached(StopLevel::Now) => ComputeEvent::Stopped,
            () = sleep_active(timeout) => ComputeEvent::TimedOut,
        }
    }
}

/// Computes stages until none is left, a stage fails, the computation is cancelled, or the receiver of the events is
/// closed.
fn run_stages(
    context: &RunContext,
    mut stage: Stage,
    mut pair: Box<PairContext>,
    token: &CancelToken,
    events: &mpsc::UnboundedSender<ComputeEvent>,
) {
    let last = loop {
        let started = ComputeEvent::Started(stage, pair.inputs.clone());
        if events.send(started).is_err() {
            return;
        }
        let begun = Instant::now();
        let work = || token.run(|| run_stage(context, stage, &mut pair));
        let outcome = match catch_unwind(AssertUnwindSafe(work)) {
            Ok(Ok(outcome)) => outcome,
            Ok(Err(Cancelled)) => return,
            Err(payload) => break panicked(panic_text(&*payload)),
        };
        match outcome {
            Ok(computed) => match context.next_stage(stage) {
                Some(next) => {
                    // A closed channel is noticed when the next stage starts.
                    let _ = events.send(ComputeEvent::Finished(Box::new(computed), Some(next)));
                    stage = next;
                }
                None => break ComputeEvent::Finished(Box::new(computed), None),
            },
            Err(PairStageError::RerunFrom(earlier)) => stage = earlier,
            Err(PairStageError::Store(error)) => break ComputeEvent::StoreFailed(error),
            Err(PairStageError::Failed {
                failure,
                is_transient,
            }) => {
                break ComputeEvent::Failed(FailedStage {
                    failure,
                    is_transient,
                    inputs: Some(pair.inputs.clone()),
                    ms: Some(begun.elapsed().as_millis() as u64),
                });
            }
        }
    };
    // Free the pair's memory before the scheduler gives it to another pair.
    drop(pair);
    let _ = events.send(last);
}

/// Describes a panic, after which the pair's data is lost.
fn panicked(text: String) -> ComputeEvent {
    ComputeEvent::Failed(FailedStage::without_pair(FailureClass::Bug, text))
}

/// Computes the remaining stages of a leased pair. Earlier stages are stored while later stages are computed.
pub(super) async fn process_pair(
    context: Arc<RunContext>,
    lease: Lease,
    work: PairWork,
) -> PairOutcome {
    let first = lease.cursor();
    let pair = Box::new(PairContext::new(work));
    failpoint::hit(first, Point::Claimed, Some(&pair.attributes.name));
    let known = PairSummary::of(&pair);
    let checkpointer =
        Checkpointer::start(Arc::clone(&context), known.attributes.name.clone(), lease);
    match ComputeThread::start(Arc::clone(&context), first, pair) {
        Ok(thread) => compute(&context, checkpointer, thread, first, known).await,
        Err(error) => {
            let text = format!("the system gave no thread for {first}: {error}");
            let failed = FailedStage::without_pair(FailureClass::Resource, text);
            PairOutcome::Ended(fail(&context, checkpointer, first, known, failed).await)
        }
    }
}

/// Follows the pair's thread to its end.
async fn compute(
    context: &RunContext,
    checkpointer: Checkpointer,
    mut thread: ComputeThread,
    mut stage: Stage,
    mut pair: PairSummary,
) -> PairOutcome {
    let timeout = context.stage_timeout;
    let failed = loop {
        let event = tokio::select! {
            biased;
            event = thread.next_event(timeout, &context.stop) => event,
            () = reading_after_stop(&pair.file_in_use, &context.stop) => ComputeEvent::Stopped,
            () = checkpointer.closed() => ComputeEvent::Cancelled,
        };
        match event {
            ComputeEvent::Started(started, inputs) => {
                (stage, pair.inputs) = (started, inputs);
                let pair = pair.attributes.name.clone();
                context.emit(RunEvent::StageStarted { pair, stage });
            }
            ComputeEvent::Finished(computed, next) => {
                if !checkpointer.store(*computed) {
                    return end_cancelled(checkpointer, thread).await;
                }
                match next {
                    Some(_) => {}
                    None if stage < context.until => {
                        return PairOutcome::Ended(checkpointer.finish(JobEnd::Released).await);
                    }
                    None => return PairOutcome::Storing(checkpointer),
                }
            }
            ComputeEvent::Failed(failed) => break failed,
            ComputeEvent::StoreFailed(error) => {
                return PairOutcome::Ended(end_without_store(checkpointer, error).await);
            }
            ComputeEvent::TimedOut => {
                let text = timeout_text(stage, timeout, pair.file_in_use.get());
                thread.end().await;
                break FailedStage::without_pair(FailureClass::Resource, text);
            }
            ComputeEvent::Cancelled => return end_cancelled(checkpointer, thread).await,
            ComputeEvent::Stopped => {
                return PairOutcome::Ended(checkpointer.finish(JobEnd::Released).await);
            }
        }
    };
    PairOutcome::Ended(fail(context, checkpointer, stage, pair, failed).await)
}

/// Cancels a pair whose later stages cannot be stored.
async fn end_cancelled(checkpointer: Checkpointer, thread: ComputeThread) -> PairOutcome {
    thread.end().await;
    PairOutcome::Ended(checkpointer.finish(JobEnd::Released).await)
}

/// Releases a pair whose files an object store did not give. If the store is unavailable, the pair is tried again
/// later. Any other error, such as refused credentials, concerns all pairs and ends the run.
async fn end_without_store(checkpointer: Checkpointer, error: ArtifactError) -> PairReport {
    let report = checkpointer.finish(JobEnd::Released).await;
    if error.is_unavailable() {
        tracing::warn!("{error}; the pair is tried again");
        return report;
    }
    PairReport {
        end: report.end.and(Err(error.into())),
        ..report
    }
}

/// Stores a failure once the stages before it are stored.
async fn fail(
    context: &RunContext,
    checkpointer: Checkpointer,
    stage: Stage,
    pair: PairSummary,
    failed: FailedStage,
) -> PairReport {
    let begun = Instant::now();
    let settled = match checkpointer.settle().await {
        Ok(settled) => settled,
        Err(error) => return PairReport::failed(error),
    };
    let stages = settled.stages;
    let lease = match settled.into_lease() {
        Ok(lease) => lease,
        Err(settled) => return settled.finish(context, JobEnd::Released).await,
    };
    let end = store_failure(context, lease, stage, pair, failed).await;
    let waited = begun.elapsed();
    context.metrics.add_wait(WaitReason::Database, waited);
    PairReport { end, stages }
}

async fn store_failure(
    context: &RunContext,
    lease: Lease,
    stage: Stage,
    pair: PairSummary,
    failed: FailedStage,
) -> Result<JobEnd, RunError> {
    let paths = [&pair.attributes.mesh_path, &pair.attributes.print_path];
    if let Err(error) = check_folders(context, paths.map(String::clone)).await {
        if let Err(error) = context.catalog.release(lease).await {
            tracing::warn!(%error, "the pair could not be given back");
        }
        return Err(error);
    }
    let inputs = match failed.inputs {
        Some(inputs) => inputs,
        None => pair.inputs_now(context).await,
    };
    let failed = PairFailure {
        name: pair.attributes.name,
        attributes: pair.attributes_json,
        stage,
        failure: failed.failure,
        is_transient: failed.is_transient,
        inputs,
        ms: failed.ms,
    };
    failed.store(context, lease).await
}
