//! Caveats on the numbers of a report, in whole sentences.

use super::counted_text::{CountedPairs, CountedText};
use super::model::{MetricRow, PairProgress};
use super::score_bootstrap::BootstrapSkipped;
use mocban_catalog::{JointVerdict, PairResults};
use mocban_core::domain::{ThresholdMetric, sanitize};
use mocban_results::TruthEvaluation;
use mocban_results::attention_checks::AttentionCheckRates;
use mocban_results::number_format::NumberStyle::Score;
use mocban_results::number_format::{counted, format_count, format_number};
use mocban_results::stats::{MAX_UNITS, MIN_UNITS};

/// Tolerance for rounding in sums before a mean is called impossible.
const ROUNDING: f64 = 1e-9;

/// Ground truth that could not be used.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct TruthProblems {
    /// Number of pairs.
    pub(super) count: u64,
    /// The first pair with its problem.
    pub(super) first: Option<String>,
}

impl TruthProblems {
    /// Counts one pair, if its ground truth cannot be used.
    pub(super) fn add(&mut self, pair: &PairResults, truth: &TruthEvaluation) {
        if let Some(problem) = &truth.problem {
            self.count += 1;
            let first = || format!("{}: {problem}", pair.attributes.name);
            self.first.get_or_insert_with(first);
        }
    }
}

/// Returns the warnings that apply to the numbers of a report.
pub(super) fn warnings(
    progress: PairProgress,
    rows: &[MetricRow],
    truth: &TruthProblems,
    skipped: Option<BootstrapSkipped>,
    attention_checks: Option<&AttentionCheckRates>,
) -> Vec<CountedText> {
    let mut warnings = Vec::new();
    warnings.extend(missing_pairs(progress));
    let impossible = rows.iter().filter_map(impossible_dice);
    warnings.extend(impossible.map(CountedText::from));
    warnings.extend(qualified_results(rows, progress.done));
    let others = unusable_truth(truth).into_iter();
    let others = others.chain(skipped.map(bootstrap_skipped));
    let others = others.chain(attention_checks.into_iter().flat_map(missed_checks));
    warnings.extend(others.map(CountedText::from));
    warnings
}

/// Returns a warning for each reviewer who missed most planted faults.
fn missed_checks(rates: &AttentionCheckRates) -> impl Iterator<Item = String> {
    rates.inattentive().into_iter().map(|(reviewer, rate)| {
        let [noticed, n] = [rate.count, rate.n].map(format_count);
        format!(
            "{} noticed {noticed} of {n} attention checks. Let another person judge the same results. Or let this one \
             practise (key ? on the review page) and judge again.",
            sanitize(reviewer, 60)
        )
    })
}

fn bootstrap_skipped(skipped: BootstrapSkipped) -> String {
    let why = match skipped {
        BootstrapSkipped::TooMany(by) => format!(
            "There are more than {} {}, and sampling error is negligible.",
            format_count(MAX_UNITS as u64),
            by.plural()
        ),
        BootstrapSkipped::TooFew { units: 1, by } => format!(
            "An interval needs at least {MIN_UNITS} {}, and there is 1.",
            by.plural()
        ),
        BootstrapSkipped::TooFew { units, by } => format!(
            "An interval needs at least {MIN_UNITS} {}, and there are {units}.",
            by.plural()
        ),
    };
    format!("Means have no intervals, and metrics are not compared by score. {why}")
}

/// Returns a warning that names the pairs without results, or `None` if all pairs are done.
fn missing_pairs(progress: PairProgress) -> Option<CountedText> {
    let PairProgress {
        done,
        failed,
        pending,
    } = progress;
    let missing = failed + pending;
    // No list has both failed and unfinished pairs.
    let listed = match (failed, pending) {
        (0, 0) => return None,
        (_, 0) => vec![CountedPairs::Failed],
        (0, _) => vec![CountedPairs::Unfinished],
        _ => Vec::new(),
    };
    let mut warning = CountedText::default();
    warning.push_count(missing, listed);
    warning.push(" of ");
    warning.push_counted(done + missing, "pair", vec![CountedPairs::All]);
    let verb = if missing == 1 { "is" } else { "are" };
    warning.push(&format!(" {verb} in no row: "));
    let counts = [
        (failed, CountedPairs::Failed, " failed"),
        (pending, CountedPairs::Unfinished, " not finished"),
    ];
    warning.append(CountedText::listed(counts, ", "));
    warning.push(".");
    Some(warning)
}

