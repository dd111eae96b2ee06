//! The sentences of the headline on Acc: the value, what does not count, and what speaks against it.

use super::model::{MetricRow, Report};
use mocban_core::domain::{ThresholdMetric, sanitize};
use mocban_results::attention_checks::AttentionCheckRates;
use mocban_results::number_format::{NumberStyle, counted};
use mocban_results::number_format::{
    format_count, format_interval, format_rate, format_share, joined,
};
use mocban_results::stats::Rate;

/// Returns the sentences on Acc of the default metric, or of the first metric with an Acc, and on ground truth.
pub(super) fn accuracy(report: &Report) -> String {
    let by_default = report.row(ThresholdMetric::DEFAULT);
    let judged = report.row_with_acc();
    let mut sentence = match judged.and_then(|row| Some((row, row.acc?, row.acc_ci95?))) {
        Some((row, acc, bounds)) => format!(
            "Acc of {} is {} % ({}, {} interval): reviewers passed {} of {}.",
            row.metric.title(),
            format_share(acc),
            format_interval(bounds, NumberStyle::Share),
            report.interval.title(),
            format_count(row.passed),
            counted(row.passed + row.failed, "decided result"),
        ) + &undecided(row)
            + &inattentive(report),
        None if report.has_verdicts() => {
            let unsure: u64 = report.rows.iter().map(|row| row.unsure).sum();
            let conflicts: u64 = report.rows.iter().map(|row| row.conflicts).sum();
            let why = match conflicts {
                0 => "were unsure about every judged result",
                all if all == unsure => "disagree about every judged result",
                _ => "were unsure about every judged result, or disagree about it",
            };
            format!("There is no Acc, because reviewers {why}.")
        }
        None if report.rows.iter().any(|row| row.stale > 0) => {
            "There is no Acc, because every verdict is on an earlier result.".to_owned()
        }
        None => "Nobody has judged a result yet, so there is no Acc (`mocban review --reviewer NAME` starts judging)."
            .to_owned(),
    };
    sentence.extend(judged.or(by_default).and_then(truth));
    sentence
}

/// Returns the sentence on results that were judged and count neither as passed nor as failed, or an empty text.
fn undecided(row: &MetricRow) -> String {
    let unsure = row.unsure - row.conflicts;
    let rest = [
        (row.conflicts, "on which reviewers disagree"),
        (unsure, "about which they were unsure"),
    ];
    let rest = rest.into_iter().filter(|(n, _)| *n > 0);
    let rest: Vec<String> = rest
        .map(|(n, what)| format!("{} {what}", format_count(n)))
        .collect();
    match rest.as_slice() {
        [] => String::new(),
        rest => format!(" Not counted: {}.", joined(rest)),
    }
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
