//! The sentences of the headline on Acc: the value, what does not count, and what speaks against it.

use super::counted_text::{CountedPairs, CountedText};
use super::model::{MetricRow, Report};
use mocban_catalog::JointVerdict;
use mocban_core::domain::{ThresholdMetric, sanitize};
use mocban_results::attention_checks::AttentionCheckRates;
use mocban_results::number_format::{
    NumberStyle, format_count, format_interval, format_rate, format_share,
};
use mocban_results::stats::Rate;

/// Returns the sentences on Acc of the default metric, or of the first metric with an Acc, and on ground truth.
pub(super) fn accuracy(report: &Report) -> CountedText {
    let by_default = report.row(ThresholdMetric::DEFAULT);
    let judged = report.row_with_acc();
    let mut sentence = match judged.and_then(|row| Some((row, row.acc?, row.acc_ci95?))) {
        Some((row, acc, bounds)) => {
            let mut sentence = CountedText::from(format!(
                "Acc of {} is {} % ({}, {} interval): reviewers passed ",
                row.metric.title(),
                format_share(acc),
                format_interval(bounds, NumberStyle::Share),
                report.interval.title(),
            ));
            sentence.append(decided(row));
            sentence.append(undecided(row));
            sentence.push(&inattentive(report));
            sentence
        }
        None if report.has_verdicts() => {
            let unsure: u64 = report.rows.iter().map(|row| row.unsure).sum();
            let conflicts: u64 = report.rows.iter().map(|row| row.conflicts).sum();
            let why = match conflicts {
                0 => "were unsure about every judged result",
                all if all == unsure => "disagree about every judged result",
                _ => "were unsure about every judged result, or disagree about it",
            };
            format!("There is no Acc, because reviewers {why}.").into()
        }
        None if report.rows.iter().any(|row| row.stale > 0) => {
            "There is no Acc, because every verdict is on an earlier result.".into()
        }
        None => "Nobody has judged a result yet, so there is no Acc (`mocban review --reviewer NAME` starts judging)."
            .into(),
    };
    if let Some(truth) = judged.or(by_default).and_then(truth) {
        sentence.push(&truth);
    }
    sentence
}

/// Returns how many of the decided results were passed.
fn decided(row: &MetricRow) -> CountedText {
    let of_metric = |joint| vec![CountedPairs::Judged(row.metric, joint)];
    let decided = row.passed + row.failed;
    let mut text = CountedText::default();
    text.push_count(row.passed, of_metric(JointVerdict::Passed));
    text.push(" of ");
    text.push_counted(decided, "decided result", of_metric(JointVerdict::Decided));
    text.push(".");
    text
}

/// Returns the sentence on results that were judged and count neither as passed nor as failed, or an empty text.
fn undecided(row: &MetricRow) -> CountedText {
    let of_metric = |joint| CountedPairs::Judged(row.metric, joint);
    let unsure = row.unsure - row.conflicts;
    let counts = [
        (
            row.conflicts,
            of_metric(JointVerdict::Conflict),
            " on which reviewers disagree",
        ),
        (
            unsure,
            of_metric(JointVerdict::Unsure),
            " about which they were unsure",
        ),
    ];
    let rest = CountedText::listed(counts, " and ");
    let mut sentence = CountedText::default();
    if !rest.is_empty() {
        sentence.push(" Not counted: ");
        sentence.append(rest);
        sentence.push(".");
    }
    sentence
}

/// Returns the sentence on reviewers who missed most planted faults, or an empty text.
fn inattentive(report: &Report) -> String {
    let rates = report.attention_checks.iter();
    let found: Vec<(&str, &Rate)> = rates.flat_map(AttentionCheckRates::inattentive).collect();
    match found.as_slice() {
        [] => String::new(),
        [(reviewer, rate)] => format!(
            " {} noticed only {} of {} attention checks, so this Acc may be wrong.",
            sanitize(reviewer, 60),
            format_count(rate.count),
            format_count(rate.n)
        ),
        more => format!(
            " {} reviewers missed most of their attention checks, so this Acc may be wrong.",
            format_count(more.len() as u64)
        ),
    }
}

/// Returns the sentence on a metric's errors against ground truth, or `None` without ground truth.
fn truth(row: &MetricRow) -> Option<String> {
    let truth = row.truth.as_ref()?;
    let rate = format_rate(truth.acc?, truth.acc_ci95);
    let [passed, n] = [truth.passed, truth.n].map(format_count);
    let title = row.metric.title();
    let verb = if truth.passed == 1 { "is" } else { "are" };
    Some(format!(
        " Against ground truth, {passed} of {n} results of {title} {verb} right, {rate}."
    ))
}
