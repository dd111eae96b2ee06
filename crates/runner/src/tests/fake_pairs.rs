//! Fake stages that fail, hang, panic or wait, depending on the pair's name.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use serde_json::json;

use super::gate::Gate;
use super::values;
use crate::pair_context::PairContext;
use crate::pair_pipeline::PairStages;
use crate::stage_output::{PairStageError, PairStageOutput};
use mocban_catalog::InputVersion;
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{
    ContentHash, Failure, FailureClass, RegisterOutcome, Stage, ThresholdMetric,
};
use mocban_store::{NewArtifact, Project, hash_input};

/// Runs fake stages. The part of a pair's name before the first `_` selects what its stages do.
#[derive(Debug, Default)]
pub(super) struct FakePairs {
    /// How often each stage of each pair was computed.
    computed: Mutex<BTreeMap<(String, Stage), usize>>,
    running: AtomicUsize,
    /// Most stages that ran at the same time.
    pub(super) most: AtomicUsize,
    /// Where the files of pairs are, if they exist.
    pub(super) project: OnceLock<Project>,
    /// Stages of some pairs wait until this is opened.
    gate: Gate,
    /// Stages that compute without end and have not been cancelled yet.
    pub(super) endless: Arc<AtomicUsize>,
}

/// Counts a computation while it goes on.
struct RunningCount(Arc<AtomicUsize>);

impl RunningCount {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Self(Arc::clone(count))
    }
}

impl Drop for RunningCount {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Computes until it is cancelled.
pub(super) fn compute_without_end(endless: &Arc<AtomicUsize>) -> ! {
    let _counted = RunningCount::new(endless);
    loop {
        poll();
        std::hint::spin_loop();
    }
}

impl FakePairs {
    /// Returns how often a stage of a pair was computed.
    pub(super) fn count(&self, pair: &str, stage: Stage) -> usize {
        let computed = self.computed.lock().expect("an unpoisoned lock");
        computed
            .get(&(pair.to_owned(), stage))
            .copied()
            .unwrap_or(0)
    }

    /// Opens the gate for good.
    pub(super) fn open(&self) {
        self.gate.open();
    }

    fn behave(&self, name: &str, stage: Stage, tries: usize) -> Result<(), PairStageError> {
        match name.split('_').next().unwrap_or_default() {
            "panics" if stage == Stage::Depth => panic!("made up"),
            "bursts" => panic!("made up"),
            "bad" if stage == Stage::Fit => {
                Err(PairStageError::failed(FailureClass::BadInput, "no faces"))
            }
            "flaky" if stage == Stage::Fit && tries == 1 => Err(PairStageError::Failed {
                failure: Failure::new(FailureClass::Io, "the disk is slow"),
                is_transient: true,
            }),
            "breaks" if stage == Stage::Depth && tries == 1 => Err(PairStageError::Failed {
                failure: Failure::new(FailureClass::Io, "the disk is slow"),
                is_transient: true,
            }),
            "hangs" if stage == Stage::Fit => {
                self.gate.wait();
                Ok(())
            }
            "loses" if stage == Stage::Register && tries == 1 => {
                Err(PairStageError::RerunFrom(Stage::Depth))
            }
            "loops" if stage == Stage::Fit => compute_without_end(&self.endless),
            "outlives" if self.count(name, Stage::Fit) == 1 && stage <= Stage::Depth => {
                if stage == Stage::Depth {
                    compute_without_end(&self.endless);
                }
                self.gate.wait();
                Ok(())
            }
            "lasts" if stage == Stage::Register => {
                self.gate.wait();
                Ok(())
            }
            "wait" => {
                self.gate.wait();
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl PairStages for FakePairs {
    fn run(&self, stage: Stage, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        let name = pair.attributes.name.as_str().to_owned();
        let tries = {
            let mut computed = self.computed.lock().expect("an unpoisoned lock");
            let count = computed.entry((name.clone(), stage)).or_default();
            *count += 1;
            *count
        };
        let running = self.running.fetch_add(1, Ordering::SeqCst) + 1;
        self.most.fetch_max(running, Ordering::SeqCst);
        let outcome = self.behave(&name, stage, tries);
        self.running.fetch_sub(1, Ordering::SeqCst);
        outcome?;
        let seen = |text: &str, path: &str| {
            let input = self.project.get().map(|project| project.input(path));
            let found = input.and_then(|input| hash_input(&input).ok());
            found.map_or_else(
                || InputVersion {
                    hash: ContentHash::of(text.as_bytes()),
                    stat: "as it was".to_owned(),
                },
                InputVersion::from,
            )
        };
        let attributes = &pair.attributes;
        pair.inputs.mesh = Some(seen("mesh", &attributes.mesh_path));
        pair.inputs.print =
            (stage >= Stage::Normalize).then(|| seen("print", &attributes.print_path));
        let register = RegisterOutcome {
            ink: 0,
            metrics: ThresholdMetric::ALL.map(values::metric_outcome).to_vec(),
            features: None,
            levelling: None,
            displaced: None,
        };
        let last = stage == Stage::Register;
        Ok(PairStageOutput {
            outcome: if last {
                json!(register)
            } else {
                json!({ "stage": stage, "pair": name })
            },
            files: vec![NewArtifact::new(
                "note.txt",
                "txt",
                format!("{stage} of {name}").into_bytes(),
            )],
            metrics: if last { register.metrics } else { Vec::new() },
        })
    }
}
