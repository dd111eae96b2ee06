//! Verdicts: bound to results, appended, undone.

use super::{World, name};
use crate::db::query::query;
use crate::{Catalog, CatalogError, CheckpointOutcome, NewVerdict, RerunPolicy, ReviewContext};
use mocban_core::domain::{ContentHash, Reason, Stage, ThresholdMetric, Verdict};

/// Number of metrics with a result, of a pair that is done.
const METRICS: usize = ThresholdMetric::ALL.len();

pub(super) fn verdict(reviewer: &str, verdict: Verdict) -> NewVerdict {
    NewVerdict {
        pair: name("p0"),
        metric: None,
        verdict,
        reviewer: reviewer.to_owned(),
        reason: (verdict == Verdict::Fail).then_some(Reason::Angle),
        note: None,
        context: ReviewContext::default(),
        at: None,
    }
}

pub(super) async fn counted(catalog: &Catalog) -> Vec<(String, Verdict)> {
    let detail = catalog.pair(&name("p0")).await.expect("a read");
    let metrics = detail.expect("the pair").results.metrics;
    let of_first = metrics[0].verdicts.iter();
    of_first.map(|v| (v.reviewer.clone(), v.verdict)).collect()
}

#[tokio::test]
async fn the_newest_verdict_of_each_reviewer_counts() {
    let world = World::new(1).await;
    world.finish_one().await;
    for given in [
        verdict("ana", Verdict::Pass),
        verdict("bo", Verdict::Unsure),
        verdict("ana", Verdict::Fail),
    ] {
        world
            .catalog
            .verdict_set(vec![given], 5)
            .await
            .expect("stored");
    }
    let expected = [
        ("ana".to_owned(), Verdict::Fail),
        ("bo".to_owned(), Verdict::Unsure),
    ];
    assert_eq!(counted(&world.catalog).await, expected);
    let status = world.catalog.status(&super::fingerprints([1; 4])).await;
    let status = status.expect("a read");
    assert_eq!(status.verdicts[&Verdict::Fail], METRICS as u64);
    assert_eq!(status.verdicts[&Verdict::Pass], 0);
    assert_eq!(
        world.catalog.verdict_log(None).await.expect("a log").len(),
        3 * METRICS
    );
    let count = world.catalog.count_verdicts().await.expect("a count");
    assert_eq!(count, 3 * METRICS as u64);
}

#[tokio::test]
async fn verdicts_of_pairs_that_are_not_done_are_counted_nowhere() {
    let world = World::new(1).await;
    world.finish_one().await;
    let given = vec![verdict("ana", Verdict::Pass)];
    world.catalog.verdict_set(given, 5).await.expect("stored");
    let fingerprints = super::fingerprints([1; 4]);
    let passed = async || {
        let status = world.catalog.status(&fingerprints).await;
        let pair = world.catalog.pair(&name("p0")).await.expect("a read");
        let metrics = pair.expect("the pair").results.metrics;
        let of_report: usize = metrics.iter().map(|record| record.verdicts.len()).sum();
        let of_status = status.expect("a read").verdicts[&Verdict::Pass];
        (of_status, of_report as u64)
    };
    assert_eq!(passed().await, (METRICS as u64, METRICS as u64));
    let all = RerunPolicy::All(Stage::Fit);
    let requeued = world.catalog.requeue_stale(&fingerprints, None, all).await;
    assert_eq!(requeued.expect("requeued"), 1);
    assert_eq!(passed().await, (0, 0));
}

#[tokio::test]
async fn a_verdict_without_a_time_that_equals_the_newest_is_not_stored_again() {
    let world = World::new(1).await;
    world.finish_one().await;
    let set = async |given: &[Verdict]| {
        let given = given.iter().map(|given| verdict("ana", *given)).collect();
        world.catalog.verdict_set(given, 5).await.expect("stored")
    };
    for (given, stored, newest) in [
        (&[Verdict::Pass] as &[_], 1, Verdict::Pass),
        (&[Verdict::Pass], 0, Verdict::Pass),
        (&[Verdict::Fail, Verdict::Pass], 2, Verdict::Pass),
        (&[Verdict::Fail, Verdict::Pass], 2, Verdict::Pass),
        (&[Verdict::Pass, Verdict::Fail], 1, Verdict::Fail),
    ] {
        assert_eq!(set(given).await, stored, "{given:?}");
        assert_eq!(counted(&world.catalog).await, [("ana".to_owned(), newest)]);
    }
    world
        .catalog
        .verdict_undo(Some("ana"), 6)
        .await
        .expect("undone");
    assert_eq!(set(&[Verdict::Fail]).await, 1);
}

