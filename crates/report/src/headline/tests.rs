//! Tests of the sentences with which a report begins.

use super::headline;
use crate::test_fixtures::long_sentences;
use crate::{CountedText, Report, ReportAccumulator, test_fixtures};
use mocban_catalog::PairResults;
use mocban_core::domain::ThresholdMetric::{Density, Ensemble};
use mocban_core::domain::Verdict::{Fail, Pass};
use mocban_core::domain::{FailureClass, ThresholdMetric, Verdict};
use mocban_results::{AttentionCheckRates, IntervalMethod, Rate, TruthEvaluation};

/// Returns a report on `n` pairs whose verdicts `verdict` chooses, by pair and metric.
fn judged(n: u32, verdict: impl Fn(u32, ThresholdMetric) -> Verdict) -> Report {
    let mut report = ReportAccumulator::default();
    for i in 0..n {
        let mut pair = test_fixtures::done(&format!("p{i:03}"), 0.8, &[Pass]);
        for record in &mut pair.metrics {
            record.verdicts[0].verdict = verdict(i, record.outcome.metric);
        }
        report.add(&pair, &TruthEvaluation::default());
    }
    report.finish()
}

fn of(pairs: &[PairResults]) -> Vec<CountedText> {
    let mut report = ReportAccumulator::default();
    for pair in pairs {
        report.add(pair, &TruthEvaluation::default());
    }
    headline(&report.finish())
}

#[test]
fn without_pairs_or_results_it_names_the_next_command() {
    assert_eq!(
        of(&[]),
        ["The project has no pairs yet; `mocban import` adds them."]
    );
    assert_eq!(
        of(&[test_fixtures::pending("a"), test_fixtures::pending("b")]),
        [
            "None of the 2 pairs is aligned; 2 are not finished.",
            "There is no result to judge yet; `mocban run` continues the work."
        ]
    );
    let failed = test_fixtures::failed("a", FailureClass::Io, "gone");
    assert_eq!(
        of(&[failed]),
        [
            "The only pair is not aligned; 1 failed.",
            "There is no result to judge yet; `mocban status` lists the reasons."
        ]
    );
}

#[test]
fn failed_pairs_and_low_confidence_are_counted() {
    let found = of(&[
        test_fixtures::with_confidence("a", 0.4),
        test_fixtures::with_confidence("b", 0.9),
        test_fixtures::failed("c", FailureClass::BadInput, "c.stl is empty"),
        test_fixtures::pending("d"),
    ]);
    assert_eq!(
        found,
        [
            "2 of 4 pairs are aligned, 1 with a confidence below 0.5; 1 failed and 1 is not finished.",
            "Nobody has judged a result yet, so there is no Acc (`mocban review --reviewer NAME` starts judging).",
            "Without verdicts, no metric is known to be right more often than another.",
        ]
    );
}

#[test]
fn results_that_all_passed_differ_in_nothing() {
    let found = judged(24, |_, _| Pass);
    assert_eq!(
        found.headline,
        [
            "All 24 pairs are aligned.",
            "Acc of Ensemble is 100.0 % (86.2–100.0, 95 % Wilson interval): reviewers passed 24 of 24 decided \
             results.",
            "By verdicts, no two metrics differ on a pair: both are right, or both are wrong.",
        ]
    );
    let exact = found.with_interval(IntervalMethod::Exact);
    assert!(
        exact.headline[1].contains("(85.8–100.0, 95 % exact interval)"),
        "{exact:?}"
    );
}

#[test]
fn verdicts_on_one_metric_compare_nothing() {
    let mut report = ReportAccumulator::default();
    for i in 0..3 {
        let mut pair = test_fixtures::done(&format!("p{i}"), 0.8, &[Pass]);
        for record in &mut pair.metrics {
            if record.outcome.metric != Ensemble {
                record.verdicts.clear();
            }
        }
        report.add(&pair, &TruthEvaluation::default());
    }
    let found = report.finish().headline;
    assert!(
        found[2].starts_with("Reviewers judged the results of one metric only"),
        "{found:?}"
    );
}

