//! The answer in at most three short paragraphs: how many pairs are aligned, Acc, and which differences are significant.
//!
//! A command in a sentence stands in backticks, which renderers turn into the code of their format.

use super::accuracy_sentence::accuracy;
use super::comparison::{Basis, Comparison, MIN_PAIRS, TOO_FEW_TO_ESTIMATE, sample_size};
use super::counted_text::{CountedPairs, CountedText};
use super::model::{BlockCounts, MetricRow, Report};
use mocban_catalog::all_retired;
use mocban_core::domain::{MetricOutcome, ThresholdMetric};
use mocban_results::number_format::{format_count, format_p, joined};
use mocban_results::stats::SIGNIFICANCE_LEVEL;

/// Returns the paragraphs, in order. There are fewer than three if there are no results.
pub(super) fn headline(report: &Report) -> Vec<CountedText> {
    let blocks = report.block_progress.and_then(BlockCounts::unfinished);
    if report.pairs == 0 {
        let retired = all_retired(report.pairs, report.retired);
        let sentence = match (retired, blocks) {
            (Some(clause), _) => nothing_to_report(&clause, report.retired),
            (None, Some(blocks)) => format!("The project has no pairs yet: {blocks}.").into(),
            (None, None) => "The project has no pairs yet; `mocban import` adds them.".into(),
        };
        return vec![sentence];
    }
    let mut aligned = aligned(report);
    if let Some(blocks) = blocks {
        aligned.push(&format!(" Characters are missing: {blocks}."));
    }
    let mut sentences = vec![aligned];
    if report.progress.done == 0 {
        sentences.push(nothing_to_judge(report).into());
    } else {
        sentences.push(accuracy(report));
        sentences.push(significance(report).into());
    }
    sentences
}

/// Returns the sentence on a project whose pairs are all retired. `clause` says so, with their number.
fn nothing_to_report(clause: &str, retired: u64) -> CountedText {
    let mut sentence = CountedText::from("There is nothing to report: ");
    let count = retired.to_string();
    match clause.split_once(&count) {
        Some((before, after)) => {
            sentence.push(before);
            sentence.push_text_of_count(&count, vec![CountedPairs::Retired]);
            sentence.push(after);
        }
        None => sentence.push(clause),
    }
    sentence.push("; `mocban status --retired` says why.");
    sentence
}

/// Returns the sentence on how many pairs are aligned, failed and not finished.
fn aligned(report: &Report) -> CountedText {
    let progress = report.progress;
    let done = (progress.done, CountedPairs::Aligned);
    let pairs = (report.pairs, CountedPairs::All);
    let mut sentence = match (progress.done, report.pairs) {
        (1, 1) => CountedText::from("The only pair is aligned"),
        (0, 1) => CountedText::from("The only pair is not aligned"),
        (0, _) => CountedText::filled("None of the {} pairs is aligned", &[pairs]),
        (1, _) => CountedText::filled("{} of {} pairs is aligned", &[done, pairs]),
        (2, 2) => CountedText::from("Both pairs are aligned"),
        (all, of) if all == of => CountedText::filled("All {} pairs are aligned", &[done]),
        _ => CountedText::filled("{} of {} pairs are aligned", &[done, pairs]),
    };
    let row = report.row(ThresholdMetric::DEFAULT);
    if let Some(clause) = low_confidence(progress.done, row) {
        sentence.append(clause);
    }
    let unfinished = match progress.pending {
        1 => " is not finished",
        _ => " are not finished",
    };
    let counts = [
        (progress.failed, CountedPairs::Failed, " failed"),
        (progress.pending, CountedPairs::Unfinished, unfinished),
    ];
    let rest = CountedText::listed(counts, " and ");
    if !rest.is_empty() {
        sentence.push("; ");
        sentence.append(rest);
    }
    sentence.push(".");
    sentence
}

/// Returns the clause on results of low confidence, or `None` if no result has a confidence.
fn low_confidence(done: u64, row: Option<&MetricRow>) -> Option<CountedText> {
    let low = row?.low_confidence?;
    let below = format!("with a confidence below {}", MetricOutcome::LOW_CONFIDENCE);
    match (low, done) {
        (0, 1) => None,
        (0, _) => Some(format!(", none {below}").into()),
        (_, 1) => Some(format!(", {below}").into()),
        _ => {
            let mut clause = CountedText::filled(", {} ", &[(low, CountedPairs::LowConfidence)]);
            clause.push(&below);
            Some(clause)
        }
    }
}

fn nothing_to_judge(report: &Report) -> String {
    let (what, command) = if report.progress.pending > 0 {
        ("continues the work", "mocban run")
    } else {
        ("lists the reasons", "mocban status")
    };
    format!("There is no result to judge yet; `{command}` {what}.")
}