/// A name with decomposed letters, as macOS writes it, and the one spelling of it.
const DECOMPOSED: &str = "Tra\u{302}\u{300}n  Bi\u{300}nh ";
const COMPOSED: &str = "Tr\u{1ea7}n B\u{ec}nh";

#[tokio::test]
async fn one_person_is_one_reviewer_however_her_name_is_spelled() {
    let world = World::new(1).await;
    world.finish_one().await;
    let set = |name: &str, given| world.catalog.verdict_set(vec![verdict(name, given)], 5);
    assert_eq!(set(DECOMPOSED, Verdict::Pass).await.expect("stored"), 1);
    assert_eq!(set(COMPOSED, Verdict::Pass).await.expect("known"), 0);
    let log = world.catalog.verdict_log(None).await.expect("a log");
    assert!(
        log.iter().all(|event| event.reviewer == COMPOSED),
        "{log:?}"
    );
}

#[tokio::test]
async fn names_stored_in_an_older_spelling_are_of_the_same_reviewer() {
    let world = World::new(1).await;
    world.finish_one().await;
    let set = |name: &str, given| world.catalog.verdict_set(vec![verdict(name, given)], 5);
    set(COMPOSED, Verdict::Pass).await.expect("stored");
    let mut conn = world.place.conn().await;
    for sql in [
        "INSERT INTO review_act (reviewer) VALUES (?1)",
        "INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
        SELECT (SELECT max(id) FROM review_act), pair, metric, result_hash, 'unsure', ?1, 6 FROM verdict",
    ] {
        query(sql)
            .bind(DECOMPOSED)
            .execute(&mut conn)
            .await
            .expect("stored");
    }
    let newest = [(COMPOSED.to_owned(), Verdict::Unsure)];
    assert_eq!(counted(&world.catalog).await, newest);
    let status = world.catalog.status(&super::fingerprints([1; 4])).await;
    let counts = status.expect("a read").verdicts;
    assert_eq!(counts[&Verdict::Unsure], METRICS as u64);
    assert_eq!(counts[&Verdict::Pass], 0);
    let answers = world.catalog.answers(COMPOSED).await.expect("a read");
    assert_eq!(answers.len(), 2 * METRICS);
    assert_eq!(set(COMPOSED, Verdict::Unsure).await.expect("known"), 0);
    let undone = world.catalog.verdict_undo(Some(COMPOSED), 7).await;
    assert_eq!(undone.expect("undone")[0].verdict, Verdict::Unsure);
    let names = world.catalog.reviewer_names().await.expect("a read");
    assert_eq!(names.into_iter().collect::<Vec<_>>(), [COMPOSED]);
}

