//! Checks that a report is good enough (`--fail-under`) and complete (`--require-complete`).

use super::model::Report;
use mocban_catalog::all_retired;
use mocban_results::number_format::format_count;

/// Returns the reasons why a report misses the required Acc. The list is empty if there are none.
///
/// Every row with an Acc must reach `least` (0..=1). Acc is computed from verdicts alone, without ground truth. If
/// nobody has passed or failed a result, there is no Acc, and the returned reason says so.
pub fn below(report: &Report, least: f64) -> Vec<String> {
    let rows = report.rows.iter();
    let judged: Vec<_> = rows
        .filter_map(|row| row.acc.map(|acc| (row.metric, acc)))
        .collect();
    if judged.is_empty() {
        return vec!["nobody has passed or failed a result yet, so there is no Acc".to_owned()];
    }
    judged
        .into_iter()
        .filter(|(_, acc)| *acc < least)
        .map(|(metric, acc)| format!("Acc of {metric} is {acc:.4}, under {least}"))
        .collect()
}

/// Returns the reasons why a report is incomplete. The list is empty if the report is complete.
///
/// A report is complete if the project has pairs, every block and every pair is done, every result was passed or failed, and no stored row
/// is damaged.
pub fn missing(report: &Report) -> Vec<String> {
    let mut missing = Vec::new();
    let mut add = |what: String, n: u64| {
        missing.extend((n > 0).then(|| format!("{what}: {}", format_count(n))));
    };
    add("failed pairs".to_owned(), report.progress.failed);
    add("unfinished pairs".to_owned(), report.progress.pending);
    let blocks = report.block_progress.unwrap_or_default();
    add("failed blocks".to_owned(), blocks.failed);
    add("unfinished blocks".to_owned(), blocks.pending);
    add("damaged rows set apart".to_owned(), report.set_apart.count);
    for row in &report.rows {
        add(
            format!("unjudged results of {}", row.metric),
            row.n - row.judged,
        );
        add(format!("unsure results of {}", row.metric), row.unsure);
    }
    if report.pairs == 0 {
        let retired = all_retired(report.pairs, report.retired);
        missing.push(retired.unwrap_or_else(|| "the project has no pairs".to_owned()));
    }
    missing
}

#[cfg(test)]
mod tests {
    use super::{below, missing};
    use crate::test_fixtures;
    use crate::{BlockCounts, Report, ReportAccumulator};
    use mocban_core::domain::{FailureClass, JobStatus, Verdict};
    use mocban_results::TruthEvaluation;

    fn report(verdicts: &[Option<Verdict>]) -> Report {
        let mut tally = ReportAccumulator::default();
        for (i, verdict) in verdicts.iter().enumerate() {
            let given: Vec<Verdict> = verdict.iter().copied().collect();
            let pair = test_fixtures::done(&format!("p{i}"), 0.8, &given);
            tally.add(&pair, &TruthEvaluation::default());
        }
        tally.finish()
    }

    #[test]
    fn a_share_at_the_limit_is_enough() {
        let half = report(&[Some(Verdict::Pass), Some(Verdict::Fail)]);
        assert!(below(&half, 0.5).is_empty());
        assert_eq!(below(&half, 0.51).len(), 4);
    }

    #[test]
    fn an_unjudged_report_is_below_every_share() {
        assert_eq!(below(&report(&[None, None]), 0.0).len(), 1);
    }

    #[test]
    fn complete_needs_every_result_decided() {
        assert!(missing(&report(&[Some(Verdict::Pass), Some(Verdict::Fail)])).is_empty());
        assert_eq!(missing(&report(&[Some(Verdict::Pass), None])).len(), 4);
        assert_eq!(missing(&report(&[Some(Verdict::Unsure)])).len(), 4);
        assert_eq!(missing(&report(&[])), ["the project has no pairs"]);
    }

    #[test]
    fn a_metric_that_the_method_does_not_compute_is_not_missing() {
        let mut tally = ReportAccumulator::default();
        let pair = test_fixtures::done_by_paper("a", 0.8, &[Verdict::Pass]);
        tally.add(&pair, &TruthEvaluation::default());
        let report = tally.finish();
        assert!(missing(&report).is_empty() && below(&report, 1.0).is_empty());
    }

    #[test]
    fn a_failed_pair_makes_a_report_incomplete() {
        let mut tally = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        tally.add(&test_fixtures::done("a", 0.8, &[Verdict::Pass]), &none);
        tally.add(&test_fixtures::failed("b", FailureClass::Io, "gone"), &none);
        assert_eq!(missing(&tally.finish()), ["failed pairs: 1"]);
    }

    #[test]
    fn a_report_without_pairs_that_count_names_the_retired_ones() {
        for (number, clause) in [
            (1, "the only pair of the project is retired"),
            (2, "all 2 pairs of the project are retired"),
        ] {
            let mut retired = ReportAccumulator::default();
            retired.set_retired(number);
            let report = retired.finish();
            let sentence = format!(
                "There is nothing to report: {clause}; `mocban status --retired` says why."
            );
            assert_eq!(report.headline, [sentence]);
            assert_eq!(missing(&report), [clause]);
        }
        let mut others = ReportAccumulator::default();
        others.set_retired(2);
        let pair = test_fixtures::done("a", 0.8, &[Verdict::Pass]);
        others.add(&pair, &TruthEvaluation::default());
        let report = others.finish();
        assert!(report.headline[0].starts_with("The only pair is aligned"));
        assert!(missing(&report).is_empty());
    }

    #[test]
    fn blocks_whose_characters_are_missing_are_told() {
        let mut accumulated = ReportAccumulator::default();
        let pair = test_fixtures::done("p", 0.8, &[Verdict::Pass]);
        accumulated.add(&pair, &TruthEvaluation::default());
        accumulated.set_block_progress(BlockCounts::of([
            JobStatus::Done,
            JobStatus::Quarantined,
            JobStatus::Ready,
            JobStatus::Leased,
        ]));
        let report = accumulated.finish();
        assert_eq!(
            missing(&report),
            ["failed blocks: 1", "unfinished blocks: 2"]
        );
        let first = &report.headline[0];
        let end = " Characters are missing: 1 block failed and 2 blocks are not finished.";
        assert!(first.ends_with(end), "{first}");
        let mut empty = ReportAccumulator::default();
        empty.set_block_progress(BlockCounts::of([JobStatus::Quarantined]));
        let expected = ["The project has no pairs yet: 1 block failed."];
        assert_eq!(empty.finish().headline, expected);
    }
}
