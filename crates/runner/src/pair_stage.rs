//! Runs one stage of a pair on the pair's thread (`pair_task.rs`), and makes its checkpoint.

use std::time::Instant;

use super::pair_context::{PairContext, StoredStage};
use super::run_context::RunContext;
use super::stage_output::{self, PairStageError, PairStageOutput};
use mocban_catalog::{PairProvenance, StageCheckpoint};
use mocban_core::domain::{ArtifactSet, FailureClass, Stage};
use mocban_store::NewArtifact;
use mocban_system::failpoint::{self, Point};

/// A computed stage: its catalog row, and the files that must be on the disk before the row is stored.
pub(super) type ComputedStage = (StageCheckpoint, Vec<NewArtifact>);

/// Runs one stage, and keeps its outcome in the pair for later stages.
pub(super) fn run_stage(
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
