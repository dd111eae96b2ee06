//! Scores drawn anew as tables: intervals of the means, and metrics compared by their scores.

use super::table::{Table, bounds, fixed, interval, number, p_value, words};
use crate::report::model::{MetricRow, Report};
use crate::report::score_bootstrap::{BootstrapSettings, MeanIntervals};
use crate::report::score_comparison::ScoreComparison;

/// A column of intervals of means.
type MeanIntervalField = fn(&MeanIntervals) -> Option<[f64; 2]>;

/// The bootstrap intervals of the means, and of Acc where whole blocks are drawn; `None` where there are none.
pub(super) fn intervals(report: &Report) -> Option<Table> {
    let how = report.bootstrap.as_ref()?;
    let mut wanted: Vec<(&'static str, MeanIntervalField)> = vec![
        ("SSIM", |means| means.ssim),
        ("IoU", |means| means.iou),
        ("Dice", |means| means.dice),
        ("Acc", |means| means.acc_by_block),
    ];
    let held = |read: MeanIntervalField| {
        report
            .rows
            .iter()
            .any(|row| read(&row.means_ci95).is_some())
    };
    wanted.retain(|(_, read)| held(*read));
    let cells = |row: &MetricRow| {
        let ends = wanted.iter().map(|(_, read)| bounds(read(&row.means_ci95)));
        [Some(row.metric.title().to_owned())]
            .into_iter()
            .chain(ends)
            .collect()
    };
    let columns = wanted.iter().map(|(head, _)| interval(head));
    (!wanted.is_empty()).then(|| Table {
        caption: format!("95% intervals of the means above, by {}.", said(how)),
        columns: [words("95% bootstrap")]
            .into_iter()
            .chain(columns)
            .collect(),
        rows: report.rows.iter().map(cells).collect(),
    })
}

/// How the bootstrap was done.
fn said(how: &BootstrapSettings) -> String {
    format!(
        "percentile bootstrap: {} {} drawn anew {} times, seed {}",
        how.units,
        how.by.plural(),
        how.resamples,
        how.seed
    )
}

/// The metrics compared by their scores; `None` where there is nothing to compare, or too little.
pub(super) fn comparisons(report: &Report) -> Option<Table> {
    let how = report.bootstrap.as_ref()?;
    let cells = |found: &ScoreComparison| {
        vec![
            Some(format!("{} v. {}", found.a.title(), found.b.title())),
            Some(found.score.title().to_owned()),
            fixed(Some(found.difference), 3),
            found.ci95.map(|[low, high]| format!("{low:.3}, {high:.3}")),
            found.p.map(p_value),
            found.p_holm.map(p_value),
        ]
    };
    let mut found = report.score_comparisons.iter();
    // Without any interval there is one sentence among the warnings, and no table of dashes.
    found.any(|found| found.ci95.is_some()).then(|| Table {
        caption: format!(
            "First less second on the same pairs, by {}; p two-sided, Holm's correction over the comparisons by one \
             score. A higher score is not a righter result: a mask that copies the ink scores best.",
            said(how)
        ),
        columns: vec![
            words("Scores compared"),
            words("by"),
            number("diff.", 3),
            words("95% bootstrap"),
            words("p"),
            words("Holm"),
        ],
        rows: report.score_comparisons.iter().map(cells).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::{comparisons, intervals};
    use crate::domain::ThresholdMetric;
    use crate::report::render::text::aligned;
    use crate::report::{Report, ReportAccumulator, TruthEvaluation, test_fixtures};

    /// Twenty pairs on which this metric has the best IoU.
    fn with_best(best: ThresholdMetric) -> Report {
        let mut tally = ReportAccumulator::default();
        for i in 0..20 {
            let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.7, &[]);
            for record in &mut pair.metrics {
                let is_best = record.outcome.metric == best;
                record.outcome.scores.iou = if is_best { 0.75 } else { 0.7 };
            }
            tally.add(&pair, &TruthEvaluation::default());
        }
        tally.finish()
    }

    #[test]
    fn means_have_intervals_and_metrics_their_differences() {
        let report = with_best(ThresholdMetric::Ensemble);
        let cells = |row: &[Option<String>]| -> Vec<String> {
            row.iter()
                .map(|cell| cell.clone().unwrap_or_default())
                .collect()
        };
        let table = intervals(&report).expect("20 pairs");
        assert_eq!(table.columns.len(), 4, "no Acc: nobody has read");
        let ensemble = ["Ensemble", "0.810-0.810", "0.750-0.750", "0.824-0.824"];
        assert_eq!(cells(&table.rows[2]), ensemble);
        assert!(
            table
                .caption
                .contains("20 pairs drawn anew 10000 times, seed 1")
        );
        let table = comparisons(&report).expect("three metrics");
        assert_eq!(table.rows.len(), 12);
        let iou = cells(&table.rows[4]);
        let wanted = [
            "Ensemble v. Non-luminous SSIM",
            "IoU",
            "0.050",
            "0.050, 0.050",
            "<0.001",
            "0.001",
        ];
        assert_eq!(iou, wanted);
    }

    #[test]
    fn lower_scores_fit_into_a_terminal_too() {
        let table = comparisons(&with_best(ThresholdMetric::Density)).expect("three metrics");
        let text = aligned(&table);
        let found = text
            .lines()
            .find(|line| line.contains("Non-luminous SSIM v. Pixel density  IoU"));
        let wanted = "  -0.050  -0.050, -0.050  <0.001  0.001";
        assert!(found.expect("a line").ends_with(wanted), "{text}");
        assert!(text.lines().all(|line| line.len() <= 80), "{text}");
    }

    #[test]
    fn an_empty_project_has_neither() {
        let report = ReportAccumulator::default().finish();
        assert_eq!((intervals(&report), comparisons(&report)), (None, None));
    }
}
