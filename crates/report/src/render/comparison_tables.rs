//! Tables that compare metrics, and the table of bootstrap intervals.

use super::table::Table;
use crate::comparison::{Basis, Comparison, versus};
use crate::model::Report;
use crate::score_bootstrap::{BootstrapSettings, MeanIntervals};
use mocban_results::number_format::NumberStyle::{self, Score, Share};
use mocban_results::number_format::{format_count, format_number};

/// Reads one interval of a metric's means.
type MeanIntervalField = fn(&MeanIntervals) -> Option<[f64; 2]>;

/// Returns a table of McNemar's tests for each basis, with a row for every two compared metrics.
pub(super) fn comparisons(report: &Report) -> Vec<Table> {
    let table = |basis: Basis| {
        let compared = report.comparisons.iter();
        let compared: Vec<&Comparison> = compared.filter(|found| found.basis == basis).collect();
        let test = compared.first()?.test;
        let (id, header) = match basis {
            Basis::Verdicts => ("comparisons-verdicts", "Right by verdicts"),
            Basis::Truth => ("comparisons-truth", "Right by ground truth"),
        };
        Some(
            Table::of(compared)
                .text(header, |found| versus(found.a, found.b))
                .count("n", |found| found.n)
                .count("1st only", |found| found.a_only)
                .count("2nd only", |found| found.b_only)
                .p_value("p", |found| found.p)
                .p_value("Holm p", |found| found.p_holm)
                .caption(
                    id,
                    format!(
                        "Pairs on which only the first or only the second metric is right, by {}, of n. Test: {test}, \
                         with Holm's correction.",
                        basis.title()
                    ),
                ),
        )
    };
    Basis::ALL.into_iter().filter_map(table).collect()
}

/// Returns the conclusions from the comparisons. Comparisons with the same conclusion share a line.
pub(super) fn comparison_sentences(report: &Report) -> Vec<String> {
    let mut groups: Vec<(Basis, &str, Vec<String>)> = Vec::new();
    for found in &report.comparisons {
        let metrics = versus(found.a, found.b);
        let mut known = groups.iter_mut();
        let same = known.find(|(basis, conclusion, _)| {
            *basis == found.basis && *conclusion == found.conclusion
        });
        match same {
            Some((_, _, compared)) => compared.push(metrics),
            None => groups.push((found.basis, &found.conclusion, vec![metrics])),
        }
    }
    let line = |(basis, conclusion, compared): (Basis, &str, Vec<String>)| {
        let (basis, compared) = (basis.title(), compared.join("; "));
        format!("Compared by {basis}: {compared}. {conclusion}")
    };
    groups.into_iter().map(line).collect()
}

/// Returns the table of bootstrap intervals: of mean scores and, if whole blocks were resampled, of Acc. Returns `None`
/// if there is no interval.
pub(super) fn mean_intervals(report: &Report) -> Option<Table> {
    let settings = report.bootstrap.as_ref()?;
    let fields: [(&'static str, NumberStyle, MeanIntervalField); 4] = [
        ("SSIM", Score, |means| means.ssim),
        ("IoU", Score, |means| means.iou),
        ("Dice", Score, |means| means.dice),
        ("Acc %", Share, |means| means.acc_by_block),
    ];
    let mut table = Table::of(&report.rows).text("95 % bootstrap", |row| row.metric.title());
    let mut is_any = false;
    for (header, style, read) in fields {
        let mut rows = report.rows.iter();
        if rows.any(|row| read(&row.means_ci95).is_some()) {
            table = table.interval(header, style, |row| read(&row.means_ci95));
            is_any = true;
        }
    }
    is_any.then(|| {
        table.caption(
            "mean-intervals",
            format!(
                "95 % intervals of the means above, by the {}.",
                method(settings)
            ),
        )
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
    let bounds = |bounds: [f64; 2]| bounds.map(|bound| format_number(bound, Score)).join(", ");
    has_interval.then(|| {
        Table::of(&report.score_comparisons)
            .text("Scores compared", |found| versus(found.a, found.b))
            .text("by", |found| found.score.title())
            .score("diff.", |found| Some(found.difference))
            .optional_text("95 % bootstrap", |found| found.ci95.map(bounds))
            .p_value("p", |found| found.p)
            .p_value("Holm p", |found| found.p_holm)
            .caption("score-comparisons", format!(
                "Mean of the first minus mean of the second on the same pairs. Intervals and two-sided p are by the {}. \
                 Holm's correction is within each score. A higher score does not mean a better alignment: a mask that copies the \
                 ink would score best.",
                method(settings)
            ))
    })
}

#[cfg(test)]
mod tests {
    use super::{mean_intervals, score_comparisons};
    use crate::render::text::aligned;
    use crate::{Report, ReportAccumulator, test_fixtures};
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::TruthEvaluation;

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
        let ensemble = ["Ensemble", "0.810–0.810", "0.750–0.750", "0.824–0.824"];
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
        assert!(
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
    }

    #[test]
    fn an_empty_project_has_neither() {
        let report = ReportAccumulator::default().finish();
        assert_eq!(mean_intervals(&report), None);
        assert_eq!(score_comparisons(&report), None);
    }
}
