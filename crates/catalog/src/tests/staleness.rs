//! Changed settings and inputs requeue a pair from the first affected stage.

use super::blocks::{self, continued, done, failed};
use super::{World, fingerprints, name, row};
use crate::{
    BlockReason, CheckpointOutcome, FailureAction, Fingerprints, InputVersion, InputVersions,
    PairProvenance, Plan, RerunPolicy, RetrySelection, StageFailure, StaleReason,
};
use mocban_core::domain::{
    BlockStage, ContentHash, Failure, FailureClass, JobStatus, LengthUnit, PairId, Stage,
};

async fn cursor(world: &World, pair: &str) -> Option<Stage> {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    detail.expect("the pair").results.next_stage
}

async fn requeue_stale(world: &World, fingerprints: &Fingerprints) -> u64 {
    let sent = world
        .catalog
        .requeue_stale(fingerprints, None, RerunPolicy::Changed);
    sent.await.expect("requeued")
}

#[tokio::test]
async fn a_changed_register_setting_reruns_register_only() {
    let world = World::new(2).await;
    world.finish_one().await;
    let changed = fingerprints([1, 1, 1, 2]);
    let why = world.catalog.why(&name("p0"), &changed).await;
    let why = why.expect("a read").expect("a reason");
    assert_eq!(why.from, Stage::Register);
    assert_eq!(why.to_string(), "register.revision: 1 -> 2");
    let status = world.catalog.status(&changed).await.expect("a read");
    assert_eq!(status.stale, 1);
    assert_eq!(requeue_stale(&world, &changed).await, 1);
    assert_eq!(cursor(&world, "p0").await, Some(Stage::Register));
    let page = world.catalog.results_page(None, 1).await.expect("a page");
    assert_eq!(page[0].stages.len(), 3);
    assert_eq!(requeue_stale(&world, &changed).await, 0);
    world.assert_counters().await;
}

#[tokio::test]
async fn unchanged_settings_requeue_nothing() {
    let world = World::new(1).await;
    world.finish_one().await;
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 0);
    let plan = plan(&world).await;
    assert_eq!((plan.pairs(), plan.done), (0, 1));
}

async fn plan(world: &World) -> Plan {
    let fingerprints = fingerprints([1; 4]);
    let plan = world
        .catalog
        .plan(&fingerprints, None, RerunPolicy::Changed);
    plan.await.expect("a plan")
}

async fn see(world: &World, mesh: &str, print: &str) {
    let page = world.catalog.known_inputs(None, 10, None).await;
    let pair = page.expect("a page")[0].pair;
    let seen = |text: &str| InputVersion {
        hash: ContentHash::of(text.as_bytes()),
        stat: format!("{text} touched"),
    };
    let inputs = InputVersions {
        mesh: Some(seen(mesh)),
        print: Some(seen(print)),
    };
    let stored = world.catalog.store_inputs(vec![(pair, inputs)]).await;
    stored.expect("stored");
}

#[tokio::test]
async fn a_new_modification_time_reruns_nothing() {
    let world = World::new(1).await;
    world.finish_one().await;
    see(&world, "mesh", "print").await;
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 0);
}

#[tokio::test]
async fn a_changed_print_requeues_its_pair_from_normalize() {
    let world = World::new(2).await;
    world.finish_one().await;
    world.finish_one().await;
    see(&world, "mesh", "another print").await;
    let plan = plan(&world).await;
    assert_eq!(plan.entries.len(), 1);
    assert_eq!(plan.entries[0].why, StaleReason::Print);
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 1);
    assert_eq!(cursor(&world, "p0").await, Some(Stage::Normalize));
    assert_eq!(cursor(&world, "p1").await, None);
}

#[tokio::test]
async fn a_changed_mesh_requeues_its_pair_from_fit() {
    let world = World::new(1).await;
    world.finish_one().await;
    see(&world, "another mesh", "print").await;
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 1);
    assert_eq!(cursor(&world, "p0").await, Some(Stage::Fit));
}

