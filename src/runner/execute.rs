//! The one bridge from tokio to computing: a stage runs on a thread of its own, which files what it gave.
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
use super::steps::{Setback, Steps};
use super::stop::{Stop, StopLevel};
use crate::breakpoint::{self, Point};
use crate::catalog::MetricResult;
use crate::domain::{ArtifactSet, ContentHash, FailureClass, Stage, plain};
use crate::store::{ArtifactError, Project};

/// A stage that is computed and whose files are on disk.
#[derive(Debug)]
pub(super) struct Filed {
    pub(super) outcome: String,
    pub(super) files: ArtifactSet,
    pub(super) result_hash: ContentHash,
    pub(super) metrics: Vec<MetricResult>,
}

/// How a stage ended.
#[derive(Debug)]
pub(super) enum Ended {
    /// Computed and filed.
    Filed(Filed),
    /// Not computed.
    Setback(Setback),
    /// Computed, but the disk refused.
    NotFiled(ArtifactError),
}

/// How long a stage took.
#[derive(Debug, Clone, Copy)]
pub(super) struct Took {
    /// To compute.
    computing: Duration,
    /// To compute and to file what it gave.
    pub(super) all: Duration,
}

impl Took {
    /// Computing time in milliseconds.
    pub(super) const fn ms(&self) -> u64 {
        self.computing.as_millis() as u64
    }
}

/// What came back from the thread.
#[derive(Debug)]
pub(super) enum Computed {
    /// The pair, how the stage ended, and how long it took.
    Ended(Box<PairInHand>, Ended, Took),
    /// The stage panicked; the pair in hand is lost with it.
    Panicked(String),
    /// The system gave no thread for it; the pair in hand is lost.
    NoThread(std::io::Error),
    /// It took too long; its thread is left behind.
    TimedOut,
    /// The run is to stop now; its thread is left behind.
    Stopped,
}

/// Runs a stage of a pair and files what it gives.
pub(super) async fn compute(
    steps: &Arc<dyn Steps>,
    project: &Project,
    stage: Stage,
    pair: Box<PairInHand>,
    limit: Duration,
    stop: &Stop,
) -> Computed {
    let (sender, receiver) = oneshot::channel();
    let (steps, project) = (Arc::clone(steps), project.clone());
    let name = format!("{stage} {}", pair.facts.name);
    let thread = std::thread::Builder::new().name(name);
    let spawned = thread.spawn(move || {
        let work = AssertUnwindSafe(|| run(&*steps, &project, stage, pair));
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
    project: &Project,
    stage: Stage,
    mut pair: Box<PairInHand>,
) -> (Box<PairInHand>, Ended, Took) {
    let begun = Instant::now();
    let outcome = steps.run(stage, &mut pair);
    let computing = begun.elapsed();
    let ended = match outcome {
        Err(setback) => Ended::Setback(setback),
        Ok(output) => {
            breakpoint::reach(stage, Point::Computed, Some(&pair.facts.name));
            let written = || breakpoint::reach(stage, Point::Written, Some(&pair.facts.name));
            match project.write_artifacts_telling(&output.files, &written) {
                Err(error) => Ended::NotFiled(error),
                Ok(files) => filed(stage, &mut pair, output, files),
            }
        }
    };
    let all = begun.elapsed();
    (pair, ended, Took { computing, all })
}

/// Names what is on disk by its hashes, and keeps it in hand as later stages would find it stored.
fn filed(
    stage: Stage,
    pair: &mut PairInHand,
    output: super::steps::StageOutput,
    files: ArtifactSet,
) -> Ended {
    breakpoint::reach(stage, Point::Filed, Some(&pair.facts.name));
    let Some(mesh_hash) = pair.mesh_hash() else {
        let text = "a stage was done before the mesh was read";
        return Ended::Setback(Setback::failed(FailureClass::Bug, text));
    };
    let depth = pair.stored.get(&Stage::Depth).map(|stored| &stored.files);
    let metrics = outputs::metric_results(&output.metrics, &files, depth);
    let stored = Stored {
        outcome: serde_json::from_str(&output.outcome).unwrap_or_default(),
        files: files.clone(),
        mesh_hash,
        print_hash: pair.print_hash(),
    };
    pair.stored.insert(stage, stored);
    Ended::Filed(Filed {
        result_hash: outputs::result_hash(&output.outcome, &files),
        outcome: output.outcome,
        files,
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
