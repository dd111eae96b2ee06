//! Fake stages of blocks that refuse, fail, panic or wait, depending on the block's name. The labels of a block are lines
//! of a label and the content of its character.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use serde_json::{Value, json};

use super::fake_pairs::compute_without_end;
use super::gate::Gate;
use crate::{
    BlockArtifacts, BlockFile, BlockInputs, BlockStageError, BlockStageOutput, BlockStages,
    CharacterOutput, CutFiles,
};
use mocban_core::domain::{BlockStage, BlockStageRecord, Failure, FailureClass};

/// Runs fake stages. The part of a block's name before the first `_` selects what its stages do.
#[derive(Debug, Default)]
pub(super) struct FakeBlocks {
    /// How often each stage of each block was computed.
    computed: Mutex<BTreeMap<(String, BlockStage), usize>>,
    /// Revision of the settings of the stage `boxes`.
    pub(super) revision: AtomicU32,
    /// Stages of some blocks wait until this is opened.
    gate: Gate,
    /// Stages that compute without end and have not been cancelled yet.
    pub(super) endless: Arc<AtomicUsize>,
}

impl FakeBlocks {
    /// Returns how often a stage of a block was computed.
    pub(super) fn count(&self, block: &str, stage: BlockStage) -> usize {
        let computed = self.computed.lock().expect("an unpoisoned lock");
        let count = computed.get(&(block.to_owned(), stage));
        count.copied().unwrap_or(0)
    }

    /// Opens the gate for good.
    pub(super) fn open(&self) {
        self.gate.open();
    }

    fn behave(&self, name: &str, stage: BlockStage, tries: usize) -> Result<(), BlockStageError> {
        match name.split('_').next().unwrap_or_default() {
            "panics" if stage == BlockStage::Boxes => panic!("made up"),
            "flaky" if stage == BlockStage::Align && tries == 1 => Err(BlockStageError::Failed {
                failure: Failure::new(FailureClass::Io, "the disk is slow"),
                is_transient: true,
            }),
            "loses" if stage == BlockStage::Boxes && tries == 1 => {
                Err(BlockStageError::RerunFrom(BlockStage::Face))
            }
            "loops" if stage == BlockStage::Align => compute_without_end(&self.endless),
            "waits" if stage == BlockStage::Align => {
                self.gate.wait();
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

fn text(file: &BlockFile) -> Result<String, BlockStageError> {
    let mut text = String::new();
    let read = file.open()?.read_to_string(&mut text);
    read.map_err(|error| file.failed(FailureClass::Io, error))?;
    Ok(text)
}

impl BlockStages for FakeBlocks {
    fn settings(&self, stage: BlockStage) -> Value {
        let revision = self.revision.load(Ordering::SeqCst);
        match stage {
            BlockStage::Boxes => json!({ "revision": revision }),
            _ => json!({ "revision": 1 }),
        }
    }

    fn run(
        &self,
        stage: BlockStage,
        inputs: &BlockInputs,
        earlier: &[BlockStageRecord],
        artifacts: &dyn BlockArtifacts,
        _stop: &AtomicBool,
    ) -> Result<BlockStageOutput, BlockStageError> {
        assert_eq!(
            earlier.len(),
            stage.index(),
            "the results of all stages before"
        );
        let name = inputs.name.as_str().to_owned();
        let tries = {
            let mut computed = self.computed.lock().expect("an unpoisoned lock");
            let count = computed.entry((name.clone(), stage)).or_default();
            *count += 1;
            *count
        };
        self.behave(&name, stage, tries)?;
        match stage {
            BlockStage::Face => {
                artifacts.write("heights.txt", "txt", text(&inputs.mesh)?.into_bytes())?;
            }
            BlockStage::Align => {
                let heights = artifacts.read(&earlier[0], "heights.txt")?;
                let page = text(&inputs.page)?;
                if page.contains("other") {
                    let refusal = "the page is of another block";
                    return Err(inputs.page.failed(FailureClass::NoSolution, refusal));
                }
                artifacts.write("field.txt", "txt", [heights, page.into_bytes()].concat())?;
            }
            BlockStage::Boxes => {
                let found = || Ok("r1 found".to_owned());
                let labels = inputs.labels.as_ref().map_or_else(found, text)?;
                let is_warned = labels.contains("beside");
                let warnings: Vec<&str> = is_warned
                    .then_some("1 box was left out")
                    .into_iter()
                    .collect();
                return Ok(BlockStageOutput {
                    outcome: json!({ "labels": labels, "warnings": warnings }),
                    characters: Vec::new(),
                });
            }
            BlockStage::Cut => {
                let boxes: Value = serde_json::from_str(&earlier[2].outcome).expect("JSON");
                let lines = boxes["labels"].as_str().expect("text").lines();
                let characters = lines.map(|line| character(line, artifacts));
                return Ok(BlockStageOutput {
                    outcome: json!({ "stage": stage }),
                    characters: characters.collect::<Result<_, _>>()?,
                });
            }
        }
        Ok(BlockStageOutput {
            outcome: json!({ "stage": stage, "block": name }),
            characters: Vec::new(),
        })
    }
}

/// Cuts the character of a line of the labels. A line without content has nothing to cut.
fn character(
    line: &str,
    artifacts: &dyn BlockArtifacts,
) -> Result<CharacterOutput, BlockStageError> {
    let (label, content) = line.split_once(' ').unwrap_or((line, ""));
    let file = |ext: &str| {
        let bytes = format!("{ext} of {content}").into_bytes();
        artifacts.write(&format!("{label}.{content}.{ext}"), ext, bytes)
    };
    let cut = if content.is_empty() {
        Err("it lies beside the scan".to_owned())
    } else {
        Ok(CutFiles {
            mesh: file("ply")?,
            print: file("png")?,
            unit: None,
            scanned_face_down: None,
            prior: Some(json!({ "angle_deg": 0.0 })),
        })
    };
    Ok(CharacterOutput {
        label: label.to_owned(),
        character: None,
        bounds: [0.0, 0.0, 10.0, 10.0],
        confidence: Some(0.9),
        maps: None,
        cut,
    })
}
