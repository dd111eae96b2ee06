//! Lists of pairs: filters, orders and pages.

use super::{CatalogPlace, World, fingerprints, name, row};
use crate::{
    ImportRow, JointVerdict, ListedNames, MetricDifference, NewVerdict, PairCursor, PairFilter,
    PairOrder, RerunPolicy, ReviewContext, StageCheckpoint,
};
use mocban_core::domain::{
    ContentHash, FailureClass, JobStatus, ReviewOrder, Stage, ThresholdMetric, Verdict,
};

/// Imports `count` pairs of two blocks and gives the first `finished` of them results whose confidence falls and then rises.
async fn world(count: usize, finished: usize) -> World {
    let world = World::at(CatalogPlace::new(), 0).await;
    let rows = (0..count).map(|n| ImportRow {
        block: Some(format!("b{}", n % 2)),
        character: Some(["明", "堂", "木"][n % 3].to_owned()),
        ..row(&format!("p{n:03}"))
    });
    let rows = rows.collect();
    world.catalog.import(rows, 1).await.expect("imported");
    for n in 0..finished {
        world.finish_with(|done| set_scores(done, n)).await;
    }
    world
}

fn confidence(n: usize) -> f64 {
    ((n as f64) - 5.0).abs() / 10.0
}

fn set_scores(checkpoint: &mut StageCheckpoint, n: usize) {
    for metric in &mut checkpoint.metrics {
        metric.outcome.confidence = Some(confidence(n));
        let is_other = metric.outcome.metric == ThresholdMetric::Density;
        metric.outcome.scores.iou = n as f64 / if is_other { 50.0 } else { 100.0 };
    }
}

/// Reads a whole list in pages and returns the numbers of its pairs.
async fn listed(world: &World, filter: &PairFilter, order: PairOrder, size: usize) -> Vec<usize> {
    let (mut after, mut found): (Option<PairCursor>, Vec<usize>) = (None, Vec::new());
    loop {
        let page = world
            .catalog
            .pair_list(filter, order, ThresholdMetric::Ensemble, after, size)
            .await
            .expect("a page");
        assert!(page.pairs.len() <= size);
        let names = page.pairs.iter().map(|pair| pair.attributes.name.as_str());
        found.extend(names.map(|name| name[1..].parse::<usize>().expect("a number")));
        match page.next {
            Some(next) => after = Some(next),
            None => return found,
        }
    }
}

#[tokio::test]
async fn every_order_has_each_pair_once_whatever_the_size_of_its_pages() {
    let world = world(14, 11).await;
    let all = PairFilter::default();
    for size in [1, 3, 50] {
        let imported = listed(&world, &all, PairOrder::Imported, size).await;
        assert_eq!(imported, (0..14).collect::<Vec<_>>(), "{size}");
        let mut least: Vec<usize> = (0..11).collect();
        least.sort_by(|a, b| confidence(*a).total_cmp(&confidence(*b)));
        let found = listed(&world, &all, PairOrder::LeastConfident, size).await;
        assert_eq!(found, least, "{size}");
        least.reverse();
        let found = listed(&world, &all, PairOrder::MostConfident, size).await;
        assert_eq!(found, least, "{size}");
        let found = listed(&world, &all, PairOrder::LowestIou, size).await;
        assert_eq!(found, (0..11).collect::<Vec<_>>(), "{size}");
        let found = listed(&world, &all, PairOrder::HighestIou, size).await;
        assert_eq!(found, (0..11).rev().collect::<Vec<_>>(), "{size}");
    }
}

#[tokio::test]
async fn filters_hold_together_in_every_order() {
    let world = world(14, 11).await;
    let filter = PairFilter {
        block: Some("b1".to_owned()),
        statuses: vec![JobStatus::Done],
        ..PairFilter::default()
    };
    for size in [2, 50] {
        let found = listed(&world, &filter, PairOrder::Imported, size).await;
        assert_eq!(found, [1, 3, 5, 7, 9]);
        let found = listed(&world, &filter, PairOrder::HighestIou, size).await;
        assert_eq!(found, [9, 7, 5, 3, 1]);
        let found = listed(&world, &filter, PairOrder::LeastConfident, size).await;
        assert_eq!(found, [5, 3, 7, 1, 9]);
    }
    let both = PairFilter {
        character: Some("明".to_owned()),
        ..filter.clone()
    };
    assert_eq!(listed(&world, &both, PairOrder::Imported, 1).await, [3, 9]);
    let waiting = PairFilter {
        statuses: vec![JobStatus::Ready, JobStatus::Backoff],
        ..PairFilter::default()
    };
    let found = listed(&world, &waiting, PairOrder::Imported, 2).await;
    assert_eq!(found, [11, 12, 13]);
    let none = PairFilter {
        class: Some(FailureClass::Io),
        ..PairFilter::default()
    };
    assert!(
        listed(&world, &none, PairOrder::Imported, 2)
            .await
            .is_empty()
    );
}

