//! The tables of a report, in their order.

use super::block_table::blocks;
use super::comparison_tables::mean_intervals;
use super::table::Table;
use crate::model::{MetricRow, Report};
use crate::truth_summary::TruthSummary;
use mocban_core::domain::Reason;
use mocban_results::manual_alignment::ManualAlignmentErrors;
use mocban_results::number_format::NumberStyle::{Degrees, Milliseconds, Percent, Seconds, Share};
use mocban_results::stats::Rate;

/// Returns the tables of a report. A table without content is left out, except the table of scores.
pub(super) fn tables(report: &Report) -> Vec<Table> {
    let tables = [
        Some(scores(report)),
        mean_intervals(report),
        report.has_verdicts().then(|| verdicts(report)),
        rules(report),
        fail_reasons(report),
        attention_checks(report),
        report.has_truth().then(|| truth(report)),
        blocks(report),
        manual_alignments(report),
        thresholds(report),
        times(report),
    ];
    tables.into_iter().flatten().collect()
}

/// Returns the paper's table.
pub(super) fn scores(report: &Report) -> Table {
    let mut table = Table::of(&report.rows)
        .text("Method", |row| row.metric.title())
        .count("n", |row| row.n);
    if report.has_verdicts() {
        table = table.count("decided", |row| row.passed + row.failed);
    }
    table
        .share("Acc %", |row| row.acc)
        .interval(report.interval.title(), Share, |row| row.acc_ci95)
        .score("SSIM", |row| row.ssim)
        .score("IoU", |row| row.iou)
        .score("IoU box", |row| row.iou_box)
        .score("Dice", |row| row.dice)
        .caption("scores",
            "Acc is the share of passed results among the decided ones, which reviewers passed or failed. SSIM, IoU and \
             Dice are means over n pairs, computed by pixel. IoU box is that of the bounding boxes.",
        )
}

/// Returns the counts of verdicts.
pub(super) fn verdicts(report: &Report) -> Table {
    Table::of(&report.rows)
        .text("Verdicts", |row| row.metric.title())
        .count("judged", |row| row.judged)
        .count("unjudged", |row| row.n - row.judged)
        .count("passed", |row| row.passed)
        .count("failed", |row| row.failed)
        .count("unsure", |row| row.unsure)
        .count("stale", |row| row.stale)
        .caption(
            "verdicts",
            "Results by verdict. Stale: only an earlier result has a verdict.",
        )
}

/// Returns Acc under three rules for disagreement, or `None` if no result was decided by two reviewers.
pub(super) fn rules(report: &Report) -> Option<Table> {
    let is_double = |row: &MetricRow| row.rules.is_some_and(|rules| rules.double_read > 0);
    let rate = |row: &MetricRow, i: usize| row.rules.map(|rules| rules.rates()[i]);
    let mut table = Table::of(&report.rows)
        .text("Rules", |row| row.metric.title())
        .count("double", |row| row.rules.map(|rules| rules.double_read));
    for (i, header) in ["either %", "adjudicated %", "both %"]
        .into_iter()
        .enumerate()
    {
        table = table
            .share(header, |row| rate(row, i)?.share)
            .count("n", |row| rate(row, i).map(|rate| rate.n));
    }
    report.rows.iter().any(is_double).then(|| {
        table.caption("rules",
            "Acc under three rules for results on which reviewers disagree. Either: a result fails if one reviewer fails \
             it. Adjudicated: it counts as in the Acc above. Both: it fails only if both fail it. n is the number of \
             decided results. Double is the number that at least two reviewers decided.",
        )
    })
}

/// Returns the failed results by reason, with a column for each metric, or `None` without failed results.
pub(super) fn fail_reasons(report: &Report) -> Option<Table> {
    let reasons = Reason::ALL.into_iter().map(Some).chain([None]);
    let is_given = |reason: &Option<Reason>| {
        let mut rows = report.rows.iter();
        rows.any(|row| row.failed_for(*reason) > 0)
    };
    let given: Vec<Option<Reason>> = reasons.filter(is_given).collect();
    let is_any = !given.is_empty();
    let mut table = Table::of(given).text("Failed for", |reason| {
        reason.map_or("no reason given", Reason::title)
    });
    for row in &report.rows {
        table = table.count(row.metric.title(), |reason| row.failed_for(*reason));
    }
    is_any.then(|| {
        table.caption(
            "fail-reasons",
            "Failed results by the reasons that reviewers gave; a result may have several.",
        )
    })
}

