//! A block between two of its stages; stores the results and failures of its stages under its lease.

use std::collections::BTreeSet;
use std::time::Instant;

use serde::Deserialize;
use serde_json::Value;

use super::inputs::{BlockSources, as_failure};
use crate::block_stages::{BlockStageError, BlockStageOutput, CharacterOutput};
use crate::blocking::run_blocking;
use crate::error::RunError;
use crate::events::RunEvent;
use crate::folder_check::check_folders;
use crate::policy::{self, FailedAttempt};
use crate::run_context::{JobEnd, RunContext};
use crate::stage_output::result_hash;
use mocban_catalog::{
    BlockInputVersions, BlockJob, BlockProvenance, BlockWork, CheckpointOutcome, CutPair, CutReply,
    FailureAction, InputVersion, Lease, NewCharacter, StageCheckpoint, StageFailure,
};
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{
    ArtifactRef, ArtifactSet, BlockName, BlockStage, BlockStageRecord, FailureClass,
};
use mocban_store::{Project, stat_input};
use mocban_system::failpoint::{self, Point};

/// Calls an operation that stores what a block's task has computed, again if it failed for a while; the arguments are
/// evaluated for each call. It may take any time, even after a stop request, and its future is `Send`.
macro_rules! stored {
    ($catalog:ident.$operation:ident($($argument:expr),*)) => {{
        let mut attempt = 0;
        loop {
            match $catalog.$operation($($argument),*).await {
                Err(error) if $catalog.may_retry(attempt, &error).await => attempt += 1,
                outcome => break outcome,
            }
        }
    }};
}
pub(crate) use stored;

/// A block in progress.
pub(crate) struct BlockInProgress {
    pub(crate) lease: Lease<BlockJob>,
    pub(crate) work: BlockWork,
    pub(crate) sources: BlockSources,
    /// Versions of the input files, as far as they are known.
    pub(crate) inputs: BlockInputVersions,
}

impl BlockInProgress {
    /// Describes what a stage is computed from.
    pub(crate) fn provenance(&self, stage: BlockStage, settings: &Value) -> BlockProvenance {
        let BlockWork {
            attributes,
            control_points,
            ..
        } = &self.work;
        BlockProvenance::new(
            stage,
            settings,
            attributes,
            &self.inputs,
            control_points.as_ref(),
        )
    }
}

/// A computed stage.
pub(crate) struct ComputedBlockStage {
    pub(crate) output: BlockStageOutput,
    pub(crate) files: ArtifactSet,
    pub(crate) ms: u64,
    /// When the write of its files began.
    pub(crate) began: Instant,
}

/// What happens to a block after a stage.
pub(crate) enum AfterStage {
    /// The job continues with this stage.
    Continue(Box<BlockInProgress>, BlockStage),
    /// Its task ends.
    End(JobEnd),
}

/// Stores a computed stage. Fails the block instead if the output is not valid.
pub(crate) async fn store_stage(
    context: &RunContext,
    block: Box<BlockInProgress>,
    stage: BlockStage,
    computed: ComputedBlockStage,
) -> Result<AfterStage, RunError> {
    let ms = computed.ms;
    let name = block.work.attributes.name.clone();
    let ComputedBlockStage {
        output,
        files,
        began,
        ..
    } = computed;
    let BlockStageOutput {
        outcome,
        characters,
    } = output;
    let outcome = outcome.to_string();
    let (project, inner) = (context.project.clone(), name.clone());
    let characters = run_blocking(move || {
        failpoint::hit(stage, Point::Synced, Some(&inner));
        new_characters(&project, &inner, characters)
    });
    let characters = match characters.await {
        Ok(characters) => characters,
        Err(error) => return store_failure(context, block, stage, error, Some(ms)).await,
    };
    let settings = context.blocks.settings(stage);
    let checkpoint = StageCheckpoint {
        stage,
        provenance: block.provenance(stage, &settings),
        result_hash: result_hash(&outcome, &files),
        outcome,
        files,
        metrics: Vec::new(),
        inputs: block.inputs.clone(),
        ms,
        at: context.clock.now(),
        next_deadline: context.block_deadline(),
        alive_since: context.alive_since(),
        write_began: began,
    };
    match stage.next() {
        Some(next) => advance(context, block, checkpoint, next).await,
        None => finish_cut(context, block, checkpoint, characters).await,
    }
}