/// Returns the sentence on differences between metrics: by verdicts if there are any, otherwise by ground truth.
fn significance(report: &Report) -> String {
    let family = |basis| -> Vec<&Comparison> {
        let compared = report.comparisons.iter();
        compared.filter(|found| found.basis == basis).collect()
    };
    let by_basis = Basis::ALL.map(|basis| (basis, family(basis)));
    let known = by_basis.into_iter().find(|(_, found)| !found.is_empty());
    let Some((basis, family)) = known else {
        return without_basis(report);
    };
    let is_significant =
        |found: &&&Comparison| found.p_holm.is_some_and(|p| p < SIGNIFICANCE_LEVEL);
    let significant: Vec<&Comparison> = family.iter().filter(is_significant).copied().collect();
    if significant.is_empty() {
        return no_difference(basis, &family);
    }
    let others = if significant.len() < family.len() {
        "No other"
    } else {
        "Every"
    };
    format!(
        "By {}, {} {others} tested difference is significant (McNemar's exact test, Holm's correction).",
        basis.title(),
        better_than(&significant)
    )
}

/// Returns sentences on which metrics are right more often than others, such as `Ensemble (p = 0.016) and Relief (p =
/// 0.003) are right significantly more often than Pixel density.` A sentence names at most two metrics that are better than
/// the same other metric.
fn better_than(significant: &[&Comparison]) -> String {
    let mut groups: Vec<(ThresholdMetric, Vec<String>)> = Vec::new();
    for found in significant {
        let is_a = found.a_only > found.b_only;
        let (better, worse) = if is_a {
            (found.a, found.b)
        } else {
            (found.b, found.a)
        };
        let p = format_p(found.p_holm.unwrap_or_default());
        let text = format!("{} ({p})", better.title());
        let mut open = groups.iter_mut().filter(|(_, names)| names.len() < 2);
        match open.find(|(other, _)| *other == worse) {
            Some((_, names)) => names.push(text),
            None => groups.push((worse, vec![text])),
        }
    }
    let sentences: Vec<String> = (groups.iter())
        .map(|(worse, names)| {
            let verb = if names.len() == 1 { "is" } else { "are" };
            format!(
                "{} {verb} right significantly more often than {}.",
                joined(names),
                worse.title()
            )
        })
        .collect();
    sentences.join(" ")
}

/// Returns the sentence on a basis without a significant difference, with the number of pairs that would show one.
fn no_difference(basis: Basis, family: &[&Comparison]) -> String {
    let p_values = family.iter().filter_map(|found| found.p_holm);
    let Some(smallest) = p_values.reduce(f64::min) else {
        return format!(
            "By {}, no two metrics differ on a pair: both are right, or both are wrong.",
            basis.title()
        );
    };
    let larger = family
        .iter()
        .filter(|found| found.pairs_needed > Some(found.n));
    let needed = match larger.min_by_key(|found| found.pairs_needed) {
        Some(found) => sample_size(
            basis,
            (found.a, found.b),
            found.pairs_needed.unwrap_or_default(),
        ),
        None if family.iter().any(|found| found.pairs_needed.is_some()) => {
            "More pairs would be needed to show one after the correction.".to_owned()
        }
        None if family.iter().any(|found| found.a_only != found.b_only) => {
            TOO_FEW_TO_ESTIMATE.to_owned()
        }
        None => "Each metric alone is right on as many pairs as the others.".to_owned(),
    };
    format!(
        "No difference between metrics is significant by {} (smallest {} after Holm's correction). {needed}",
        basis.title(),
        format_p(smallest)
    )
}

/// Returns the sentence on metrics that cannot be compared by which results are right.
fn without_basis(report: &Report) -> String {
    let tested = report
        .score_comparisons
        .iter()
        .filter_map(|found| found.p_holm);
    let (n, significant) = tested.fold((0_u64, 0_u64), |(n, k), p| {
        (n + 1, k + u64::from(p < SIGNIFICANCE_LEVEL))
    });
    let is_known = |row: &&MetricRow| row.acc.is_some() || row.truth.is_some();
    let start = if report.rows.iter().filter(is_known).count() > 1 {
        &format!(
            "Metrics are not compared, because fewer than {MIN_PAIRS} pairs are judged for two of them"
        )
    } else if report.rows.iter().filter(|row| row.judged > 0).count() > 1 {
        "Reviewers passed or failed the results of no two metrics, so no metric is known to be right more often than another"
    } else if report.has_verdicts() {
        "Reviewers judged the results of one metric only, so no metric is known to be right more often than another"
    } else {
        "Without verdicts, no metric is known to be right more often than another"
    };
    if n == 0 {
        return format!("{start}.");
    }
    let [n, significant] = [n, significant].map(format_count);
    format!(
        "{start}. By score, {significant} of {n} differences between metrics are significant (paired bootstrap, Holm's \
         correction)."
    )
}

#[cfg(test)]
mod tests;
