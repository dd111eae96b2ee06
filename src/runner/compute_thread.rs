//! The one bridge from tokio to computing: the stages of a pair run one after another on a thread of their own.
//!
//! A thread a pair, rather than a pool, so that one that hangs past its deadline can be left behind without taking a
//! place from the others. And not a thread a stage: a core that waits for a thread to be handed its work is idle for
//! as long as the system takes to see it, often until its next tick some milliseconds later.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;

use super::pair_context::{PairContext, StoredStage};
use super::stage_output;
use super::steps::{ExecutionError, StageExecutor, StageOutput};
use super::stop::{Stop, StopLevel};
use crate::catalog::{InputVersions, MetricResult};
use crate::domain::{ArtifactSet, ContentHash, Failure, FailureClass, Stage, sanitize};
use crate::failpoint::{self, Point};
use crate::store::NewArtifact;

/// A stage that is computed, and the files that must be on disk before a row names them.
#[derive(Debug)]
pub(super) struct ComputedStage {
    pub(super) stage: Stage,
    pub(super) outcome: String,
    pub(super) files: Vec<NewArtifact>,
    /// How the files will be named.
    pub(super) named: ArtifactSet,
    pub(super) result_hash: ContentHash,
    pub(super) metrics: Vec<MetricResult>,
    pub(super) mesh_hash: ContentHash,
    pub(super) print_hash: Option<ContentHash>,
    pub(super) attributes: String,
    /// Input files as read, if no stage before told them.
    pub(super) inputs: InputVersions,
    pub(super) took: Duration,
}

/// What happens on a pair's thread.
#[derive(Debug)]
pub(super) enum ComputeEvent {
    /// A stage begins; the input files as read until now.
    Started(Stage, InputVersions),
    /// A stage is computed; which one comes next, unless it was the last one.
    Finished(Box<ComputedStage>, Option<Stage>),
    /// A stage failed; the last that comes.
    Failed {
        /// Class and message.
        failure: Failure,
        /// Whether another try may go better.
        is_transient: bool,
        /// Input files as read.
        inputs: InputVersions,
        /// How long it took.
        took: Duration,
    },
    /// A stage panicked; the pair in hand is lost with it.
    Panicked(String),
    /// It took too long; its thread is left behind.
    TimedOut,
    /// The run is to stop now; the thread is left behind.
    Stopped,
}

/// A pair whose stages are computed. When it is dropped, the stage in hand is the last.
#[derive(Debug)]
pub(super) struct ComputeThread(mpsc::UnboundedReceiver<ComputeEvent>);

impl ComputeThread {
    /// Computes stages of a pair from this one on. What comes after a stage is asked on the pair's thread.
    ///
    /// # Errors
    /// When the system gives no thread; then the pair in hand is lost.
    pub(super) fn begin(
        steps: &Arc<dyn StageExecutor>,
        stage: Stage,
        pair: Box<PairContext>,
        next: impl Fn(Stage) -> Option<Stage> + Send + 'static,
    ) -> std::io::Result<Self> {
        let (sender, receiver) = mpsc::unbounded_channel();
        let steps = Arc::clone(steps);
        let thread = std::thread::Builder::new().name(pair.attributes.name.to_string());
        thread.spawn(move || through(&*steps, stage, pair, next, &sender))?;
        Ok(Self(receiver))
    }

    /// What happens next. No stage may take longer than the limit.
    pub(super) async fn next(&mut self, limit: Duration, stop: &Stop) -> ComputeEvent {
        tokio::select! {
            biased;
            computed = self.0.recv() => computed.unwrap_or_else(|| {
                ComputeEvent::Panicked("the thread of the stages ended without a word".to_owned())
            }),
            () = stop.reached(StopLevel::Now) => ComputeEvent::Stopped,
            () = tokio::time::sleep(limit) => ComputeEvent::TimedOut,
        }
    }
}

