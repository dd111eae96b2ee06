//! The task of one pair: starts the pair's compute thread, passes each stage to the checkpointer, cancels the thread if
//! later stages cannot be stored, and stores a failure.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;

use super::checkpointer::{Checkpointer, PairFailure};
use super::compute_thread::{ComputeEvent, run_stages};
use super::error::RunError;
use super::events::RunEvent;
use super::failed_stage::{FailedStage, PairSummary, timeout_text};
use super::folder_check::check_folders;
use super::pair_context::{FileInUse, PairContext};
use super::run_context::{JobEnd, PairReport, RunContext};
use super::stop::{Stop, StopLevel};
use mocban_catalog::{Lease, PairWork};
use mocban_core::domain::cancel::{CancelGuard, CancelToken};
use mocban_core::domain::{FailureClass, Stage, WaitReason};
use mocban_store::ArtifactError;
use mocban_system::failpoint::{self, Point};
use mocban_system::platform::{ActiveClock, sleep_active};

/// What is left to do for a pair when its stages are computed.
pub(super) enum PairOutcome {
    /// Nothing.
    Ended(PairReport),
    /// To wait until its last stages are stored.
    Storing(Checkpointer),
}

/// Longest time to wait for the end of cancelled work. Only work that waits for a file takes longer. Unit tests wait longer,
/// because they also run on busy machines.
const LONGEST_END: Duration = Duration::from_millis(if cfg!(test) { 3_000 } else { 500 });

/// Waits until the cancelled work of a pair or block has returned its memory, but not longer than [`LONGEST_END`].
pub(super) async fn wait_for_end<T>(ended: impl Future<Output = T>) {
    if tokio::time::timeout(LONGEST_END, ended).await.is_err() {
        tracing::warn!("a thread still waits for a file; its memory no longer counts for --memory");
    }
}

/// The thread that computes the stages of a pair. If this handle is dropped, the computation is cancelled.
#[derive(Debug)]
pub(super) struct ComputeThread {
    /// Closed when the thread has returned the pair's memory.
    events: mpsc::UnboundedReceiver<ComputeEvent>,
    token: CancelGuard,
}

impl ComputeThread {
    /// Starts a thread that computes a pair's stages from `first` on.
    ///
    /// # Errors
    /// Returns an error if the system cannot start a thread. In that case the pair's data is lost.
    pub(super) fn start(
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
    pub(super) async fn end(mut self) {
        self.token.0.cancel();
        let ended = async { while self.events.recv().await.is_some() {} };
        wait_for_end(ended).await;
    }

    /// Waits for the next event, for at most as long as one stage may take. Time while the process is suspended does not
    /// count.
    pub(super) async fn next_event(&mut self, timeout: Duration, stop: &Stop) -> ComputeEvent {
        tokio::select! {
            biased;
            event = self.events.recv() => event.unwrap_or_else(|| {
                ComputeEvent::Panicked("the pair's thread ended without an event".to_owned())
            }),
            () = stop.reached(StopLevel::Now) => ComputeEvent::Stopped,
            () = sleep_active(timeout) => ComputeEvent::TimedOut,
        }
    }
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
            ComputeEvent::Failed {
                failure,
                is_transient,
                inputs,
                ms,
            } => {
                break FailedStage {
                    failure,
                    is_transient,
                    inputs: Some(inputs),
                    ms: Some(ms),
                };
            }
            ComputeEvent::StoreFailed(error) => {
                return PairOutcome::Ended(end_without_store(checkpointer, error).await);
            }
            ComputeEvent::Panicked(text) => {
                break FailedStage::without_pair(FailureClass::Bug, text);
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

/// Longest time for which a file is read after a stop request. It includes decoding, so it is longer than that of the
/// largest usual scans.
const LONGEST_READ_AFTER_STOP: Duration = Duration::from_secs(5);
/// Interval at which the file in use is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Waits for a stop request, and then until one file has been read for too long: its disk or object store may be
/// unavailable.
async fn reading_after_stop(file: &FileInUse, stop: &Stop) {
    stop.reached(StopLevel::Drain).await;
    let mut clock = ActiveClock::start(2 * LOOK_EVERY);
    let (mut path, mut since) = (file.get(), clock.now());
    loop {
        tokio::time::sleep(LOOK_EVERY).await;
        let (found, now) = (file.get(), clock.now());
        if found != path {
            (path, since) = (found, now);
        } else if path.is_some() && now.saturating_sub(since) >= LONGEST_READ_AFTER_STOP {
            return;
        }
    }
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