/// Returns the rates of detected planted faults, or `None` if no planted fault was judged.
pub(super) fn attention_checks(report: &Report) -> Option<Table> {
    let checks = report.attention_checks.as_ref()?;
    let by_kind = checks.by_kind.iter().map(|(kind, rate)| (*kind, *rate));
    let rates: Vec<(&str, Rate)> = by_kind.chain([("all", checks.all)]).collect();
    let table = Table::of(rates)
        .text("Attention checks", |(kind, _)| *kind)
        .count("n", |(_, rate)| rate.n)
        .count("detected", |(_, rate)| rate.count)
        .share("share %", |(_, rate)| rate.share)
        .interval(report.interval.title(), Share, |(_, rate)| rate.ci95);
    Some(table.caption("attention-checks",
        "Faults planted in good results that reviewers failed, of those that they answered. This shows how well they \
         find such faults, and no others.",
    ))
}

/// Returns the errors against ground truth.
pub(super) fn truth(report: &Report) -> Table {
    let value =
        |row: &MetricRow, read: fn(&TruthSummary) -> Option<f64>| row.truth.as_ref().and_then(read);
    Table::of(&report.rows)
        .text("Truth", |row| row.metric.title())
        .count("n", |row| row.truth.as_ref().map_or(0, |truth| truth.n))
        .share("Acc %", |row| value(row, |truth| truth.acc))
        .interval(report.interval.title(), Share, |row| {
            row.truth.as_ref()?.acc_ci95
        })
        .share("in 5\u{b0} %", |row| value(row, |truth| truth.angle_le_5deg))
        .number("angle \u{b0}", Degrees, |row| {
            value(row, |truth| truth.angle_median_deg)
        })
        .number("landm. %", Percent, |row| {
            value(row, |truth| truth.tre_median_pct)
        })
        .score("mask IoU", |row| value(row, |truth| truth.mask_iou_median))
        .caption("truth",
            "Errors against ground truth. Acc here counts results within three limits. The angle is within 5 degrees, \
             and landmarks are within 5 % of the character's height. The mask IoU with the true stroke tops is at least \
             0.7. Angle, landmarks and mask IoU are medians.",
        )
}

/// Returns the errors against manual alignments, or `None` if there are none.
pub(super) fn manual_alignments(report: &Report) -> Option<Table> {
    let rows = report.rows.iter();
    let found: Vec<(&str, &ManualAlignmentErrors)> = rows
        .filter_map(|row| Some((row.metric.title(), row.manual_alignment.as_ref()?)))
        .collect();
    (!found.is_empty()).then(|| {
        Table::of(found)
            .text("Manual", |(title, _)| *title)
            .count("n", |(_, errors)| errors.n)
            .share("in 5\u{b0} %", |(_, errors)| errors.angle_le_5deg)
            .number("angle \u{b0}", Degrees, |(_, errors)| {
                errors.angle_median_deg
            })
            .number("95 %", Degrees, |(_, errors)| errors.angle_p95_deg)
            .number("shift %", Percent, |(_, errors)| errors.shift_median_pct)
            .number("95 %", Percent, |(_, errors)| errors.shift_p95_pct)
            .number("scale %", Percent, |(_, errors)| errors.scale_median_pct)
            .number("95 %", Percent, |(_, errors)| errors.scale_p95_pct)
            .caption("manual-alignments",
                "Errors against manual alignments, over the n pairs that have one. The first column is the share within \
                 5 degrees. Angle, shift and difference in scale are medians and 95th percentiles. Shift is in percent \
                 of the relief's longer side.",
            )
    })
}

