//! Whether a report is good enough and complete: `--fail-under` and `--require-complete`.

use super::model::Report;

/// Why a report does not reach a share of passes; empty when it does.
///
/// Every row that somebody has read must reach `least` (0..=1). A report nobody has read does not reach it:
/// truth is never taken for a verdict.
pub fn below(report: &Report, least: f64) -> Vec<String> {
    let told: Vec<_> = report
        .rows
        .iter()
        .filter_map(|row| row.acc.map(|acc| (row.metric, acc)))
        .collect();
    if told.is_empty() {
        return vec!["nobody has passed or failed a result yet, so there is no Acc".to_owned()];
    }
    told.into_iter()
        .filter(|(_, acc)| *acc < least)
        .map(|(metric, acc)| format!("Acc of {metric} is {acc:.4}, under {least}"))
        .collect()
}

/// What keeps a report from being complete; empty when nothing does.
///
/// Complete means: every pair is done, and every result of every metric was passed or failed.
pub fn missing(report: &Report) -> Vec<String> {
    let mut missing = Vec::new();
    let progress = report.progress;
    if report.pairs == 0 {
        missing.push("the project has no pairs".to_owned());
    }
    if progress.failed > 0 {
        missing.push(format!("failed pairs: {}", progress.failed));
    }
    if progress.pending > 0 {
        missing.push(format!("unfinished pairs: {}", progress.pending));
    }
    for row in &report.rows {
        let unread = row.n - row.read;
        if unread > 0 {
            missing.push(format!("unread results of {}: {unread}", row.metric));
        }
        if row.unsure > 0 {
            missing.push(format!("unsure results of {}: {}", row.metric, row.unsure));
        }
    }
    missing
}

#[cfg(test)]
mod tests {
    use super::{below, missing};
    use crate::domain::{FailureClass, Verdict};
    use crate::report::test_fixtures;
    use crate::report::{Report, ReportAccumulator, TruthEvaluation};

    fn report(verdicts: &[Option<Verdict>]) -> Report {
        let mut tally = ReportAccumulator::default();
        for (i, verdict) in verdicts.iter().enumerate() {
            let read: Vec<Verdict> = verdict.iter().copied().collect();
            let pair = test_fixtures::done(&format!("p{i}"), 0.8, &read);
            tally.add(&pair, &TruthEvaluation::default());
        }
        tally.finish()
    }

    #[test]
    fn share_at_the_limit_is_enough() {
        let half = report(&[Some(Verdict::Pass), Some(Verdict::Fail)]);
        assert!(below(&half, 0.5).is_empty());
        assert_eq!(below(&half, 0.51).len(), 4);
    }

    #[test]
    fn nobody_read_is_not_enough() {
        assert_eq!(below(&report(&[None, None]), 0.0).len(), 1);
    }

    #[test]
    fn complete_needs_every_result_told() {
        assert!(missing(&report(&[Some(Verdict::Pass), Some(Verdict::Fail)])).is_empty());
        assert_eq!(missing(&report(&[Some(Verdict::Pass), None])).len(), 4);
        assert_eq!(missing(&report(&[Some(Verdict::Unsure)])).len(), 4);
        assert_eq!(missing(&report(&[])), ["the project has no pairs"]);
    }

    #[test]
    fn a_metric_that_the_method_does_not_give_is_not_missing() {
        let mut tally = ReportAccumulator::default();
        let pair = test_fixtures::done_by_paper("a", 0.8, &[Verdict::Pass]);
        tally.add(&pair, &TruthEvaluation::default());
        let report = tally.finish();
        assert!(missing(&report).is_empty() && below(&report, 1.0).is_empty());
    }

    #[test]
    fn failed_pair_makes_it_incomplete() {
        let mut tally = ReportAccumulator::default();
        let none = TruthEvaluation::default();
        tally.add(&test_fixtures::done("a", 0.8, &[Verdict::Pass]), &none);
        tally.add(&test_fixtures::failed("b", FailureClass::Io, "gone"), &none);
        assert_eq!(missing(&tally.finish()), ["failed pairs: 1"]);
    }
}
