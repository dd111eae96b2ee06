//! The task of one pair: receives each stage from the pair's compute thread, passes it to the checkpointer, and stores
//! a failure.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::checkpointer::{Checkpointer, PairFailure};
use super::compute_thread::{ComputeEvent, ComputeThread};
use super::error::RunError;
use super::events::RunEvent;
use super::folder_check::check_folders;
use super::input_changes;
use super::input_reads::ReadLimits;
use super::pair_context::{FileInUse, PairContext};
use super::run_context::{JobEnd, PairReport, RunContext};
use super::stop::{Stop, StopLevel};
use mocban_catalog::{InputVersions, Lease, PairAttributes, PairWork};
use mocban_core::domain::{Failure, FailureClass, Stage, WaitReason};
use mocban_store::ArtifactError;
use mocban_system::failpoint::{self, Point};
use mocban_system::platform::ActiveClock;

/// What is left to do for a pair when its stages are computed.
pub(super) enum PairOutcome {
    /// Nothing.
    Ended(PairReport),
    /// To wait until its last stages are stored.
    Storing(Checkpointer),
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

/// Describes a stage that took too long, and the input file that it was reading.
fn timeout_text(stage: Stage, timeout: Duration, reading: Option<PathBuf>) -> String {
    let seconds = timeout.as_secs_f64();
    let text = format!("{stage} took longer than {seconds} s");
    match reading {
        Some(path) => format!(
            "{text} while it read {}; its disk or network may hang",
            path.display()
        ),
        None => text,
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

/// Data that is stored if the pair fails. The task keeps this copy, because the thread's data is lost if the thread
/// hangs or panics.
struct PairSummary {
    attributes: PairAttributes,
    attributes_json: String,
    inputs: InputVersions,
    file_in_use: FileInUse,
}

impl PairSummary {
    fn of(pair: &PairContext) -> Self {
        Self {
            attributes: pair.attributes.clone(),
            attributes_json: pair.attributes_json.clone(),
            inputs: pair.inputs.clone(),
            file_in_use: pair.file_in_use.clone(),
        }
    }

    /// Returns the versions of the input files that the thread reported. For an unreported file, returns the current
    /// version, if it can be read. Later runs compare the files with these versions to notice a replacement.
    async fn inputs_now(&self, context: &RunContext) -> InputVersions {
        let read = self.inputs.clone();
        if read.mesh.is_some() && read.print.is_some() {
            return read;
        }
        let paths = [&self.attributes.mesh_path, &self.attributes.print_path]
            .map(|path| context.project.input(path));
        let limits = ReadLimits {
            timeout: context.stage_timeout.min(MAX_REREAD),
            stop: context.stop.clone(),
            until: StopLevel::Now,
        };
        let [mesh, print] = input_changes::current_of_both(paths, &limits).await;
        InputVersions {
            mesh: read.mesh.or(mesh),
            print: read.print.or(print),
        }
    }
}

/// Longest time for reading the input files again after a stage hung or panicked.
const MAX_REREAD: Duration = Duration::from_secs(30);

/// How a stage failed.
struct FailedStage {
    failure: Failure,
    /// Whether a retry may succeed.
    is_transient: bool,
    /// The input files as read, if the pair's data was not lost.
    inputs: Option<InputVersions>,
    ms: Option<u64>,
}

impl FailedStage {
    /// A failure after which the pair's data is lost.
    fn without_pair(class: FailureClass, text: String) -> Self {
        Self {
            failure: Failure::new(class, text),
            is_transient: false,
            inputs: None,
            ms: None,
        }
    }
}