#[tokio::test]
async fn retired_pairs_are_in_no_list_and_verdicts_are_found() {
    let world = world(8, 8).await;
    world.retire("p002", 9).await;
    let given = NewVerdict {
        pair: name("p004"),
        metric: Some(ThresholdMetric::Ensemble),
        ..super::verdicts::verdict("ana", Verdict::Fail)
    };
    let stored = world.catalog.verdict_set(vec![given], 9).await;
    stored.expect("a verdict");
    let all = PairFilter::default();
    let found = listed(&world, &all, PairOrder::Imported, 3).await;
    assert_eq!(found, [0, 1, 3, 4, 5, 6, 7]);
    let found = listed(&world, &all, PairOrder::LowestIou, 3).await;
    assert_eq!(found, [0, 1, 3, 4, 5, 6, 7]);
    let failed = PairFilter {
        verdict: Some(Verdict::Fail),
        ..PairFilter::default()
    };
    assert_eq!(listed(&world, &failed, PairOrder::Imported, 3).await, [4]);
    let of_relief = world.catalog.pair_list(
        &failed,
        PairOrder::Imported,
        ThresholdMetric::Relief,
        None,
        3,
    );
    assert!(of_relief.await.expect("a page").pairs.is_empty());
    let passed = PairFilter {
        verdict: Some(Verdict::Pass),
        ..PairFilter::default()
    };
    assert!(
        listed(&world, &passed, PairOrder::LowestIou, 3)
            .await
            .is_empty()
    );
    let unjudged = PairFilter {
        is_judged: Some(false),
        ..PairFilter::default()
    };
    let found = listed(&world, &unjudged, PairOrder::Imported, 2).await;
    assert_eq!(found, [0, 1, 3, 5, 6, 7]);
    let judged = PairFilter {
        is_judged: Some(true),
        ..PairFilter::default()
    };
    for order in [PairOrder::Imported, PairOrder::LowestIou] {
        assert_eq!(listed(&world, &judged, order, 1).await, [4], "{order}");
    }
}

#[tokio::test]
async fn a_joint_verdict_is_undisputed_or_settled_by_adjudications() {
    let world = world(7, 7).await;
    let settles = Some(ReviewOrder::Adjudicate);
    for (pair, reviewer, given, review_order) in [
        ("p000", "ana", Verdict::Pass, None),
        ("p001", "ana", Verdict::Pass, None),
        ("p001", "bo", Verdict::Fail, None),
        ("p002", "ana", Verdict::Pass, None),
        ("p002", "bo", Verdict::Fail, None),
        ("p002", "chi", Verdict::Fail, settles),
        ("p003", "ana", Verdict::Pass, None),
        ("p003", "bo", Verdict::Unsure, None),
        ("p004", "ana", Verdict::Pass, None),
        ("p004", "bo", Verdict::Fail, None),
        ("p004", "chi", Verdict::Unsure, settles),
        ("p005", "ana", Verdict::Unsure, None),
    ] {
        let given = NewVerdict {
            pair: name(pair),
            context: ReviewContext {
                review_order,
                ..ReviewContext::default()
            },
            ..super::verdicts::verdict(reviewer, given)
        };
        let stored = world.catalog.verdict_set(vec![given], 9).await;
        stored.expect("a verdict");
    }
    for (verdict, joint, expected) in [
        (Some(Verdict::Pass), None, &[0, 1, 2, 3, 4][..]),
        (None, Some(JointVerdict::Passed), &[0, 3]),
        (Some(Verdict::Fail), None, &[1, 2, 4]),
        (None, Some(JointVerdict::Failed), &[2]),
        (None, Some(JointVerdict::Decided), &[0, 2, 3]),
        (None, Some(JointVerdict::Conflict), &[1, 4]),
        (None, Some(JointVerdict::Unsure), &[5]),
        (None, Some(JointVerdict::Stale), &[]),
    ] {
        let filter = PairFilter {
            verdict,
            joint,
            ..PairFilter::default()
        };
        for order in [PairOrder::Imported, PairOrder::LowestIou] {
            let found = listed(&world, &filter, order, 2).await;
            assert_eq!(found, expected, "{verdict:?} {joint:?} {order}");
        }
    }
    let judged = PairFilter {
        is_judged: Some(true),
        ..PairFilter::default()
    };
    let found = listed(&world, &judged, PairOrder::Imported, 2).await;
    assert_eq!(found, [0, 1, 2, 3, 4, 5]);
}