/// Reports a stage that is stored.
fn finished(context: &RunContext, block: &BlockName, checkpoint: &StageCheckpoint<BlockJob>) {
    let (stage, ms) = (checkpoint.stage, checkpoint.ms);
    failpoint::hit(stage, Point::Committed, Some(block));
    context.emit(RunEvent::BlockStageFinished {
        block: block.clone(),
        stage,
        ms,
    });
    for warning in warnings_of(&checkpoint.outcome) {
        context.emit(RunEvent::BlockWarned {
            block: block.clone(),
            stage,
            warning,
        });
    }
}

/// Returns the warnings in the outcome of a stage.
fn warnings_of(outcome: &str) -> Vec<String> {
    #[derive(Default, Deserialize)]
    struct Warned {
        #[serde(default)]
        warnings: Vec<String>,
    }
    let warned: Warned = serde_json::from_str(outcome).unwrap_or_default();
    warned.warnings
}

async fn advance(
    context: &RunContext,
    mut block: Box<BlockInProgress>,
    checkpoint: StageCheckpoint<BlockJob>,
    next: BlockStage,
) -> Result<AfterStage, RunError> {
    let (catalog, lease) = (&context.catalog, &block.lease);
    let stored = stored!(catalog.checkpoint_block(lease.clone(), checkpoint.clone()))?;
    let CheckpointOutcome::Lease(lease) = stored else {
        return Ok(AfterStage::End(JobEnd::LeaseLost));
    };
    let stage = checkpoint.stage;
    finished(context, &block.work.attributes.name, &checkpoint);
    block.lease = lease;
    block.work.results.retain(|earlier| earlier.stage < stage);
    block.work.results.push(BlockStageRecord {
        stage,
        outcome: checkpoint.outcome,
        files: checkpoint.files,
        result_hash: checkpoint.result_hash,
    });
    Ok(AfterStage::Continue(block, next))
}

async fn finish_cut(
    context: &RunContext,
    block: Box<BlockInProgress>,
    checkpoint: StageCheckpoint<BlockJob>,
    characters: Vec<NewCharacter>,
) -> Result<AfterStage, RunError> {
    let (catalog, lease) = (&context.catalog, &block.lease);
    let cut = match stored!(catalog.finish_cut(
        lease.clone(),
        checkpoint.clone(),
        characters.clone()
    ))? {
        CutReply::Stored(cut) => cut,
        CutReply::Refused => return Ok(AfterStage::End(JobEnd::LeaseLost)),
        CutReply::NameTaken(taken) => {
            let text = format!(
                "there is a pair {taken} that was not cut from this block, and ids must differ in more than upper and lower case; import the block with another id"
            );
            let error = BlockStageError::failed(FailureClass::BadInput, text);
            return store_failure(context, block, BlockStage::Cut, error, Some(checkpoint.ms))
                .await;
        }
    };
    let block = block.work.attributes.name;
    finished(context, &block, &checkpoint);
    context.emit(RunEvent::BlockDone {
        block,
        cut,
        stages: context.until.index() as u64 + 1,
    });
    Ok(AfterStage::End(JobEnd::Done))
}

