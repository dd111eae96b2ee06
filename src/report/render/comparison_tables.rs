//! Tables that compare metrics, and the table of bootstrap intervals.

use super::table::Table;
use crate::report::comparison::{Comparison, versus};
use crate::report::model::Report;
use crate::report::number_format::NumberStyle::Share;
use crate::report::number_format::{format_count, format_number};
use crate::report::score_bootstrap::{BootstrapSettings, MeanIntervals};

/// Reads one interval of a metric's means.
type MeanIntervalField = fn(&MeanIntervals) -> Option<[f64; 2]>;

/// Returns the table of McNemar's tests, one for every two compared metrics, or `None` without comparisons.
pub(super) fn comparisons(report: &Report) -> Option<Table> {
    let test = report.comparisons.first()?.test;
    let table = Table::of(&report.comparisons)
        .text("Comparison", |found| versus(found.a, found.b))
        .text("by", |found| found.basis.name())
        .count("n", |found| found.n)
        .count("first only", |found| found.a_only)
        .count("second only", |found| found.b_only)
        .p_value("p", |found| found.p)
        .p_value("Holm", |found| found.p_holm);
    Some(table.caption(format!(
        "Metrics compared by which results are right ({test}; Holm's correction within each basis)."
    )))
}

/// Returns a sentence or two on each comparison.
pub(super) fn comparison_sentences(report: &Report) -> Vec<String> {
    let sentence = |found: &Comparison| {
        let (metrics, basis) = (versus(found.a, found.b), found.basis.name());
        format!("{metrics}, by {basis}: {}", found.conclusion)
    };
    report.comparisons.iter().map(sentence).collect()
}

/// Returns the table of bootstrap intervals: of mean scores and, if whole blocks were resampled, of Acc. Returns `None`
/// if there is no interval.
pub(super) fn mean_intervals(report: &Report) -> Option<Table> {
    let settings = report.bootstrap.as_ref()?;
    let fields: [(&'static str, MeanIntervalField); 4] = [
        ("SSIM", |means| means.ssim),
        ("IoU", |means| means.iou),
        ("Dice", |means| means.dice),
        ("Acc", |means| means.acc_by_block),
    ];
    let mut table = Table::of(&report.rows).text("95% bootstrap", |row| row.metric.title());
    let mut is_any = false;
    for (header, read) in fields {
        let mut rows = report.rows.iter();
        if rows.any(|row| read(&row.means_ci95).is_some()) {
            table = table.interval(header, |row| read(&row.means_ci95));
            is_any = true;
        }
    }
    is_any.then(|| {
        table.caption(format!(
            "95 % intervals of the means above, by the {}.",
            method(settings)
        ))
    })
}

fn method(settings: &BootstrapSettings) -> String {
    format!(
        "{} bootstrap ({} {}, {} resamples, seed {})",
        settings.method,
        format_count(settings.units),
        settings.by.plural(),
        format_count(settings.resamples),
        settings.seed
    )
}

/// Returns the table of comparisons by score, or `None` if no comparison has an interval.
pub(super) fn score_comparisons(report: &Report) -> Option<Table> {
    let settings = report.bootstrap.as_ref()?;
    let mut compared = report.score_comparisons.iter();
    let has_interval = compared.any(|found| found.ci95.is_some());
    let bounds = |bounds: [f64; 2]| bounds.map(|bound| format_number(bound, Share)).join(", ");
    has_interval.then(|| {
        Table::of(&report.score_comparisons)
            .text("Scores compared", |found| versus(found.a, found.b))
            .text("by", |found| found.score.title())
            .share("diff.", |found| Some(found.difference))
            .optional_text("95% bootstrap", |found| found.ci95.map(bounds))
            .p_value("p", |found| found.p)
            .p_value("Holm", |found| found.p_holm)
            .caption(format!(
                "Mean of the first minus mean of the second on the same pairs, by the {}; two-sided p with Holm's \
                 correction within each score. A higher score does not mean a better alignment: a mask that copies the \
                 ink would score best.",
                method(settings)
            ))
    })
}

#[cfg(test)]
mod tests {
    use super::{mean_intervals, score_comparisons};
    use crate::domain::ThresholdMetric;
    use crate::report::render::text::aligned;
    use crate::report::{Report, ReportAccumulator, TruthEvaluation, test_fixtures};

    /// Twenty pairs on which one metric has the best IoU.
    fn with_best(best: ThresholdMetric) -> Report {
        let mut report = ReportAccumulator::default();
        for i in 0..20 {
            let mut pair = test_fixtures::done(&format!("p{i:02}"), 0.7, &[]);
            for record in &mut pair.metrics {
                let is_best = record.outcome.metric == best;
                record.outcome.scores.iou = if is_best { 0.75 } else { 0.7 };
            }
            report.add(&pair, &TruthEvaluation::default());
        }
        report.finish()
    }

    #[test]
    fn means_have_intervals_and_metrics_their_differences() {
        let report = with_best(ThresholdMetric::Ensemble);
        let cells = |row: &[Option<String>]| -> Vec<String> {
            row.iter()
                .map(|cell| cell.clone().unwrap_or_default())
                .collect()
        };
        let table = mean_intervals(&report).expect("20 pairs");
        assert_eq!(table.columns.len(), 4, "no Acc without verdicts");
        let ensemble = ["Ensemble", "0.810-0.810", "0.750-0.750", "0.824-0.824"];
        assert_eq!(cells(&table.rows[2]), ensemble);
        assert!(
            table
                .caption
                .contains("(20 pairs, 10,000 resamples, seed 1)")
        );
        let table = score_comparisons(&report).expect("three metrics");
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
        let table = score_comparisons(&with_best(ThresholdMetric::Density)).expect("metrics");
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
        assert_eq!(mean_intervals(&report), None);
        assert_eq!(score_comparisons(&report), None);
    }
}