/// Takes a pair through its stages, until there is none left or nobody listens any more.
fn through(
    steps: &dyn StageExecutor,
    mut stage: Stage,
    mut pair: Box<PairContext>,
    next: impl Fn(Stage) -> Option<Stage>,
    to: &mpsc::UnboundedSender<ComputeEvent>,
) {
    let last = loop {
        if to
            .send(ComputeEvent::Started(stage, pair.inputs.clone()))
            .is_err()
        {
            return;
        }
        let begun = Instant::now();
        let work = AssertUnwindSafe(|| run(steps, stage, &mut pair, begun));
        match catch_unwind(work) {
            Ok(Ok(finished)) => match next(stage) {
                Some(later) => {
                    // Whether somebody listens is seen when the next stage begins.
                    let _ = to.send(ComputeEvent::Finished(Box::new(finished), Some(later)));
                    stage = later;
                }
                None => break ComputeEvent::Finished(Box::new(finished), None),
            },
            Ok(Err(ExecutionError::RerunFrom(earlier))) => stage = earlier,
            Ok(Err(ExecutionError::Failed {
                failure,
                is_transient,
            })) => {
                break ComputeEvent::Failed {
                    failure,
                    is_transient,
                    inputs: pair.inputs.clone(),
                    took: begun.elapsed(),
                };
            }
            Err(payload) => break ComputeEvent::Panicked(panic_text(&*payload)),
        }
    };
    // Before the word is out that there is memory for another pair.
    drop(pair);
    let _ = to.send(last);
}

fn run(
    steps: &dyn StageExecutor,
    stage: Stage,
    pair: &mut PairContext,
    begun: Instant,
) -> Result<ComputedStage, ExecutionError> {
    let output = steps.run(stage, pair)?;
    let took = begun.elapsed();
    failpoint::hit(stage, Point::Computed, Some(&pair.attributes.name));
    finished(stage, pair, output, took)
}

/// Names what was given by its hashes, and keeps it in hand as later stages would find it stored.
fn finished(
    stage: Stage,
    pair: &mut PairContext,
    output: StageOutput,
    took: Duration,
) -> Result<ComputedStage, ExecutionError> {
    let Some(mesh_hash) = pair.mesh_hash() else {
        let text = "a stage was done before the mesh was read";
        return Err(ExecutionError::failed(FailureClass::Bug, text));
    };
    let print_hash = pair.print_hash();
    let named: ArtifactSet = output
        .files
        .iter()
        .map(|file| (file.role().to_owned(), file.reference().clone()))
        .collect();
    let depth = pair.stored.get(&Stage::Depth).map(|stored| &stored.files);
    let metrics = stage_output::metric_results(&output.metrics, &named, depth);
    let stored = StoredStage {
        outcome: serde_json::from_str(&output.outcome).unwrap_or_default(),
        files: named.clone(),
        mesh_hash,
        print_hash,
    };
    pair.stored.insert(stage, stored);
    Ok(ComputedStage {
        stage,
        result_hash: stage_output::result_hash(&output.outcome, &named),
        outcome: output.outcome,
        files: output.files,
        named,
        metrics,
        mesh_hash,
        print_hash,
        attributes: pair.attributes_json.clone(),
        inputs: pair.news(),
        took,
    })
}

/// Most characters of a panic's own words.
const LONGEST: usize = 160;

/// What a panic said, and what to do.
fn panic_text(payload: &(dyn Any + Send)) -> String {
    let said = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned());
    let said = said.map_or_else(String::new, |text| {
        format!(" ({})", sanitize(&text, LONGEST))
    });
    format!(
        "the stage panicked{said}: a defect of this program, please report it with what `run --rerun failed -v` tells"
    )
}

#[cfg(test)]
mod tests {
    use super::{LONGEST, panic_text};

    #[test]
    fn words_of_a_panic_come_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(LONGEST + 1)] {
            let said = panic_text(&rude);
            assert!(!said.contains(&rude), "{said:?}");
        }
    }
}