/// Stores a failure of a stage.
pub(crate) async fn store_failure(
    context: &RunContext,
    block: Box<BlockInProgress>,
    stage: BlockStage,
    error: BlockStageError,
    ms: Option<u64>,
) -> Result<AfterStage, RunError> {
    let attributes = &block.work.attributes;
    let paths = [&attributes.mesh_path, &attributes.page_path];
    if let Err(error) = check_folders(context, paths.map(String::clone)).await {
        let (catalog, lease) = (&context.catalog, &block.lease);
        if let Err(error) = stored!(catalog.release_block(lease.clone())) {
            tracing::warn!(%error, "the block could not be given back");
        }
        return Err(error);
    }
    let (failure, is_transient) = as_failure(error);
    let now = context.clock.now();
    let attempt = FailedAttempt {
        id: block.lease.id(),
        class: failure.class,
        is_transient,
        attempt: block.lease.attempt(),
        ran_alone: true,
    };
    let action = policy::failure_action(attempt, now);
    let settings = context.blocks.settings(stage);
    let failed = StageFailure {
        stage,
        failure: failure.clone(),
        action,
        provenance: block.provenance(stage, &settings),
        inputs: block.inputs,
        ms,
        at: now,
        alive_since: context.alive_since(),
    };
    let (catalog, lease) = (&context.catalog, &block.lease);
    if !stored!(catalog.fail_block(lease.clone(), failed.clone()))? {
        return Ok(AfterStage::End(JobEnd::LeaseLost));
    }
    let block = block.work.attributes.name;
    let end = match action {
        FailureAction::Quarantine => {
            context.emit(RunEvent::BlockFailed {
                block,
                stage,
                failure,
            });
            JobEnd::Failed
        }
        FailureAction::BackOff { .. } | FailureAction::RetryExclusive => {
            context.emit(RunEvent::BlockBackingOff {
                block,
                stage,
                failure,
                wait_ms: action.wait_ms(now),
            });
            JobEnd::Retry
        }
    };
    Ok(AfterStage::End(end))
}

/// Converts the characters of a cut to their stored form.
///
/// # Errors
/// Returns an error if two characters have the same label, a label cannot be part of an id, or a file is missing.
fn new_characters(
    project: &Project,
    block: &BlockName,
    characters: Vec<CharacterOutput>,
) -> Result<Vec<NewCharacter>, BlockStageError> {
    let mut labels = BTreeSet::new();
    characters
        .into_iter()
        .map(|one| {
            let refused = |text: String| BlockStageError::failed(FailureClass::BadInput, text);
            if !labels.insert(one.label.clone()) {
                let label = quoted(&one.label);
                let text = format!("two characters have the label {label}; rename one");
                return Err(refused(text));
            }
            if let Err(error) = block.pair(&one.label) {
                let label = quoted(&one.label);
                let text = format!("label {label} cannot be part of an id: {error}");
                return Err(refused(text));
            }
            let cut = match one.cut {
                Ok(files) => {
                    let (mesh_path, mesh) = input_of(project, &files.mesh)?;
                    let (print_path, print) = input_of(project, &files.print)?;
                    Ok(CutPair {
                        mesh_path,
                        mesh,
                        print_path,
                        print,
                        unit: files.unit,
                        scanned_face_down: files.scanned_face_down,
                        prior: files.prior.map(|prior| prior.to_string()),
                    })
                }
                Err(reason) => Err(reason),
            };
            Ok(NewCharacter {
                label: one.label,
                character: one.character,
                bounds: one.bounds,
                confidence: one.confidence,
                maps: one.maps,
                cut,
            })
        })
        .collect()
}

/// Returns the path of an artifact as an input of a pair, and its version.
fn input_of(
    project: &Project,
    artifact: &ArtifactRef,
) -> Result<(String, InputVersion), BlockStageError> {
    let Some(path) = artifact.stored_path() else {
        let text = "the file of a character is in a pack".to_owned();
        return Err(BlockStageError::failed(FailureClass::Bug, text));
    };
    let stat = stat_input(&project.input(&path))?;
    let version = InputVersion {
        hash: artifact.hash,
        stat,
    };
    Ok((path, version))
}
