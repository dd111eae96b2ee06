//! Computes the stages of a pair one after another on the pair's own thread, and reports them to the pair's task
//! (`pair_task.rs`).
//!
//! Each pair has its own thread instead of one from a pool. A stage past its deadline is cancelled; if it hangs in the
//! system, its thread can be abandoned without blocking other pairs. All stages of a pair run on the same thread, because waking another thread
//! for each stage can leave a core idle for some milliseconds.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::mpsc;

use super::blocking::panic_text;
use super::pair_context::{PairContext, StoredStage};
use super::run_context::RunContext;
use super::stage_output::{self, PairStageError, PairStageOutput};
use mocban_catalog::{InputVersions, PairProvenance, StageCheckpoint};
use mocban_core::domain::cancel::{CancelToken, Cancelled};
use mocban_core::domain::{ArtifactSet, Failure, FailureClass, Stage};
use mocban_store::{ArtifactError, NewArtifact};
use mocban_system::failpoint::{self, Point};

/// A computed stage: its catalog row, and the files that must be on the disk before the row is stored.
pub(super) type ComputedStage = (StageCheckpoint, Vec<NewArtifact>);

/// What happens on a pair's thread.
#[derive(Debug)]
pub(super) enum ComputeEvent {
    /// A stage starts. The input files as read so far.
    Started(Stage, InputVersions),
    /// A stage is computed. The stage that follows, if any.
    Finished(Box<ComputedStage>, Option<Stage>),
    /// A stage failed; this is the last event.
    Failed {
        failure: Failure,
        /// Whether a retry may succeed.
        is_transient: bool,
        /// The input files as read.
        inputs: InputVersions,
        ms: u64,
    },
    /// An object store failed; this is the last event.
    StoreFailed(ArtifactError),
    /// A stage panicked; the pair's data is lost.
    Panicked(String),
    /// A stage took too long.
    TimedOut,
    /// The run is to stop at once.
    Stopped,
    /// Later stages cannot be stored: the lease is lost, or an earlier stage was not stored.
    Cancelled,
}

/// Computes stages until none is left, a stage fails, the computation is cancelled, or the receiver of the events is
/// closed.
pub(super) fn run_stages(
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
            Ok(Ok(outcome)) => Ok(outcome),
            Ok(Err(Cancelled)) => return,
            Err(payload) => Err(payload),
        };
        match outcome {
            Ok(Ok(computed)) => match context.next_stage(stage) {
                Some(next) => {
                    // A closed channel is noticed when the next stage starts.
                    let _ = events.send(ComputeEvent::Finished(Box::new(computed), Some(next)));
                    stage = next;
                }
                None => break ComputeEvent::Finished(Box::new(computed), None),
            },
            Ok(Err(PairStageError::RerunFrom(earlier))) => stage = earlier,
            Ok(Err(PairStageError::Store(error))) => break ComputeEvent::StoreFailed(error),
            Ok(Err(PairStageError::Failed {
                failure,
                is_transient,
            })) => {
                break ComputeEvent::Failed {
                    failure,
                    is_transient,
                    inputs: pair.inputs.clone(),
                    ms: begun.elapsed().as_millis() as u64,
                };
            }
            Err(payload) => break ComputeEvent::Panicked(panic_text(&*payload)),
        }
    };
    // Free the pair's memory before the scheduler gives it to another pair.
    drop(pair);
    let _ = events.send(last);
}

/// Runs one stage, and keeps its outcome in the pair for later stages.
fn run_stage(
    context: &RunContext,
    stage: Stage,
    pair: &mut PairContext,
) -> Result<ComputedStage, PairStageError> {
    let begun = Instant::now();
    let output = context.pairs.run(stage, pair);
    let elapsed = begun.elapsed();
    context.add_compute_time(stage, elapsed);
    let PairStageOutput {
        outcome,
        files,
        metrics,
    } = output?;
    failpoint::hit(stage, Point::Computed, Some(&pair.attributes.name));
    let Some(mesh_hash) = pair.mesh_hash() else {
        let text = "a stage finished before the mesh was read";
        return Err(PairStageError::failed(FailureClass::Bug, text));
    };
    let print_hash = pair.print_hash();
    let artifacts = files.iter();
    let artifacts = artifacts.map(|file| (file.role().to_owned(), file.reference().clone()));
    let artifacts: ArtifactSet = artifacts.collect();
    let depth = pair.stored.get(&Stage::Depth).map(|stored| &stored.files);
    let metrics = stage_output::metric_results(&metrics, &artifacts, depth);
    let json = outcome.to_string();
    let stored = StoredStage {
        outcome,
        files: artifacts.clone(),
        mesh_hash,
        print_hash,
    };
    pair.stored.insert(stage, stored);
    let checkpoint = StageCheckpoint {
        stage,
        provenance: PairProvenance {
            fingerprint: context.fingerprints.of(stage),
            mesh_hash: Some(mesh_hash),
            print_hash,
            attributes: pair.attributes_json.clone(),
        },
        result_hash: stage_output::result_hash(&json, &artifacts),
        outcome: json,
        files: artifacts,
        metrics,
        inputs: pair.unreported_inputs(),
        ms: elapsed.as_millis() as u64,
        at: context.clock.now(),
        next_deadline: context.deadline(),
        alive_since: context.alive_since(),
        write_began: Instant::now(),
    };
    Ok((checkpoint, files))
}
