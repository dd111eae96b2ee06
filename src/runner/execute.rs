//! The one bridge from tokio to computing: a stage runs on a thread of its own.
//!
//! A thread a stage, rather than a pool, so that one that hangs past its deadline can be left behind without taking
//! a place from the others.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use super::hand::{PairInHand, Stored};
use super::outputs;
use super::steps::{Setback, StageOutput, Steps};
use super::stop::{Stop, StopLevel};
use crate::breakpoint::{self, Point};
use crate::catalog::MetricResult;
use crate::domain::{ArtifactSet, ContentHash, FailureClass, Stage, plain};
use crate::store::NewArtifact;

/// What a stage gave, none of it on disk.
#[derive(Debug)]
pub(super) struct Given {
    pub(super) outcome: String,
    pub(super) files: Vec<NewArtifact>,
    /// How the files will be named.
    pub(super) named: ArtifactSet,
    pub(super) result_hash: ContentHash,
    pub(super) metrics: Vec<MetricResult>,
}

/// How a stage ended.
#[derive(Debug)]
pub(super) enum Ended {
    /// Computed.
    Given(Given),
    /// Not computed.
    Setback(Setback),
}

/// What came back from the thread.
#[derive(Debug)]
pub(super) enum Computed {
    /// The pair, how the stage ended, and how long it took.
    Ended(Box<PairInHand>, Ended, Duration),
    /// The stage panicked; the pair in hand is lost with it.
    Panicked(String),
    /// The system gave no thread for it; the pair in hand is lost.
    NoThread(std::io::Error),
    /// It took too long; its thread is left behind.
    TimedOut,
    /// The run is to stop now; its thread is left behind.
    Stopped,
}

/// Runs a stage of a pair.
pub(super) async fn compute(
    steps: &Arc<dyn Steps>,
    stage: Stage,
    pair: Box<PairInHand>,
    limit: Duration,
    stop: &Stop,
) -> Computed {
    let (sender, receiver) = oneshot::channel();
    let steps = Arc::clone(steps);
    let name = format!("{stage} {}", pair.facts.name);
    let thread = std::thread::Builder::new().name(name);
    let spawned = thread.spawn(move || {
        let work = AssertUnwindSafe(|| run(&*steps, stage, pair));
        // Nobody waits any more after a time limit or a stop; then the work is dropped.
        let _ = sender.send(catch_unwind(work));
    });
    if let Err(error) = spawned {
        return Computed::NoThread(error);
    }
    tokio::select! {
        biased;
        outcome = receiver => match outcome {
            Ok(Ok((pair, ended, took))) => Computed::Ended(pair, ended, took),
            Ok(Err(payload)) => Computed::Panicked(panic_text(&*payload)),
            Err(_) => Computed::Panicked("the stage's thread ended without a word".to_owned()),
        },
        () = stop.reached(StopLevel::Now) => Computed::Stopped,
        () = tokio::time::sleep(limit) => Computed::TimedOut,
    }
}

fn run(
    steps: &dyn Steps,
    stage: Stage,
    mut pair: Box<PairInHand>,
) -> (Box<PairInHand>, Ended, Duration) {
    let begun = Instant::now();
    let outcome = steps.run(stage, &mut pair);
    let took = begun.elapsed();
    let ended = match outcome {
        Err(setback) => Ended::Setback(setback),
        Ok(output) => {
            breakpoint::reach(stage, Point::Computed, Some(&pair.facts.name));
            given(stage, &mut pair, output)
        }
    };
    (pair, ended, took)
}

/// Names what was given by its hashes, and keeps it in hand as later stages would find it stored.
fn given(stage: Stage, pair: &mut PairInHand, output: StageOutput) -> Ended {
    let Some(mesh_hash) = pair.mesh_hash() else {
        let text = "a stage was done before the mesh was read";
        return Ended::Setback(Setback::failed(FailureClass::Bug, text));
    };
    let named: ArtifactSet = output
        .files
        .iter()
        .map(|file| (file.role.clone(), file.reference()))
        .collect();
    let depth = pair.stored.get(&Stage::Depth).map(|stored| &stored.files);
    let metrics = outputs::metric_results(&output.metrics, &named, depth);
    let stored = Stored {
        outcome: serde_json::from_str(&output.outcome).unwrap_or_default(),
        files: named.clone(),
        mesh_hash,
        print_hash: pair.print_hash(),
    };
    pair.stored.insert(stage, stored);
    Ended::Given(Given {
        result_hash: outputs::result_hash(&output.outcome, &named),
        outcome: output.outcome,
        files: output.files,
        named,
        metrics,
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
    let said = said.map_or_else(String::new, |text| format!(" ({})", plain(&text, LONGEST)));
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
