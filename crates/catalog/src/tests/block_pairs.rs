//! Pairs that are cut from blocks: added, changed, retired and brought back.

use serde_json::json;

use super::blocks::{attributes, block, character, stored, version, world};
use super::{World, name};
use crate::{
    BlockAttributes, BlockInputVersions, BlockReason, CharacterMaps, CheckpointOutcome, CutOrigin,
    CutReply, CutSummary, NewCharacter, NewVerdict, PrintPlace, RetiredPair, ReviewContext,
};
use mocban_core::domain::{
    BlockCharacterState, BlockName, BlockStage, JobStatus, PairName, PrintFromMesh, RetireCause,
    Stage, ThresholdMetric, TrueBox, Verdict,
};

#[tokio::test]
async fn a_finished_block_leaves_pairs_that_run() {
    let world = world().await;
    let cut = vec![character("c01-r01", "a"), character("c01-r02", "b")];
    assert_eq!(world.finish_block(cut).await, stored(2, 0, 0, 0));
    world.assert_counters().await;
    let detail = world.catalog.block(&block("b")).await.expect("a read");
    let detail = detail.expect("the block");
    assert_eq!(detail.state.status, JobStatus::Done);
    assert_eq!((detail.stages.len(), detail.attempts.len()), (4, 4));
    assert_eq!(detail.state.characters, 2);
    let pair = world
        .catalog
        .pair(&name("b_c01-r02"))
        .await
        .expect("a read");
    let attributes = pair.expect("the pair").results.attributes;
    assert_eq!(attributes.block.as_deref(), Some("b"));
    assert_eq!(attributes.character.as_deref(), Some("天"));
    assert_eq!(attributes.prior.as_deref(), Some(r#"{"angle_deg":0.5}"#));
    assert!(world.claim_block(world.worker).await.is_none());
    assert_eq!(world.claim(9).await.len(), 2);
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
}

#[tokio::test]
async fn pairs_know_from_where_they_were_cut() {
    let world = world().await;
    let others = ["a", "b_c01-r015", "b_z", "ba", "c_c01-r01"].map(super::row);
    let others = world.catalog.import(others.to_vec(), 1).await;
    assert_eq!(others.expect("imported").added, 5);
    let maps = CharacterMaps {
        page_from_crop: [[1.0, 0.0, 7.0], [0.0, 1.0, 9.0], [0.0, 0.0, 1.0]],
        page_from_mesh: PrintFromMesh([[2.0; 4]; 3]),
    };
    let cut = ["c01-r01", "c01-r02", "c01-r03"].map(|label| NewCharacter {
        maps: serde_json::to_value(maps).ok(),
        ..character(label, label)
    });
    world.finish_block(cut.to_vec()).await;
    let [first, last] = ["b_c01-r01", "b_c01-r02"].map(name);
    let origins = world.catalog.cut_origins_between(&first, &last);
    let origins = origins.await.expect("a read");
    let names: Vec<_> = origins.keys().cloned().collect();
    assert_eq!(names, [first.clone(), last]);
    let expected = CutOrigin {
        label: "c01-r01".to_owned(),
        bounds: [1.0, 2.0, 30.5, 40.25],
        maps: Some(maps),
    };
    assert_eq!(origins[&first], expected);
    let found = world.catalog.pairs_of_block(&block("b")).await;
    let found = found.expect("a read").into_iter();
    let found: Vec<_> = found.map(|pair| pair.attributes.name).collect();
    let cut = ["b_c01-r01", "b_c01-r02", "b_c01-r03"];
    assert_eq!(found, cut.map(name));
}

#[tokio::test]
async fn true_boxes_stay_until_the_block_gets_another_page() {
    let world = world().await;
    let boxes = [1.0, 2.5].map(|left| TrueBox {
        bounds: [left, 0.0, 9.0, 9.5],
        is_partial: left > 2.0,
    });
    let set = async |block: BlockName| {
        let set = world.catalog.set_true_boxes(&block, &boxes);
        set.await.expect("stored")
    };
    assert!(set(block("b")).await);
    assert!(!set(block("of nobody")).await);
    let stored = async || world.catalog.true_boxes().await.expect("a read");
    assert_eq!(stored().await, [(block("b"), boxes.to_vec())]);
    let other_labels = BlockAttributes {
        labels_path: None,
        ..attributes("b")
    };
    world.import_block(other_labels).await;
    assert_eq!(stored().await.len(), 1);
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
    let other_page = BlockAttributes {
        page_path: "other.png".to_owned(),
        ..attributes("b")
    };
    world.import_block(other_page).await;
    assert_eq!(stored().await, []);
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn the_truth_of_a_cut_pair_keeps_the_crop_that_it_is_for() {
    let world = world().await;
    let crop = |x: f64| [[1.0, 0.0, x], [0.0, 1.0, 9.0], [0.0, 0.0, 1.0]];
    let cut = |x: f64, content: &str| NewCharacter {
        maps: Some(json!({ "page_from_crop": crop(x) })),
        bounds: [x, 2.0, 30.5, 40.25],
        ..character("a", content)
    };
    world.finish_block(vec![cut(7.0, "1")]).await;
    let imported = world.catalog.import(vec![super::row("other")], 1).await;
    imported.expect("imported");
    let truth = |id: &str| (name(id), json!({ "id": id }));
    let given = vec![truth("b_a"), truth("other")];
    assert_eq!(world.catalog.set_truth(given).await.expect("stored"), 2);
    let results = async |pair: &str| {
        let detail = world.catalog.pair(&name(pair)).await.expect("a read");
        detail.expect("the pair").results
    };
    let other = results("other").await;
    assert_eq!(
        (other.truth, other.print_place),
        (Some(json!({ "id": "other" })), None)
    );
    let body = json!({ "id": "b_a", "page_from_crop": crop(7.0) });
    let known = world.catalog.known_blocks().await.expect("a read");
    let changed = BlockInputVersions {
        labels: Some(version("moved boxes")),
        ..BlockInputVersions::default()
    };
    for (x, is_moved) in [(7.0, false), (5.5, true)] {
        if is_moved {
            let labels = BlockAttributes {
                labels_path: Some("moved.json".to_owned()),
                ..attributes("b")
            };
            world.import_block(labels).await;
            let seen = vec![(known[0].block, changed.clone())];
            let stored = world.catalog.store_block_inputs(seen).await;
            stored.expect("stored");
            assert_eq!(world.requeue_blocks([1; 4]).await.len(), 1);
            world.finish_block(vec![cut(x, "2")]).await;
        }
        let found = results("b_a").await;
        assert_eq!(found.truth.as_ref(), Some(&body), "{x}");
        let place = PrintPlace {
            page_from_crop: crop(x),
            bounds: [x, 2.0, 30.5, 40.25],
        };
        assert_eq!(found.print_place, Some(place), "{x}");
    }
}

#[tokio::test]
async fn only_changed_characters_run_again_and_verdicts_stay() {
    let world = world().await;
    let [a, b, c] = ["a", "b", "c"].map(|label| character(label, label));
    let first = vec![a.clone(), b.clone(), c.clone()];
    assert_eq!(world.finish_block(first).await, stored(3, 0, 0, 0));
    for _ in 0..3 {
        world.finish_one().await;
    }
    judge(&world, "b_b").await;
    judge(&world, "b_c").await;
    let new_labels = BlockAttributes {
        labels_path: Some("new.json".to_owned()),
        ..attributes("b")
    };
    world.import_block(new_labels).await;
    let changed = BlockInputVersions {
        labels: Some(version("other labels")),
        ..BlockInputVersions::default()
    };
    let known = world.catalog.known_blocks().await.expect("a read");
    let seen = vec![(known[0].block, changed)];
    world
        .catalog
        .store_block_inputs(seen)
        .await
        .expect("stored");
    let requeued = world.requeue_blocks([1; 4]).await;
    assert_eq!(requeued, [(BlockStage::Boxes, BlockReason::Labels)]);
    // `b` has other bytes, the box of `c` is gone.
    let second = vec![a.clone(), character("b", "new b")];
    let summary = CutSummary {
        changed: 1,
        unchanged: 1,
        retired: 1,
        judged: 2,
        ..CutSummary::default()
    };
    assert_eq!(world.finish_block(second).await, CutReply::Stored(summary));
    world.assert_counters().await;
    assert_eq!(status_of(&world, "b_a").await, Some(JobStatus::Done));
    assert_eq!(status_of(&world, "b_b").await, Some(JobStatus::Ready));
    assert_eq!(status_of(&world, "b_c").await, None);
    let retired = world.catalog.retired_pairs().await.expect("a read");
    assert_eq!(names_of(&retired), [name("b_c")]);
    assert_eq!(retired[0].cause, RetireCause::Labels);
    let counts = world.catalog.status(&super::fingerprints([1; 4])).await;
    assert_eq!(counts.expect("a read").retired, 1);
    let of_c = name("b_c");
    let log = async || {
        world
            .catalog
            .verdict_log(Some(&of_c))
            .await
            .expect("a read")
    };
    assert_eq!(log().await.len(), 1);
    let states = world.character_states().await;
    let gone = (
        "c".to_owned(),
        BlockCharacterState::Retired,
        Some("b_c".to_owned()),
    );
    assert_eq!(states[2], gone);
    // The box comes back with the same bytes.
    world
        .catalog
        .reset_blocks(vec![(known[0].block, BlockStage::Cut)])
        .await
        .expect("reset");
    let third = vec![a, character("b", "new b"), c];
    let summary = CutSummary {
        unchanged: 3,
        restored: 1,
        ..CutSummary::default()
    };
    assert_eq!(world.finish_block(third).await, CutReply::Stored(summary));
    world.assert_counters().await;
    assert_eq!(status_of(&world, "b_c").await, Some(JobStatus::Done));
    let log = log().await;
    assert!(log[0].current, "{log:?}");
}

#[tokio::test]
async fn a_changed_pair_loses_its_lease() {
    let world = world().await;
    world.finish_block(vec![character("a", "a")]).await;
    let lease = world.claim(1).await.pop().expect("a pair");
    let known = world.catalog.known_blocks().await.expect("a read");
    let reset = world
        .catalog
        .reset_blocks(vec![(known[0].block, BlockStage::Cut)]);
    reset.await.expect("reset");
    let again = world.finish_block(vec![character("a", "new")]).await;
    assert_eq!(again, stored(0, 1, 0, 0));
    let late = world.catalog.checkpoint_now(lease, world.done(Stage::Fit));
    let late = late.await.expect("a reply");
    assert!(matches!(late, CheckpointOutcome::Refused));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_pair_that_is_not_of_the_block_is_not_replaced() {
    // A name in other case is the same file on Windows and macOS.
    for (listed, label) in [("b_a", "a"), ("B_A", "a"), ("b_ĐĨA", "đĩa")] {
        let world = world().await;
        let row = super::row(listed);
        world.catalog.import(vec![row], 1).await.expect("imported");
        let cut = world.finish_block(vec![character(label, "a")]).await;
        assert_eq!(cut, CutReply::NameTaken(name(listed)));
        let states = world.catalog.block_states().await.expect("a read");
        assert_eq!(states[0].next_stage, Some(BlockStage::Cut));
        assert_eq!(world.character_states().await, []);
        assert_eq!(
            world.catalog.pair_names().await.expect("a read"),
            [name(listed)]
        );
    }
}

#[tokio::test]
async fn a_new_character_of_a_known_block_takes_no_name_in_other_case() {
    let world = world().await;
    world.finish_block(vec![character("a", "a")]).await;
    let row = super::row("B_c");
    world.catalog.import(vec![row], 1).await.expect("imported");
    for (label, expected) in [
        ("c", CutReply::NameTaken(name("B_c"))),
        ("d", stored(1, 0, 1, 0)),
    ] {
        let known = world.catalog.known_blocks().await.expect("a read");
        let reset = vec![(known[0].block, BlockStage::Cut)];
        world.catalog.reset_blocks(reset).await.expect("reset");
        let cut = vec![character("a", "a"), character(label, label)];
        assert_eq!(world.finish_block(cut).await, expected);
    }
}

#[tokio::test]
async fn verdicts_of_a_retired_pair_are_kept_but_not_counted() {
    let world = world().await;
    world.finish_block(vec![character("a", "a")]).await;
    world.finish_one().await;
    judge(&world, "b_a").await;
    let fingerprints = super::fingerprints([1; 4]);
    let status = world.catalog.status(&fingerprints).await.expect("a read");
    assert_eq!((status.pairs, status.verdicts[&Verdict::Pass]), (1, 1));
    let known = world.catalog.known_blocks().await.expect("a read");
    let reset = vec![(known[0].block, BlockStage::Cut)];
    world.catalog.reset_blocks(reset).await.expect("reset");
    let summary = CutSummary {
        retired: 1,
        judged: 1,
        ..CutSummary::default()
    };
    assert_eq!(
        world.finish_block(Vec::new()).await,
        CutReply::Stored(summary)
    );
    let status = world.catalog.status(&fingerprints).await.expect("a read");
    assert_eq!((status.pairs, status.verdicts[&Verdict::Pass]), (0, 0));
    assert_eq!(
        world.catalog.verdict_log(None).await.expect("a read").len(),
        1
    );
    // An import of the same pair brings it back too.
    let row = super::row("b_a");
    world.catalog.import(vec![row], 2).await.expect("imported");
    world.assert_counters().await;
    assert_eq!(status_of(&world, "b_a").await, Some(JobStatus::Done));
    assert_eq!(world.catalog.retired_pairs().await.expect("a read"), []);
}

#[tokio::test]
async fn a_copy_holds_blocks_and_retired_pairs() {
    let world = world().await;
    let cut = vec![character("a", "a"), character("b", "b")];
    world.finish_block(cut).await;
    let known = world.catalog.known_blocks().await.expect("a read");
    let reset = vec![(known[0].block, BlockStage::Cut)];
    world.catalog.reset_blocks(reset).await.expect("reset");
    world.finish_block(vec![character("a", "a")]).await;
    let target = super::CatalogPlace::new();
    let copy = target.create().await.expect("a catalog");
    world
        .catalog
        .copy_to(&copy, |_, _| {})
        .await
        .expect("copied");
    let states = |catalog: crate::Catalog| async move {
        let states = catalog.block_states().await.expect("a read");
        let characters = catalog.block_characters(&block("b")).await;
        let retired = catalog.retired_pairs().await.expect("a read");
        (states, characters.expect("a read"), retired)
    };
    let found = states(copy.clone()).await;
    assert_eq!(found, states(world.catalog.clone()).await);
    assert_eq!(names_of(&found.2), [name("b_b")]);
    let counters = copy.counters().await.expect("counters");
    assert_eq!(counters, copy.recount().await.expect("a recount"));
    // New rows of the copy get new numbers.
    let imported = copy.import_blocks(vec![attributes("c")], false, 3).await;
    assert_eq!(imported.expect("imported").added, 1);
    assert_eq!(copy.faulty_rows().await.expect("a read"), []);
}

/// Returns the names of retired pairs.
pub(super) fn names_of(retired: &[RetiredPair]) -> Vec<PairName> {
    retired.iter().map(|pair| pair.name.clone()).collect()
}

pub(super) async fn status_of(world: &World, pair: &str) -> Option<JobStatus> {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    detail.map(|detail| detail.results.status)
}

pub(super) async fn judge(world: &World, pair: &str) {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    let results = detail.expect("the pair").results;
    assert_eq!(results.status, JobStatus::Done);
    let verdict = NewVerdict {
        pair: name(pair),
        metric: Some(ThresholdMetric::DEFAULT),
        verdict: Verdict::Pass,
        reviewer: "lan".to_owned(),
        reason: None,
        note: None,
        context: ReviewContext::default(),
        at: None,
    };
    let stored = world.catalog.verdict_set(vec![verdict], 5).await;
    stored.expect("stored");
}

#[tokio::test]
async fn a_pair_runs_again_only_if_its_prior_changes() {
    let world = world().await;
    let with_shift = |shift: f64| {
        let mut one = character("a", "a");
        let prior = json!({ "shift": shift }).to_string();
        one.cut.as_mut().expect("cut").prior = Some(prior);
        vec![one]
    };
    let first = world.finish_block(with_shift(0.0)).await;
    assert_eq!(first, stored(1, 0, 0, 0));
    for (shift, expected) in [(0.0, stored(0, 0, 1, 0)), (0.01, stored(0, 1, 0, 0))] {
        let known = world.catalog.known_blocks().await.expect("a read");
        let reset = vec![(known[0].block, BlockStage::Cut)];
        world.catalog.reset_blocks(reset).await.expect("reset");
        let cut = world.finish_block(with_shift(shift)).await;
        assert_eq!(cut, expected, "{shift}");
    }
}
