//! What a reader of the table must know, in whole sentences.

use super::accumulate::TruthProblems;
use super::model::{MetricRow, PairProgress};
use super::score_bootstrap::{BootstrapSkipped, FEWEST_UNITS, MOST_UNITS};

/// Slack for rounding in sums before a mean is called impossible.
const ROUNDING: f64 = 1e-9;

/// Every warning that the numbers call for.
pub(super) fn of(
    progress: PairProgress,
    rows: &[MetricRow],
    truth: &TruthProblems,
    lack: Option<BootstrapSkipped>,
) -> Vec<String> {
    let mut warnings = Vec::new();
    warnings.extend(missing_pairs(progress));
    for row in rows {
        warnings.extend(impossible_dice(row));
        warnings.extend(uncounted_verdicts(row));
        warnings.extend(mirrored(row));
    }
    warnings.extend(unusable_truth(truth));
    warnings.extend(lack.map(nothing_drawn));
    warnings
}

/// Why means have no intervals and metrics are not compared by their scores.
fn nothing_drawn(lack: BootstrapSkipped) -> String {
    let why = match lack {
        BootstrapSkipped::TooMany => format!(
            "there are more than {MOST_UNITS}, and chance hardly moves a mean over so many pairs"
        ),
        BootstrapSkipped::TooFew { units, by } => {
            let what = by.plural();
            format!("that takes {FEWEST_UNITS} {what} at least; here: {units}")
        }
    };
    format!("Means have no intervals, and metrics are not compared by their scores: {why}.")
}

/// Pairs that are in no row.
fn missing_pairs(progress: PairProgress) -> Option<String> {
    let pairs = progress.done + progress.failed + progress.pending;
    let counts = [
        (progress.failed, "failed"),
        (progress.pending, "not finished"),
    ];
    let counts = list(counts)?;
    Some(format!("In no row, of {pairs} in all: {counts}."))
}

/// Counts that are not 0, such as `2 failed, 1 not finished`; `None` when all are.
fn list<const N: usize>(counts: [(u64, &str); N]) -> Option<String> {
    let said: Vec<String> = counts
        .into_iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}"))
        .collect();
    (!said.is_empty()).then(|| said.join(", "))
}

/// Dice is `2 J / (1 + J)` of the IoU `J` for each pair, a concave function: its mean cannot lie above the
/// function's value at the mean IoU.
fn impossible_dice(row: &MetricRow) -> Option<String> {
    let (iou, dice) = (row.iou?, row.dice?);
    let bound = 2.0 * iou / (1.0 + iou);
    (dice > bound + ROUNDING).then(|| {
        format!(
            "{}: a mean Dice of {dice:.3} is above {bound:.3}, the most that a mean IoU of {iou:.3} allows; \
             the two cannot be of the same masks.",
            row.metric.title()
        )
    })
}

/// Verdicts that tell nothing about the current results.
fn uncounted_verdicts(row: &MetricRow) -> Option<String> {
    let counts = list([
        (row.stale, "unread with a verdict for an older result"),
        (
            row.conflicts,
            "unsure because reviewers contradict each other",
        ),
    ])?;
    Some(format!(
        "{}, of {} results: {counts}.",
        row.metric.title(),
        row.n
    ))
}

/// Results whose true map says that they read in mirror writing.
fn mirrored(row: &MetricRow) -> Option<String> {
    let counts = list([(
        row.truth.as_ref()?.mirrored,
        "in mirror writing (angle error 180 degrees)",
    )])?;
    Some(format!(
        "{}, of {} results: {counts}.",
        row.metric.title(),
        row.n
    ))
}

/// Truths that could not be used.
fn unusable_truth(truth: &TruthProblems) -> Option<String> {
    truth.first.as_ref().map(|first| {
        format!(
            "Truths that cannot be used and are left out: {}. The first: {first}.",
            truth.count
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{impossible_dice, missing_pairs, nothing_drawn};
    use crate::domain::ThresholdMetric;
    use crate::report::model::PairProgress;
    use crate::report::score_bootstrap::{BootstrapSkipped, ResamplingUnit};
    use crate::report::test_fixtures;

    #[test]
    fn why_nothing_was_drawn_is_said() {
        let few = nothing_drawn(BootstrapSkipped::TooFew {
            units: 5,
            by: ResamplingUnit::Block,
        });
        assert!(
            few.ends_with(": that takes 10 blocks at least; here: 5."),
            "{few}"
        );
        let many = nothing_drawn(BootstrapSkipped::TooMany);
        assert!(many.contains("there are more than 100000"), "{many}");
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
    fn equal_masks_everywhere_meet_the_bound_without_a_warning() {
        let iou = 0.7;
        let dice = 2.0 * iou / (1.0 + iou);
        assert_eq!(
            impossible_dice(&test_fixtures::row(ThresholdMetric::NlSsim, iou, dice)),
            None
        );
    }

    #[test]
    fn failed_and_unfinished_pairs_are_said() {
        let said = |done, failed, pending| {
            missing_pairs(PairProgress {
                done,
                failed,
                pending,
            })
        };
        assert_eq!(said(5, 0, 0), None);
        let three = said(5, 2, 1).expect("three are missing");
        assert_eq!(three, "In no row, of 8 in all: 2 failed, 1 not finished.");
    }
}