/// Returns a warning if the mean Dice exceeds the largest value that the mean `IoU` allows.
///
/// For each pair, Dice is `2 J / (1 + J)`, where J is the `IoU`. This function is concave, so the mean Dice cannot
/// exceed the function's value at the mean `IoU`.
fn impossible_dice(row: &MetricRow) -> Option<String> {
    let (iou, dice) = (row.iou?, row.dice?);
    let bound = 2.0 * iou / (1.0 + iou);
    let [iou, shown_bound, shown_dice] =
        [iou, bound, dice].map(|score| format_number(score, Score));
    (dice > bound + ROUNDING).then(|| {
        format!(
            "{}: a mean Dice of {shown_dice} is above {shown_bound}, the most that a mean IoU of {iou} allows. The two \
             cannot be of the same masks.",
            row.metric.title()
        )
    })
}

/// How many results of a metric have a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Qualification {
    results: u64,
    count: u64,
    /// The joint verdict of these results, if it is the property.
    joint: Option<JointVerdict>,
    verbs: [&'static str; 2],
    what: &'static str,
}

/// Returns warnings that count stale verdicts, conflicts and mirrored results of `done` pairs. Metrics with the same counts
/// share one.
fn qualified_results(rows: &[MetricRow], done: u64) -> Vec<CountedText> {
    let mut groups: Vec<(Qualification, Vec<ThresholdMetric>)> = Vec::new();
    for row in rows {
        for found in qualifications(row) {
            match groups.iter_mut().find(|(known, _)| *known == found) {
                Some((_, metrics)) => metrics.push(row.metric),
                None => groups.push((found, vec![row.metric])),
            }
        }
    }
    let groups = groups.iter();
    groups
        .map(|(found, metrics)| found.sentence(metrics, done))
        .collect()
}

/// Returns the counts of one metric that are not 0.
fn qualifications(row: &MetricRow) -> impl Iterator<Item = Qualification> + use<> {
    let mirrored = row.truth.as_ref().map_or(0, |truth| truth.mirrored);
    let counts = [
        (
            row.stale,
            Some(JointVerdict::Stale),
            ["has", "have"],
            "a verdict on an earlier result only",
        ),
        (
            row.conflicts,
            Some(JointVerdict::Conflict),
            ["is", "are"],
            "unsure because reviewers disagree",
        ),
        (
            mirrored,
            None,
            ["is", "are"],
            "mirrored (angle error 180 degrees)",
        ),
    ];
    let results = row.n;
    let counts = counts.into_iter().filter(|(count, ..)| *count > 0);
    counts.map(move |(count, joint, verbs, what)| Qualification {
        results,
        count,
        joint,
        verbs,
        what,
    })
}

impl Qualification {
    /// Returns the sentence on metrics with these counts, in a project with `done` pairs.
    fn sentence(&self, metrics: &[ThresholdMetric], done: u64) -> CountedText {
        let titles: Vec<&str> = metrics.iter().map(|metric| metric.title()).collect();
        let mut sentence = CountedText::from(format!("{}: of ", titles.join(", ")));
        let aligned = (self.results == done).then_some(CountedPairs::Aligned);
        sentence.push_counted(self.results, "result", aligned.into_iter().collect());
        sentence.push(", ");
        let pairs = metrics.iter().filter_map(|metric| {
            let joint = self.joint?;
            Some(CountedPairs::Judged(*metric, joint))
        });
        sentence.push_count(self.count, pairs.collect());
        let [one, more] = self.verbs;
        let verb = if self.count == 1 { one } else { more };
        sentence.push(&format!(" {verb} {}.", self.what));
        sentence
    }
}

fn unusable_truth(truth: &TruthProblems) -> Option<String> {
    truth.first.as_ref().map(|first| {
        let records = counted(truth.count, "ground truth record");
        format!("{records} cannot be used and count nowhere. The first: {first}.")
    })
}