#[tokio::test]
async fn undo_affects_the_newest_act_and_the_log_keeps_both() {
    let world = World::new(1).await;
    world.finish_one().await;
    for given in [verdict("ana", Verdict::Pass), verdict("ana", Verdict::Fail)] {
        world
            .catalog
            .verdict_set(vec![given], 5)
            .await
            .expect("stored");
    }
    let undone = world.catalog.verdict_undo(Some("ana"), 6).await;
    let undone = undone.expect("undone");
    assert_eq!(undone.len(), METRICS);
    assert!(undone.iter().all(|event| event.verdict == Verdict::Fail));
    assert_eq!(
        counted(&world.catalog).await,
        [("ana".to_owned(), Verdict::Pass)]
    );
    world.catalog.verdict_undo(None, 7).await.expect("undone");
    let nothing = world.catalog.verdict_undo(None, 8).await;
    assert!(matches!(nothing, Err(CatalogError::NothingToUndo(_))));
    let log = world.catalog.verdict_log(Some(&name("p0"))).await;
    let log = log.expect("a log");
    assert!(log.len() == 2 * METRICS && log.iter().all(|event| event.undone_at.is_some()));
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn a_verdict_without_a_result_or_a_pair_stores_nothing() {
    let world = World::new(2).await;
    world.finish_one().await;
    let early = NewVerdict {
        pair: name("p1"),
        ..verdict("ana", Verdict::Pass)
    };
    let both = vec![verdict("ana", Verdict::Pass), early];
    let refused = world.catalog.verdict_set(both, 5).await;
    assert!(matches!(refused, Err(CatalogError::NoResult(_))));
    let unknown = NewVerdict {
        pair: name("nobody"),
        ..verdict("ana", Verdict::Pass)
    };
    let refused = world.catalog.verdict_set(vec![unknown], 5).await;
    assert!(matches!(refused, Err(CatalogError::UnknownPair(_))));
    assert!(
        world
            .catalog
            .verdict_log(None)
            .await
            .expect("a log")
            .is_empty()
    );
}

#[tokio::test]
async fn a_new_result_does_not_inherit_a_verdict_and_the_same_result_keeps_it() {
    let world = World::new(1).await;
    world.finish_one().await;
    let given = vec![verdict("ana", Verdict::Pass)];
    world.catalog.verdict_set(given, 5).await.expect("stored");
    let again = crate::RerunPolicy::All(Stage::Register);
    for changed in [false, true] {
        let sent = world
            .catalog
            .requeue_stale(&super::fingerprints([1; 4]), None, again)
            .await;
        assert_eq!(sent.expect("requeued"), 1);
        let lease = world.claim(1).await.remove(0);
        let mut done = world.done(Stage::Register);
        if changed {
            done.metrics[0].result_hash = ContentHash::of(b"another");
        }
        let kept = world.catalog.checkpoint_now(lease, done).await;
        assert!(matches!(kept, Ok(CheckpointOutcome::Done)));
        assert_eq!(counted(&world.catalog).await.is_empty(), changed);
    }
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let results = detail.expect("the pair").results;
    let first = results.metric(ThresholdMetric::NlSsim).expect("the metric");
    assert_eq!(first.older_verdicts, 1);
}

#[tokio::test]
async fn a_metric_that_the_new_method_does_not_compute_cannot_be_judged() {
    let world = World::new(1).await;
    world.finish_one().await;
    let again = crate::RerunPolicy::All(Stage::Register);
    let sent = world
        .catalog
        .requeue_stale(&super::fingerprints([1; 4]), None, again)
        .await;
    assert_eq!(sent.expect("requeued"), 1);
    let lease = world.claim(1).await.remove(0);
    let mut done = world.done(Stage::Register);
    let gone = done.metrics.pop().expect("a metric").outcome.metric;
    let left: Vec<_> = done.metrics.iter().map(|m| m.outcome).collect();
    done.outcome = serde_json::json!({ "metrics": left }).to_string();
    let kept = world.catalog.checkpoint_now(lease, done).await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Done)));
    let all = verdict("ana", Verdict::Pass);
    let one = NewVerdict {
        metric: Some(gone),
        ..all.clone()
    };
    let refused = world.catalog.verdict_set(vec![one], 5).await;
    assert!(matches!(refused, Err(CatalogError::NoMetricResult(_, metric)) if metric == gone));
    world.catalog.verdict_set(vec![all], 6).await.expect("set");
    let log = world.catalog.verdict_log(None).await.expect("a log");
    assert_eq!(log.len(), left.len());
}

#[tokio::test]
async fn triggers_reject_changes_of_a_verdict() {
    let world = World::new(1).await;
    world.finish_one().await;
    let given = vec![verdict("ana", Verdict::Pass)];
    world.catalog.verdict_set(given, 5).await.expect("stored");
    let mut conn = world.place.conn().await;
    for sql in ["UPDATE verdict SET reviewer = 'bo'", "DELETE FROM verdict"] {
        assert!(query(sql).execute(&mut conn).await.is_err());
    }
}

#[tokio::test]
async fn truth_is_stored_for_known_pairs_only() {
    let world = World::new(1).await;
    let body = serde_json::json!({ "id": "p0", "char_height_px": 100.5 });
    assert!(!world.catalog.has_truth().await.expect("a read"));
    let unknown = vec![(name("p0"), body.clone()), (name("nobody"), body.clone())];
    let refused = world.catalog.set_truth(unknown).await;
    assert!(matches!(refused, Err(CatalogError::UnknownPair(_))));
    assert!(!world.catalog.has_truth().await.expect("a read"));
    let stored = world
        .catalog
        .set_truth(vec![(name("p0"), body.clone())])
        .await;
    assert_eq!(stored.expect("stored"), 1);
    let page = world.catalog.results_page(None, 5).await.expect("a page");
    assert_eq!(page[0].truth, Some(body));
}
