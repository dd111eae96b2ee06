//! The columns at the end of a line of the CSV: rules, reasons and thresholds of a metric.

use super::csv::{bounds, number};
use crate::domain::Reason;
use crate::report::adjudication::AdjudicationRules;
use crate::report::model::{MetricRow, Report};
use crate::report::{ManualAlignmentErrors, Score};

/// What one column is called and how it is read.
type CsvField = (String, String);

/// Names of the columns.
pub(super) fn names() -> Vec<String> {
    let fields = fields(None, None);
    fields.into_iter().map(|(name, _)| name).collect()
}

/// The fields of a row under [`names`].
pub(super) fn values(report: &Report, row: &MetricRow) -> Vec<String> {
    let fields = fields(Some(report), Some(row));
    fields.into_iter().map(|(_, value)| value).collect()
}

/// Names and values together, so that neither comes without the other.
fn fields(report: Option<&Report>, row: Option<&MetricRow>) -> Vec<CsvField> {
    let mut fields = rules(row.and_then(|row| row.rules.as_ref()));
    fields.extend(reasons(row));
    fields.extend(thresholds(report, row));
    fields.extend(intervals(report, row));
    fields.extend(by_hand(row.and_then(|row| row.by_hand.as_ref())));
    fields
}

fn rules(rules: Option<&AdjudicationRules>) -> Vec<CsvField> {
    let told_twice = rules.map_or_else(String::new, |rules| rules.told_twice.to_string());
    let mut fields = vec![("rules_told_twice".to_owned(), told_twice)];
    let rates = rules.map(AdjudicationRules::rates);
    for (i, name) in AdjudicationRules::NAMES.iter().enumerate() {
        let rate = rates.map(|rates| rates[i]);
        let n = rate.map_or_else(String::new, |rate| rate.n.to_string());
        let [low, high] = bounds(rate.and_then(|rate| rate.ci95));
        fields.extend([
            (format!("{name}_n"), n),
            (
                format!("{name}_acc"),
                number(rate.and_then(|rate| rate.share)),
            ),
            (format!("{name}_acc_ci95_low"), low),
            (format!("{name}_acc_ci95_high"), high),
        ]);
    }
    fields
}

/// How often each reason was given; nothing where nobody has read.
fn reasons(row: Option<&MetricRow>) -> Vec<CsvField> {
    let told = row.filter(|row| row.read > 0);
    let reasons = Reason::ALL.into_iter().map(Some).chain([None]);
    reasons
        .map(|reason| {
            let name = reason.map_or("no_reason", Reason::name);
            let times = told.map_or_else(String::new, |row| row.failed_for(reason).to_string());
            (format!("failed_{name}"), times)
        })
        .collect()
}

/// The bootstrap intervals of the means; `bootstrap_by` tells what was drawn.
fn intervals(report: Option<&Report>, row: Option<&MetricRow>) -> Vec<CsvField> {
    let means = row.map(|row| row.means_ci95).unwrap_or_default();
    let each = [
        (Score::Ssim.name(), means.ssim),
        (Score::Iou.name(), means.iou),
        (Score::IouBox.name(), means.iou_box),
        (Score::Dice.name(), means.dice),
        ("acc_by_block", means.acc_by_block),
    ];
    let ends = each.into_iter().flat_map(|(name, ends)| {
        let [low, high] = bounds(ends);
        [
            (format!("{name}_ci95_low"), low),
            (format!("{name}_ci95_high"), high),
        ]
    });
    let drawn = report.and_then(|report| report.bootstrap.filter(|_| means.ssim.is_some()));
    let by = drawn.map_or_else(String::new, |how| how.by.plural().to_owned());
    ends.chain([("bootstrap_by".to_owned(), by)]).collect()
}

fn by_hand(found: Option<&ManualAlignmentErrors>) -> Vec<CsvField> {
    let count = |read: fn(&ManualAlignmentErrors) -> u64| {
        found.map_or_else(String::new, |found| read(found).to_string())
    };
    let value = |read: fn(&ManualAlignmentErrors) -> Option<f64>| number(found.and_then(read));
    let fields = [
        ("n", count(|found| found.n)),
        ("angle_le_5deg", value(|found| found.angle_le_5deg)),
        ("angle_median_deg", value(|found| found.angle_median_deg)),
        ("angle_p95_deg", value(|found| found.angle_p95_deg)),
        ("shift_median_pct", value(|found| found.shift_median_pct)),
        ("shift_p95_pct", value(|found| found.shift_p95_pct)),
        ("scale_median_pct", value(|found| found.scale_median_pct)),
        ("scale_p95_pct", value(|found| found.scale_p95_pct)),
        ("mirrored", count(|found| found.mirrored)),
    ];
    fields
        .map(|(name, value)| (format!("by_hand_{name}"), value))
        .to_vec()
}

fn thresholds(report: Option<&Report>, row: Option<&MetricRow>) -> Vec<CsvField> {
    let found = report.zip(row).and_then(|(report, row)| {
        let mut cuts = report.thresholds.iter();
        cuts.find(|cuts| cuts.metric == row.metric)
    });
    vec![
        ("threshold_p5".to_owned(), number(found.map(|cuts| cuts.p5))),
        (
            "threshold_median".to_owned(),
            number(found.map(|cuts| cuts.median)),
        ),
        (
            "threshold_p95".to_owned(),
            number(found.map(|cuts| cuts.p95)),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::{names, values};
    use crate::domain::{Reason, Verdict};
    use crate::report::stats::wilson_95;
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn rules_reasons_and_thresholds_stand_under_their_names() {
        let mut tally = ReportAccumulator::default();
        for (name, second) in [
            ("a", Verdict::Pass),
            ("b", Verdict::Fail),
            ("c", Verdict::Fail),
        ] {
            let first = if name == "c" {
                Verdict::Fail
            } else {
                Verdict::Pass
            };
            let mut pair = test_fixtures::done(name, 0.8, &[first, second]);
            for record in &mut pair.metrics {
                record.verdicts[1].reason = Some(Reason::Mirrored);
            }
            tally.add(&pair, &TruthEvaluation::default());
        }
        let report = tally.finish();
        let (names, values) = (names(), values(&report, &report.rows[0]));
        assert_eq!(names.len(), values.len());
        let value = |wanted: &str| {
            let place = names.iter().position(|name| name == wanted);
            values[place.expect(wanted)].as_str()
        };
        assert_eq!(value("rules_told_twice"), "3");
        assert_eq!(value("either_fails_n"), "3");
        assert_eq!(value("either_fails_acc"), (1.0 / 3.0).to_string());
        assert_eq!(value("adjudicated_n"), "2");
        assert_eq!(value("both_fail_acc"), (2.0 / 3.0).to_string());
        let low = wilson_95(2, 3).expect("three")[0];
        assert_eq!(value("both_fail_acc_ci95_low"), low.to_string());
        assert_eq!(value("failed_mirrored"), "1");
        assert_eq!(
            (value("failed_angle"), value("failed_no_reason")),
            ("0", "0")
        );
        assert!(value("threshold_median").starts_with("0.4577"));
    }

    #[test]
    fn what_nobody_read_has_empty_fields() {
        let report = ReportAccumulator::default().finish();
        assert!(
            values(&report, &report.rows[0])
                .iter()
                .all(String::is_empty)
        );
    }
}