#[cfg(test)]
mod tests {
    use super::{
        TruthProblems, bootstrap_skipped, impossible_dice, missing_pairs, qualified_results,
        warnings,
    };
    use crate::model::PairProgress;
    use crate::score_bootstrap::BootstrapSkipped;
    use crate::test_fixtures::{self, long_sentences};
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::AttentionCheckRates;
    use mocban_results::stats::{Rate, ResamplingUnit};

    #[test]
    fn the_reason_for_no_bootstrap_is_given() {
        let few = bootstrap_skipped(BootstrapSkipped::TooFew {
            units: 5,
            by: ResamplingUnit::Block,
        });
        assert!(
            few.ends_with(" An interval needs at least 10 blocks, and there are 5."),
            "{few}"
        );
        let one = bootstrap_skipped(BootstrapSkipped::TooFew {
            units: 1,
            by: ResamplingUnit::Block,
        });
        assert!(one.ends_with(" 10 blocks, and there is 1."), "{one}");
        let many = bootstrap_skipped(BootstrapSkipped::TooMany(ResamplingUnit::Block));
        assert!(
            many.contains(" There are more than 100,000 blocks"),
            "{many}"
        );
    }

    #[test]
    fn every_warning_has_sentences_of_at_most_20_words() {
        let mut row = crate::MetricRow {
            stale: 10_000,
            conflicts: 10_000,
            ..test_fixtures::row(ThresholdMetric::NlSsim, 0.708, 0.870)
        };
        row.n = 100_000;
        let truth = TruthProblems {
            count: 2,
            first: Some("a: the mask is missing".to_owned()),
        };
        let checks = AttentionCheckRates {
            by_reviewer: [("nguyen lan".to_owned(), Rate::new(1, 5))].into(),
            ..AttentionCheckRates::default()
        };
        let progress = PairProgress {
            done: 1000,
            failed: 1000,
            pending: 1000,
        };
        let by = ResamplingUnit::Block;
        for skipped in [
            BootstrapSkipped::TooMany(by),
            BootstrapSkipped::TooFew { units: 5, by },
        ] {
            let row = row.clone();
            let found = warnings(progress, &[row], &truth, Some(skipped), Some(&checks));
            assert_eq!(found.len(), 7, "{found:?}");
            let long: Vec<String> = found.iter().flat_map(|text| long_sentences(text)).collect();
            assert_eq!(long, Vec::<String>::new());
        }
    }

    #[test]
    fn the_papers_density_row_is_impossible_and_its_others_are_not() {
        let row = |iou, dice| test_fixtures::row(ThresholdMetric::Density, iou, dice);
        let said = impossible_dice(&row(0.708, 0.870)).expect("0.870 is above 0.829");
        assert!(said.contains("0.870 is above 0.829"), "{said}");
        assert_eq!(impossible_dice(&row(0.776, 0.870)), None);
        assert_eq!(impossible_dice(&row(0.805, 0.890)), None);
    }

    #[test]
    fn equal_masks_meet_the_bound_without_a_warning() {
        let iou = 0.7;
        let dice = 2.0 * iou / (1.0 + iou);
        assert_eq!(
            impossible_dice(&test_fixtures::row(ThresholdMetric::NlSsim, iou, dice)),
            None
        );
    }

    #[test]
    fn metrics_with_the_same_counts_share_a_warning() {
        let row = |metric, conflicts| crate::MetricRow {
            conflicts,
            ..test_fixtures::row(metric, 0.8, 0.88)
        };
        let rows = [
            row(ThresholdMetric::NlSsim, 1),
            row(ThresholdMetric::Density, 2),
            row(ThresholdMetric::Ensemble, 1),
        ];
        assert_eq!(
            qualified_results(&rows, 587),
            [
                "Non-luminous SSIM, Ensemble: of 587 results, 1 is unsure because reviewers disagree.",
                "Pixel density: of 587 results, 2 are unsure because reviewers disagree.",
            ]
        );
    }

    #[test]
    fn failed_and_unfinished_pairs_are_named() {
        let said = |done, failed, pending| {
            missing_pairs(PairProgress {
                done,
                failed,
                pending,
            })
        };
        assert_eq!(said(5, 0, 0), None);
        let three = said(5, 2, 1).expect("three are missing");
        assert_eq!(
            three,
            "3 of 8 pairs are in no row: 2 failed, 1 not finished."
        );
    }
}
