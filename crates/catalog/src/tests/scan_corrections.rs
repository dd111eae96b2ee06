//! Units and sides of scans that a person corrects.

use serde_json::json;

use super::blocks::{character, world};
use super::{World, failed, fingerprints, name, row};
use crate::{FailureAction, PairAttributes, RerunPolicy, ScanCorrection, StageCheckpoint};
use mocban_core::domain::{
    Failure, FailureClass, JobStatus, LengthUnit, PairName, Rigid3, Stage, UNIT_CLAUSES,
    test_values::flat_fit,
};

/// Lets the next pair fail at its first stage, and returns its name.
async fn fail_next(world: &World, class: FailureClass, message: &str) -> PairName {
    let lease = world.claim(1).await.pop().expect("a ready pair");
    let failed = failed(
        world.fingerprints,
        Stage::Fit,
        Failure::new(class, message),
        FailureAction::Quarantine,
    );
    assert!(world.catalog.fail(lease, failed).await.expect("stored"));
    let failed = world.catalog.failed_scans(class, false, [9, 9]).await;
    failed.expect("a read").pop().expect("a failed pair")
}

async fn attributes_of(world: &World, pair: &PairName) -> PairAttributes {
    let detail = world.catalog.pair(pair).await.expect("a read");
    detail.expect("the pair").results.attributes
}

/// Corrects pairs and returns how many have changed.
async fn correct(world: &World, names: &[PairName], correction: ScanCorrection) -> u64 {
    let changed = world.catalog.correct_scans(names.to_vec(), correction, 9);
    let changed = changed.await.expect("stored");
    world.assert_counters().await;
    changed
}

#[tokio::test]
async fn a_corrected_unit_lets_failed_and_finished_pairs_run_again() {
    let world = World::new(2).await;
    let failed = fail_next(
        &world,
        FailureClass::BadInput,
        "with the unit m, the scan is 12.5 m long; correct the unit",
    )
    .await;
    world.finish_one().await;
    let both = [name("p0"), name("p1")];
    let cm = ScanCorrection::Unit(Some(LengthUnit::Cm));
    assert_eq!(correct(&world, &both, cm).await, 2);
    assert_eq!(correct(&world, &both, cm).await, 0, "they have it");
    assert_eq!(
        attributes_of(&world, &failed).await.unit,
        Some(LengthUnit::Cm)
    );
    let settings = fingerprints([1; 4]);
    let requeued = world
        .catalog
        .requeue_stale(&settings, None, RerunPolicy::Changed);
    assert_eq!(requeued.await.expect("requeued"), 2);
    for pair in &both {
        let detail = world.catalog.pair(pair).await.expect("a read");
        let results = detail.expect("the pair").results;
        assert_eq!(
            (results.status, results.next_stage),
            (JobStatus::Ready, Some(Stage::Fit))
        );
    }
    assert_eq!(correct(&world, &both, ScanCorrection::Unit(None)).await, 2);
    assert_eq!(attributes_of(&world, &failed).await.unit, None);
}

#[tokio::test]
async fn only_failures_that_name_the_unit_are_found_if_asked() {
    let world = World::new(1 + UNIT_CLAUSES.len()).await;
    let class = FailureClass::BadInput;
    let message = "the unit.stl: the mesh has no faces";
    let first = fail_next(&world, class, message).await;
    let found = async |names_unit, limits| {
        let found = world.catalog.failed_scans(class, names_unit, limits).await;
        found.expect("a read")
    };
    assert_eq!(found(false, [9, 9]).await, [first]);
    assert_eq!(found(true, [9, 9]).await.len(), 0);
    for (number, clause) in (1..).zip(UNIT_CLAUSES) {
        fail_next(&world, class, &format!("p.stl: odd; {clause}, and more")).await;
        assert_eq!(found(true, [9, 9]).await.len(), number, "{clause}");
        assert_eq!(found(false, [9, 9]).await.len(), number + 1);
    }
    assert_eq!(found(false, [9, 1]).await.len(), 1, "the limit");
    let other = FailureClass::NoSolution;
    let other = world.catalog.failed_scans(other, false, [9, 9]).await;
    assert_eq!(other.expect("a read").len(), 0);
}

#[tokio::test]
async fn the_other_side_is_that_which_was_not_said() {
    let world = World::new(1).await;
    let pairs = [name("p0")];
    for expected in [true, false] {
        let changed = correct(&world, &pairs, ScanCorrection::OtherSide).await;
        assert_eq!(changed, 1);
        let side = attributes_of(&world, &pairs[0]).await.scanned_face_down;
        assert_eq!(side, Some(expected));
    }
}

#[tokio::test]
async fn the_other_side_is_that_which_fit_has_not_found() {
    for (up, expected) in [(1.0, true), (-1.0, false)] {
        let world = World::new(1).await;
        // Axes of the plane in the scan.
        let axes = [[1.0, 0.0, 0.0], [0.0, up, 0.0], [0.0, 0.0, up]];
        let fit = flat_fit(Rigid3::to_frame(axes, [0.0; 3]));
        let set_fit = |done: &mut StageCheckpoint| {
            if done.stage == Stage::Fit {
                done.outcome = json!(fit).to_string();
            }
        };
        world.finish_with(set_fit).await;
        let pairs = [name("p0")];
        // The second correction changes nothing: the stored fit, and so its other side, is still the same.
        for changed in [1, 0] {
            let found = correct(&world, &pairs, ScanCorrection::OtherSide).await;
            assert_eq!(found, changed);
            let side = attributes_of(&world, &pairs[0]).await.scanned_face_down;
            assert_eq!(side, Some(expected));
        }
    }
}

#[tokio::test]
async fn retired_pairs_and_pairs_of_blocks_are_not_corrected() {
    let world = world().await;
    world.finish_block(vec![character("c01-r01", "a")]).await;
    let imported = world.catalog.import(vec![row("p0")], 1).await;
    assert_eq!(imported.expect("imported").added, 1);
    let names = [name("b_c01-r01"), name("p0")];
    world.retire("p0", 7).await;
    let cm = ScanCorrection::Unit(Some(LengthUnit::Cm));
    assert_eq!(correct(&world, &names, cm).await, 0);
    assert_eq!(attributes_of(&world, &names[0]).await.unit, None);
}
