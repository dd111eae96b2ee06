//! Reviewers are compared and counted.

use std::collections::BTreeMap;

use super::{AgreementCounts, MIN_RESULTS, OwnVerdicts, VerdictTable};
use crate::test_fixtures;
use mocban_catalog::{AttentionCheckAnswer, MetricRecord, ReviewContext, ReviewerVerdict};
use mocban_core::domain::{
    AttentionCheck, ContentHash, PairName, ReviewOrder, ThresholdMetric, Verdict,
};

fn answer(pair: &str, check: AttentionCheck, verdict: Verdict) -> AttentionCheckAnswer {
    AttentionCheckAnswer {
        id: 0,
        pair: PairName::new(pair).expect("test names are ids"),
        metric: ThresholdMetric::Density,
        result_hash: ContentHash::of(pair.as_bytes()),
        check,
        verdict,
        reviewer: "lan".to_owned(),
        reason: None,
        note: None,
        context: ReviewContext::default(),
        at: 0,
        undone_at: None,
    }
}

#[test]
fn results_that_look_the_same_count_once() {
    let mut counts = AgreementCounts::default();
    counts.add(&test_fixtures::done(
        "a",
        0.8,
        &[Verdict::Pass, Verdict::Fail],
    ));
    let mut apart = test_fixtures::done("b", 0.8, &[Verdict::Pass, Verdict::Pass]);
    apart.metrics[0].outcome.threshold_level += 1;
    counts.add(&apart);
    let found = counts.finish();
    assert_eq!((found.conflicts, found.reviewers[0].judged), (1, 3));
    // Whoever settles a conflict with one metric leaves that of another one, although they look the same.
    let one_each = BTreeMap::from(ThresholdMetric::ALL.map(|metric| (metric, 1)));
    assert_eq!(found.conflicts_by_metric, one_each);
    assert_eq!(found.conflicting_pairs, ["a".parse().expect("an id")]);
    let two = &found.reviewer_pairs[0];
    assert_eq!((two.a.as_str(), two.b.as_str()), ("r0", "r1"));
    assert_eq!((two.agreement.n, two.agreement.agreed), (3, 2));
}

#[test]
fn an_adjudicator_is_counted_and_compared_with_nobody() {
    let mut counts = AgreementCounts::default();
    let mut pair = test_fixtures::done("a", 0.8, &[Verdict::Pass, Verdict::Fail]);
    let adjudicate = |record: &mut MetricRecord| {
        record.verdicts.push(ReviewerVerdict {
            reviewer: "third".to_owned(),
            verdict: Verdict::Fail,
            reason: None,
            review_order: Some(ReviewOrder::Adjudicate),
        });
    };
    pair.metrics.iter_mut().for_each(adjudicate);
    counts.add(&pair);
    let found = counts.finish();
    assert_eq!((found.conflicts, found.reviewer_pairs.len()), (0, 1));
    let judged = found.reviewers.iter();
    let judged: Vec<_> = judged
        .map(|record| (record.reviewer.as_str(), record.judged))
        .collect();
    assert_eq!(judged, [("r0", 1), ("r1", 1), ("third", 1)]);
}

#[test]
fn every_two_of_three_reviewers_are_compared() {
    let mut counts = AgreementCounts::default();
    counts.add(&test_fixtures::done("a", 0.8, &[Verdict::Pass; 3]));
    let found = counts.finish().reviewer_pairs;
    let names: Vec<_> = found
        .iter()
        .map(|two| (two.a.as_str(), two.b.as_str()))
        .collect();
    assert_eq!(names, [("r0", "r1"), ("r0", "r2"), ("r1", "r2")]);
}

#[test]
fn a_fail_detects_a_fault_and_the_newest_answer_counts() {
    let turned = AttentionCheck::Turned { angle_deg: 9.0 };
    let answers = [
        answer("a", turned, Verdict::Pass),
        answer("a", turned, Verdict::Fail),
        answer("b", turned, Verdict::Unsure),
        answer("b", AttentionCheck::Mirrored, Verdict::Fail),
    ];
    let mut counts = AgreementCounts::default();
    counts.add_checks("lan", &answers, &OwnVerdicts::new());
    let found = counts.finish();
    let lan = &found.reviewers[0];
    assert_eq!(
        (lan.attention_checks.all.count, lan.attention_checks.all.n),
        (2, 3)
    );
    let turned = lan.attention_checks.by_kind["turned"];
    assert_eq!((turned.count, turned.n), (1, 2));
    assert_eq!(lan.attention_checks.all, found.attention_checks);
    assert_eq!(lan.duplicates.n, 0);
}

#[test]
fn a_duplicate_is_compared_with_the_reviewers_own_verdict() {
    let own = OwnVerdicts::from(["a", "b"].map(|name| {
        let first = answer(name, AttentionCheck::Duplicate, Verdict::Pass);
        ((first.pair, first.result_hash), Verdict::Pass)
    }));
    let answers = [
        answer("a", AttentionCheck::Duplicate, Verdict::Pass),
        answer("b", AttentionCheck::Duplicate, Verdict::Fail),
        // The first verdict on it was undone.
        answer("c", AttentionCheck::Duplicate, Verdict::Pass),
    ];
    let mut counts = AgreementCounts::default();
    counts.add_checks("lan", &answers, &own);
    let lan = counts.finish().reviewers.remove(0);
    assert_eq!((lan.duplicates.count, lan.duplicates.n), (1, 2));
    assert_eq!(
        (lan.attention_checks.all.n, lan.attention_checks.all.share),
        (0, None)
    );
}

#[test]
fn unsure_verdicts_neither_agree_nor_disagree() {
    let mut table = VerdictTable::default();
    for (first, second) in [
        (Verdict::Pass, Verdict::Pass),
        (Verdict::Fail, Verdict::Pass),
        (Verdict::Unsure, Verdict::Pass),
        (Verdict::Fail, Verdict::Unsure),
    ] {
        table.add(first, second);
    }
    let found = table.finish();
    assert_eq!((found.n, found.agreed, found.unsure), (2, 1, 2));
    assert_eq!((found.failed_by_any, found.failed_by_both), (1, 0));
    assert!(!found.sufficient);
}

#[test]
fn thirty_results_are_sufficient() {
    let mut table = VerdictTable::default();
    (1..MIN_RESULTS).for_each(|_| table.add(Verdict::Pass, Verdict::Pass));
    assert!(!table.finish().sufficient);
    table.add(Verdict::Fail, Verdict::Pass);
    assert!(table.finish().sufficient);
}