#[tokio::test]
async fn a_changed_unit_in_the_manifest_makes_the_pair_stale() {
    let world = World::new(1).await;
    world.finish_one().await;
    let mut changed = row("p0");
    changed.unit = Some(LengthUnit::In);
    world
        .catalog
        .import(vec![changed], 9)
        .await
        .expect("imported");
    let why = world.catalog.why(&name("p0"), &fingerprints([1; 4])).await;
    let why = why.expect("a read").expect("a reason");
    assert_eq!((why.from, why.why), (Stage::Fit, StaleReason::Manifest));
}

#[tokio::test]
async fn a_changed_path_is_read_again_and_changed_metadata_reruns_nothing() {
    let world = World::new(1).await;
    world.finish_one().await;
    let mut changed = row("p0");
    changed.mesh_path = "elsewhere.stl".to_owned();
    changed.character = Some("字".to_owned());
    world
        .catalog
        .import(vec![changed], 9)
        .await
        .expect("imported");
    let known = world.catalog.known_inputs(None, 10, None).await;
    let mesh = known.expect("a page")[0].mesh.clone().expect("a mesh");
    assert_eq!(mesh.stat, "");
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 0);
}

#[tokio::test]
async fn a_failed_pair_runs_again_after_an_import_with_another_path() {
    let world = World::new(2).await;
    for lease in world.claim(2).await {
        let gone = Failure::new(FailureClass::Io, "p0.stl is not there");
        let failed = StageFailure {
            inputs: InputVersions::default(),
            ..super::failed(
                world.fingerprints,
                Stage::Fit,
                gone,
                FailureAction::Quarantine,
            )
        };
        assert!(world.catalog.fail(lease, failed).await.expect("stored"));
    }
    let mut moved = row("p0");
    moved.mesh_path = "elsewhere.stl".to_owned();
    let mut described = row("p1");
    described.character = Some("字".to_owned());
    let rows = vec![moved, described];
    world.catalog.import(rows, 9).await.expect("imported");
    for (pair, expected) in [("p0", JobStatus::Ready), ("p1", JobStatus::Quarantined)] {
        let detail = world.catalog.pair(&name(pair)).await.expect("a read");
        assert_eq!(detail.expect("the pair").results.status, expected, "{pair}");
    }
    world.assert_counters().await;
}

/// A pair whose mesh was missing when `depth` read it.
async fn failed_on_its_mesh() -> World {
    let world = World::new(1).await;
    let fit = world.claim(1).await.remove(0);
    let fit = world.catalog.checkpoint_now(fit, world.done(Stage::Fit));
    let Ok(CheckpointOutcome::Lease(lease)) = fit.await else {
        unreachable!("the pair has more stages");
    };
    let mut inputs = super::inputs(Stage::Depth);
    inputs.mesh = Some(InputVersion::gone());
    let attributes = world.done(Stage::Depth).provenance.attributes;
    let gone = Failure::new(FailureClass::Io, "p0.stl is not there");
    let failed = StageFailure {
        provenance: PairProvenance::new(world.fingerprints.of(Stage::Depth), &inputs, attributes),
        inputs,
        ..super::failed(
            world.fingerprints,
            Stage::Depth,
            gone,
            FailureAction::Quarantine,
        )
    };
    assert!(world.catalog.fail(lease, failed).await.expect("stored"));
    world
}

async fn reasons(world: &World) -> Vec<(Stage, StaleReason)> {
    let entries = plan(world).await.entries.into_iter();
    entries.map(|entry| (entry.from, entry.why)).collect()
}