#[test]
fn disagreement_is_not_called_unsure() {
    let found = of(&[test_fixtures::done("p", 0.8, &[Pass, Fail])]);
    let why = "There is no Acc, because reviewers disagree about every judged result.";
    assert!(found[1].starts_with(why), "{found:?}");
    let start = "Reviewers passed or failed the results of no two metrics";
    assert!(found[2].starts_with(start), "{found:?}");
}

#[test]
fn significant_differences_are_joined() {
    let found = judged(60, |i, metric| match metric {
        Density if i < 12 => Fail,
        _ if i == 59 => Fail,
        _ => Pass,
    });
    assert_eq!(
        found.headline[2],
        "By verdicts, Ensemble (p = 0.002) and Non-luminous SSIM (p = 0.002) are right significantly more often than \
         Pixel density. No other tested difference is significant (McNemar's exact test, Holm's correction)."
    );
}

#[test]
fn three_better_metrics_have_two_sentences() {
    let found = judged(60, |i, metric| match metric {
        Ensemble if i < 14 => Fail,
        _ if i == 59 => Fail,
        _ => Pass,
    });
    let text = &found.headline[2];
    assert_eq!(
        text.matches(" right significantly more often than Ensemble.")
            .count(),
        2,
        "{text}"
    );
    assert_eq!(long_sentences(text), Vec::<String>::new());
}

#[test]
fn without_significance_the_number_of_pairs_is_estimated() {
    let found = judged(60, |i, metric| match metric {
        Ensemble if i < 3 => Fail,
        _ if i == 59 => Fail,
        _ => Pass,
    });
    assert_eq!(
        found.headline[2],
        "No difference between metrics is significant by verdicts (smallest p = 1.000 after Holm's correction). To \
         show one between Ensemble and Non-luminous SSIM, about 160 judged pairs would be needed. This assumes 80 % \
         power and a 5 % level."
    );
}

#[test]
fn reviewers_who_missed_the_attention_checks_are_named() {
    let sentence = |rates: &[(&str, u64, u64)]| {
        let mut report = ReportAccumulator::default();
        report.add(
            &test_fixtures::done("a", 0.8, &[Pass]),
            &TruthEvaluation::default(),
        );
        let by_reviewer = rates.iter();
        let by_reviewer =
            by_reviewer.map(|(name, count, n)| ((*name).to_owned(), Rate::new(*count, *n)));
        report.set_attention_checks(AttentionCheckRates {
            all: Rate::total(rates.iter().map(|(_, count, n)| Rate::new(*count, *n))),
            by_reviewer: by_reviewer.collect(),
            ..AttentionCheckRates::default()
        });
        let found = report.finish();
        (found.headline[1].clone(), found.warnings)
    };
    let (one, warnings) = sentence(&[("lan", 0, 5), ("minh", 5, 5)]);
    let ending = " lan noticed only 0 of 5 attention checks, so this Acc may be wrong.";
    assert!(one.ends_with(ending), "{one}");
    let warned = |text: &CountedText| text.starts_with("lan noticed 0 of 5 attention checks. ");
    assert_eq!(
        warnings.iter().filter(|text| warned(text)).count(),
        1,
        "{warnings:?}"
    );
    let (two, _) = sentence(&[("lan", 1, 5), ("minh", 2, 5)]);
    assert!(
        two.contains(" 2 reviewers missed most of their attention checks"),
        "{two}"
    );
    for (count, n) in [(0, 3), (2, 4), (5, 5)] {
        let (fine, _) = sentence(&[("lan", count, n)]);
        assert!(!fine.contains("attention"), "{fine}");
    }
}

#[test]
fn ground_truth_decides_where_nobody_judged() {
    let mut report = ReportAccumulator::default();
    for i in 0..20 {
        let pair = test_fixtures::with_confidence(&format!("p{i:02}"), 0.9);
        let angle_deg = if i == 0 { 90.0 } else { 1.0 };
        report.add(&pair, &test_fixtures::truth(angle_deg, 1.0, 0.9));
    }
    let found = report.finish().headline;
    assert_eq!(
        found[0],
        "All 20 pairs are aligned, none with a confidence below 0.5."
    );
    let truth =
        " Against ground truth, 19 of 20 results of Ensemble are right, 95.0 % (76.4–99.1).";
    assert!(found[1].ends_with(truth), "{found:?}");
    assert!(
        found[2].starts_with("By ground truth, no two metrics differ"),
        "{found:?}"
    );
}