#[tokio::test]
async fn a_joint_verdict_is_stale_if_only_an_earlier_result_was_judged() {
    let world = world(3, 3).await;
    let judge = async |pair: &str| {
        let given = NewVerdict {
            pair: name(pair),
            ..super::verdicts::verdict("ana", Verdict::Pass)
        };
        let stored = world.catalog.verdict_set(vec![given], 9).await;
        stored.expect("a verdict");
    };
    judge("p000").await;
    judge("p001").await;
    let stale = PairFilter {
        joint: Some(JointVerdict::Stale),
        ..PairFilter::default()
    };
    let found = async |size| listed(&world, &stale, PairOrder::Imported, size).await;
    assert!(found(2).await.is_empty());
    let (current, again) = (fingerprints([1; 4]), RerunPolicy::All(Stage::Register));
    let requeued = world.catalog.requeue_stale(&current, None, again).await;
    assert_eq!(requeued.expect("requeued"), 3);
    let running = found(2).await;
    assert!(running.is_empty(), "they have no results: {running:?}");
    for n in 0..3 {
        let change = |done: &mut StageCheckpoint| {
            set_scores(done, n);
            for metric in &mut done.metrics {
                metric.result_hash = ContentHash::of(b"another");
            }
        };
        world.finish_with(change).await;
    }
    judge("p001").await;
    assert_eq!(found(2).await, [0]);
    let undone = world.catalog.verdict_undo(Some("ana"), 10).await;
    undone.expect("undone");
    assert_eq!(found(1).await, [0, 1]);
}

#[tokio::test]
async fn the_latest_results_come_first() {
    let world = world(6, 4).await;
    let recent = world.catalog.recent_results(3).await.expect("pairs");
    let names: Vec<_> = recent
        .iter()
        .map(|pair| pair.attributes.name.as_str())
        .collect();
    assert_eq!(names, ["p003", "p002", "p001"]);
    let (current, all) = (fingerprints([1; 4]), RerunPolicy::All(Stage::Fit));
    let requeued = world.catalog.requeue_stale(&current, None, all);
    assert!(requeued.await.expect("requeued") >= 4);
    let recent = world.catalog.recent_results(3).await.expect("pairs");
    assert_eq!(recent.len(), 0, "their results are computed again");
    let blocks = world.catalog.first_listed_blocks(9).await.expect("blocks");
    assert_eq!(blocks, ["b0", "b1"]);
}

#[tokio::test]
async fn the_least_confident_results_since_a_time_come_first() {
    let world = world(14, 11).await;
    let least = async |since, metric| {
        let found = world.catalog.least_confident_results(since, metric, 3);
        let found = found.await.expect("pairs");
        let names = found.iter().map(|pair| pair.attributes.name.to_string());
        names.collect::<Vec<_>>()
    };
    // All results were stored at 100.
    for metric in [ThresholdMetric::Ensemble, ThresholdMetric::Density] {
        assert_eq!(least(100, metric).await, ["p005", "p004", "p006"]);
    }
    assert!(least(101, ThresholdMetric::Ensemble).await.is_empty());
    world.retire("p005", 9).await;
    let left = least(100, ThresholdMetric::Ensemble).await;
    assert_eq!(left, ["p004", "p006", "p003"]);
    let (current, all) = (fingerprints([1; 4]), RerunPolicy::All(Stage::Fit));
    let requeued = world.catalog.requeue_stale(&current, None, all);
    requeued.await.expect("requeued");
    let left = least(100, ThresholdMetric::Ensemble).await;
    assert!(left.is_empty(), "their results are computed again");
}

#[tokio::test]
async fn pairs_whose_metrics_differ_are_found() {
    let world = world(14, 11).await;
    let filter = PairFilter {
        differs: Some(MetricDifference {
            from: ThresholdMetric::Density,
            min_iou: 0.065,
        }),
        ..PairFilter::default()
    };
    let found = listed(&world, &filter, PairOrder::Imported, 2).await;
    assert_eq!(found, [7, 8, 9, 10]);
    let found = listed(&world, &filter, PairOrder::HighestIou, 3).await;
    assert_eq!(found, [10, 9, 8, 7]);
    let same = PairFilter {
        differs: Some(MetricDifference {
            from: ThresholdMetric::Relief,
            min_iou: 0.001,
        }),
        ..PairFilter::default()
    };
    let found = listed(&world, &same, PairOrder::Imported, 50).await;
    assert_eq!(found, [0; 0]);
}

#[tokio::test]
async fn the_names_of_a_list_are_all_or_none() {
    let world = world(14, 11).await;
    let names = async |filter: &PairFilter, order, limit| {
        let metric = ThresholdMetric::Ensemble;
        let found = world.catalog.listed_names(filter, order, metric, limit);
        found.await.expect("names")
    };
    let filter = PairFilter {
        block: Some("b1".to_owned()),
        ..PairFilter::default()
    };
    let expected = [1, 3, 5, 7, 9].map(|n| name(&format!("p{n:03}"))).to_vec();
    for limit in [5, 6, 100] {
        let found = names(&filter, PairOrder::HighestIou, limit).await;
        assert_eq!(found, ListedNames::All(expected.clone()), "{limit}");
    }
    for limit in [1, 4] {
        let found = names(&filter, PairOrder::HighestIou, limit).await;
        assert_eq!(found, ListedNames::TooMany, "{limit}");
    }
    let found = names(&PairFilter::default(), PairOrder::Imported, 13).await;
    assert_eq!(found, ListedNames::TooMany);
    let found = names(&PairFilter::default(), PairOrder::Imported, 14).await;
    assert!(matches!(found, ListedNames::All(all) if all.len() == 14));
}