#[tokio::test]
async fn a_missing_file_restarts_no_stage_of_the_pair_that_failed_on_it() {
    let world = failed_on_its_mesh().await;
    let current = fingerprints([1; 4]);
    assert_eq!(requeue_stale(&world, &current).await, 0);
    let status = world.catalog.status(&current).await.expect("a read");
    assert_eq!(status.stale, 0);
    world.assert_counters().await;
    // The same file is back.
    see(&world, "mesh", "print").await;
    let failed_before = (Stage::Depth, StaleReason::FailedBefore);
    assert_eq!(reasons(&world).await, [failed_before]);
    assert_eq!(requeue_stale(&world, &current).await, 1);
    assert_eq!(cursor(&world, "p0").await, Some(Stage::Depth));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_retry_keeps_the_finished_stages_of_a_pair_whose_file_is_missing() {
    let world = failed_on_its_mesh().await;
    let current = fingerprints([1; 4]);
    let retried = world.retry(&RetrySelection::All).await;
    assert_eq!(retried.expect("retried"), 1);
    let unfinished = (Stage::Depth, StaleReason::Unfinished);
    assert_eq!(reasons(&world).await, [unfinished]);
    assert_eq!(requeue_stale(&world, &current).await, 0);
    let status = world.catalog.status(&current).await.expect("a read");
    assert_eq!(status.stale, 0);
    // The same file is back, and then another one.
    see(&world, "mesh", "print").await;
    assert_eq!(reasons(&world).await, [unfinished]);
    see(&world, "another mesh", "print").await;
    assert_eq!(reasons(&world).await, [(Stage::Fit, StaleReason::Mesh)]);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_missing_file_that_the_next_stage_does_not_read_makes_the_pair_stale() {
    let world = World::new(1).await;
    world.finish_one().await;
    let mut gone = super::inputs(Stage::Normalize);
    gone.mesh = Some(InputVersion::gone());
    let stored = world.catalog.store_inputs(vec![(PairId(1), gone)]).await;
    stored.expect("stored");
    assert_eq!(reasons(&world).await, [(Stage::Fit, StaleReason::Mesh)]);
}

#[tokio::test]
async fn a_retry_keeps_the_finished_stages_of_a_block_whose_file_is_missing() {
    let world = blocks::world().await;
    let (lease, work) = world.leased_block().await;
    let stored = world
        .catalog
        .checkpoint_block(lease, done(&work, BlockStage::Face));
    let lease = continued(stored.await.expect("stored"));
    let mut refused = failed(&work, BlockStage::Align, FailureAction::Quarantine);
    let gone = InputVersion::gone();
    refused.provenance.mesh = Some(gone.hash);
    refused.inputs.mesh = Some(gone);
    let stored = world.catalog.fail_block(lease, refused).await;
    assert!(stored.expect("stored"));
    let nothing = RetrySelection::Names(Vec::new());
    let retried = world
        .catalog
        .retry_pairs_and_blocks(&nothing, &RetrySelection::All)
        .await;
    assert_eq!(retried.expect("retried"), [0, 1]);
    let requeued = world.requeue_blocks([1; 4]).await;
    assert_eq!(requeued, [(BlockStage::Align, BlockReason::Unfinished)]);
}

#[tokio::test]
async fn a_failed_pair_is_requeued_when_its_settings_change() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let failed = super::failed(
        world.fingerprints,
        Stage::Fit,
        Failure::new(FailureClass::NoSolution, "no relief"),
        FailureAction::Quarantine,
    );
    assert!(world.catalog.fail(lease, failed).await.expect("stored"));
    assert_eq!(requeue_stale(&world, &fingerprints([1; 4])).await, 0);
    assert_eq!(requeue_stale(&world, &fingerprints([1, 2, 1, 1])).await, 0);
    assert_eq!(requeue_stale(&world, &fingerprints([2, 1, 1, 1])).await, 1);
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let results = detail.expect("the pair").results;
    assert_eq!((results.status, results.failure), (JobStatus::Ready, None));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_leased_pair_is_never_requeued() {
    let world = World::new(1).await;
    let _lease = world.claim(1).await;
    let fingerprints = fingerprints([2; 4]);
    let again = RerunPolicy::All(Stage::Fit);
    let sent = world.catalog.requeue_stale(&fingerprints, None, again);
    assert_eq!(sent.await.expect("requeued"), 0);
    world.assert_counters().await;
}
