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

/// Returns the sentence on a project whose pairs are all retired, as a clause says.
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
    let rest = [
        (progress.failed, CountedPairs::Failed, ["failed"; 2]),
        (
            progress.pending,
            CountedPairs::Unfinished,
            ["is not finished", "are not finished"],
        ),
    ];
    let rest = rest.into_iter().filter(|(n, _, _)| *n > 0);
    for (i, (n, pairs, [one, more])) in rest.enumerate() {
        sentence.push(if i == 0 { "; " } else { " and " });
        sentence.push_count(n, vec![pairs]);
        sentence.push(" ");
        sentence.push(if n == 1 { one } else { more });
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
mod tests {
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
}