/// Returns the distribution of thresholds, or `None` without results.
pub(super) fn thresholds(report: &Report) -> Option<Table> {
    (!report.thresholds.is_empty()).then(|| {
        Table::of(&report.thresholds)
            .text("Thresholds", |found| found.metric.title())
            .count("n", |found| found.n)
            .score("5 %", |found| Some(found.p5))
            .score("median", |found| Some(found.median))
            .score("95 %", |found| Some(found.p95))
            .caption("thresholds",
                "Relative height of the thresholds: 5th percentile, median and 95th percentile. 0 is the lowest point \
                 of a depth map, and 1 its highest.",
            )
    })
}

/// Returns computing times by stage, or `None` if the report has none.
pub(super) fn times(report: &Report) -> Option<Table> {
    (!report.times.is_empty()).then(|| {
        Table::of(&report.times)
            .text("Times", |time| time.stage.name())
            .count("n", |time| time.n)
            .number("median ms", Milliseconds, |time| Some(time.median_ms))
            .number("95 % ms", Milliseconds, |time| Some(time.p95_ms))
            .number("sum s", Seconds, |time| Some(time.total_s))
            .caption("times",
                "Computing time of the current results by stage, on one core. Median and 95th percentile are in \
                 milliseconds, the sum in seconds.",
            )
    })
}

#[cfg(test)]
mod tests {
    use super::{attention_checks, fail_reasons, thresholds, times};
    use crate::render::table::Table;
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_core::domain::{Reason, Stage, Verdict};
    use mocban_results::{AttentionCheckRates, Rate, TruthEvaluation};

    fn cells(table: &Table, row: usize) -> Vec<&str> {
        table.rows[row]
            .iter()
            .flatten()
            .map(String::as_str)
            .collect()
    }

    #[test]
    fn only_reasons_that_were_given_have_a_row() {
        let mut report = ReportAccumulator::default();
        for (name, reason) in [("a", Some(Reason::Angle)), ("b", None)] {
            let mut pair = test_fixtures::done(name, 0.8, &[Verdict::Fail]);
            pair.metrics[0].verdicts[0].reason = reason;
            pair.metrics.truncate(1);
            report.add(&pair, &TruthEvaluation::default());
        }
        let table = fail_reasons(&report.finish()).expect("two failures");
        assert_eq!(cells(&table, 0), ["angle", "1", "0", "0"]);
        assert_eq!(cells(&table, 1), ["no reason given", "1", "0", "0"]);
        assert_eq!(table.rows.len(), 2);
        assert_eq!(fail_reasons(&ReportAccumulator::default().finish()), None);
    }

    #[test]
    fn detected_faults_have_their_interval_by_kind_and_in_all() {
        let mut report = ReportAccumulator::default();
        report.set_attention_checks(AttentionCheckRates {
            all: Rate::new(20, 22),
            by_kind: [
                ("turned", Rate::new(19, 20)),
                ("threshold", Rate::new(1, 2)),
            ]
            .into(),
            ..AttentionCheckRates::default()
        });
        let table = attention_checks(&report.finish()).expect("22 were answered");
        let turned = ["turned", "20", "19", "95.0", "76.4–99.1"];
        assert_eq!(cells(&table, 1), turned);
        assert_eq!(cells(&table, 2)[..3], ["all", "22", "20"]);
        let mut none = ReportAccumulator::default();
        none.set_attention_checks(AttentionCheckRates::default());
        assert_eq!(attention_checks(&none.finish()), None);
    }

    #[test]
    fn times_can_be_left_out_and_thresholds_cannot() {
        let mut report = ReportAccumulator::default();
        let mut pair = test_fixtures::done("a", 0.8, &[]);
        pair.stages = vec![test_fixtures::stage(Stage::Fit, 12)];
        report.add(&pair, &TruthEvaluation::default());
        let report = report.finish();
        let table = times(&report).expect("one stage");
        assert_eq!(cells(&table, 0), ["fit", "1", "12", "12", "0.0"]);
        let report = report.without_times();
        assert_eq!(times(&report), None);
        let table = thresholds(&report).expect("four results");
        assert_eq!(cells(&table, 3), ["Relief", "1", "0.458", "0.458", "0.458"]);
    }
}
