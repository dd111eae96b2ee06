//! The report as CSV (RFC 4180): one line a metric, numbers in full.

use super::csv_fields;
use crate::report::interval::IntervalMethod;
use crate::report::model::{
    Basis, MetricRow, Report, RiskCoverage, RiskCoveragePoint, TruthSummary,
};
use crate::report::risk_coverage::{KEPT_PERCENT, LEAST_PERCENT};

/// Names of the columns, in order; those of [`coverage_names`] follow, for reviewers and then for truth,
/// and those of [`csv_fields`].
const COLUMNS: [&str; 27] = [
    "metric",
    "n",
    "read",
    "passed",
    "failed",
    "unsure",
    "conflicts",
    "stale",
    "acc",
    "acc_ci95_low",
    "acc_ci95_high",
    "ssim",
    "nl_ssim",
    "iou",
    "iou_box",
    "dice",
    "truth_n",
    "truth_passed",
    "truth_acc",
    "truth_acc_ci95_low",
    "truth_acc_ci95_high",
    "truth_angle_le_5deg",
    "truth_angle_median_deg",
    "truth_tre_median_pct",
    "truth_mask_iou_median",
    "truth_mirrored",
    "ci95",
];

/// The report as CSV. What does not exist is an empty field.
pub(super) fn render(report: &Report) -> String {
    let names = COLUMNS.map(field).into_iter();
    let later = csv_fields::names();
    let coverage = BASES.into_iter().flat_map(coverage_names);
    let mut text = line(names.chain(coverage).chain(later));
    for row in &report.rows {
        let curves = BASES.map(|basis| report.coverage(basis, row.metric));
        let numbers = curves.into_iter().flat_map(coverage_fields);
        let first = fields(row, report.interval).into_iter().chain(numbers);
        text += &line(first.chain(csv_fields::values(report, row)));
    }
    text
}

/// Both judges, in the order of their columns.
const BASES: [Basis; 2] = [Basis::Verdicts, Basis::Truth];

/// Columns of accuracy against coverage; `acc_at_97` is the Acc of the 97 % most confident results.
fn coverage_names(basis: Basis) -> Vec<String> {
    let judge = match basis {
        Basis::Verdicts => "",
        Basis::Truth => "truth_",
    };
    let mut names = vec![
        format!("{judge}confidence_n"),
        format!("{judge}confidence_failures"),
        format!("{judge}confidence_failures_in_least_{LEAST_PERCENT}"),
    ];
    names.extend(KEPT_PERCENT.iter().flat_map(|percent| {
        [
            format!("{judge}acc_at_{percent}"),
            format!("{judge}acc_at_{percent}_ci95_low"),
            format!("{judge}acc_at_{percent}_ci95_high"),
            format!("{judge}least_confidence_at_{percent}"),
        ]
    }));
    names
}

fn coverage_fields(curve: Option<&RiskCoverage>) -> Vec<String> {
    let count = |read: fn(&RiskCoverage) -> u64| {
        curve.map_or_else(String::new, |curve| read(curve).to_string())
    };
    let mut fields = vec![
        count(|curve| curve.n),
        count(|curve| curve.failures),
        count(|curve| curve.failures_in_least),
    ];
    for i in 0..KEPT_PERCENT.len() {
        fields.extend(point_fields(curve.and_then(|curve| curve.points.get(i))));
    }
    fields
}

fn point_fields(point: Option<&RiskCoveragePoint>) -> [String; 4] {
    let [low, high] = bounds(point.and_then(|point| point.acc_ci95));
    let value = |read: fn(&RiskCoveragePoint) -> Option<f64>| number(point.and_then(read));
    [
        value(|point| point.acc),
        low,
        high,
        value(|point| point.least_confidence),
    ]
}

fn fields(row: &MetricRow, interval: IntervalMethod) -> Vec<String> {
    let [low, high] = bounds(row.acc_ci95);
    let mut fields = vec![
        field(row.metric.name()),
        row.n.to_string(),
        row.read.to_string(),
        row.passed.to_string(),
        row.failed.to_string(),
        row.unsure.to_string(),
        row.conflicts.to_string(),
        row.stale.to_string(),
        number(row.acc),
        low,
        high,
        number(row.ssim),
        number(row.nl_ssim),
        number(row.iou),
        number(row.iou_box),
        number(row.dice),
    ];
    fields.extend(truth_fields(row.truth.as_ref()));
    fields.push(interval_name(row, interval));
    fields
}

/// What the intervals of the line are; nothing where it has none.
fn interval_name(row: &MetricRow, interval: IntervalMethod) -> String {
    let of_truth = row.truth.as_ref().and_then(|truth| truth.acc_ci95);
    let any = row.acc_ci95.or(of_truth);
    any.map_or_else(String::new, |_| interval.name().to_owned())
}

fn truth_fields(truth: Option<&TruthSummary>) -> [String; 10] {
    let value = |read: fn(&TruthSummary) -> Option<f64>| number(truth.and_then(read));
    let count = |read: fn(&TruthSummary) -> u64| {
        truth.map_or_else(String::new, |truth| read(truth).to_string())
    };
    let [low, high] = bounds(truth.and_then(|truth| truth.acc_ci95));
    [
        count(|truth| truth.n),
        count(|truth| truth.passed),
        value(|truth| truth.acc),
        low,
        high,
        value(|truth| truth.angle_le_5deg),
        value(|truth| truth.angle_median_deg),
        value(|truth| truth.tre_median_pct),
        value(|truth| truth.mask_iou_median),
        count(|truth| truth.mirrored),
    ]
}

pub(super) fn bounds(bounds: Option<[f64; 2]>) -> [String; 2] {
    bounds.map_or_else(Default::default, |bounds| {
        bounds.map(|bound| number(Some(bound)))
    })
}

pub(super) fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// A text field: quoted where it must be, and with `'` before what a spreadsheet would take for a formula.
fn field(text: &str) -> String {
    let guarded = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        format!("'{text}")
    } else {
        text.to_owned()
    };
    if guarded.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", guarded.replace('"', "\"\""))
    } else {
        guarded
    }
}

fn line(fields: impl Iterator<Item = String>) -> String {
    fields.collect::<Vec<_>>().join(",") + "\r\n"
}

#[cfg(test)]
mod tests {
    use super::{BASES, COLUMNS, coverage_names, csv_fields, field, render};
    use crate::domain::Verdict;
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn every_line_has_every_field_and_ends_with_crlf() {
        let mut tally = ReportAccumulator::default();
        tally.add(
            &test_fixtures::done("a", 0.75, &[Verdict::Pass]),
            &TruthEvaluation::default(),
        );
        tally.add(
            &test_fixtures::done("b", 0.75, &[]),
            &test_fixtures::truth(1.5, 2.0, 0.9),
        );
        let text = render(&tally.finish());
        let lines: Vec<&str> = text.split("\r\n").collect();
        assert_eq!(lines.len(), 6);
        assert_eq!(lines[5], "");
        for line in &lines[..5] {
            let coverage: usize = BASES.map(|basis| coverage_names(basis).len()).iter().sum();
            let all = COLUMNS.len() + coverage + csv_fields::names().len();
            assert_eq!(line.split(',').count(), all, "{line}");
        }
        let golden = "nl_ssim,2,1,1,0,0,0,0,1,0.20654931437723745,1,0.81,0.82,0.75,0.9,";
        assert!(lines[1].starts_with(golden), "{}", lines[1]);
        let truth: Vec<_> = lines[1].split(',').take(COLUMNS.len()).collect();
        assert!(
            truth.join(",").ends_with(",1,1.5,2,0.9,0,wilson"),
            "{}",
            lines[1]
        );
    }

    #[test]
    fn what_is_not_there_is_an_empty_field() {
        let text = render(&ReportAccumulator::default().finish());
        let line = text.lines().nth(2).expect("density");
        assert!(line.starts_with("density,0,0,0,0,0,0,0,"), "{line}");
        assert!(line.split(',').skip(8).all(str::is_empty), "{line}");
    }

    #[test]
    fn coverage_stands_under_its_names() {
        let mut tally = ReportAccumulator::default();
        for (name, confidence, angle_deg) in [("a", 0.75, 1.0), ("b", 0.25, 90.0)] {
            let truth = test_fixtures::truth(angle_deg, 1.0, 0.9);
            tally.add(&test_fixtures::sure(name, confidence), &truth);
        }
        let text = render(&tally.finish());
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        let value = |name: &str| {
            let place = lines[0].iter().position(|found| *found == name);
            lines[4][place.expect(name)]
        };
        assert_eq!(value("metric"), "relief");
        assert_eq!(value("truth_confidence_n"), "2");
        assert_eq!(value("truth_confidence_failures_in_least_3"), "1");
        assert_eq!(value("truth_acc_at_100"), "0.5");
        assert_eq!(value("truth_acc_at_50"), "1");
        assert_eq!(value("truth_least_confidence_at_50"), "0.75");
        assert_eq!(value("acc_at_100"), "");
    }

    #[test]
    fn formulas_are_disarmed_and_quotes_doubled() {
        assert_eq!(field("=1+1"), "'=1+1");
        assert_eq!(field("-id"), "'-id");
        assert_eq!(field("a,\"b\"\n"), "\"a,\"\"b\"\"\n\"");
        assert_eq!(field("ensemble"), "ensemble");
    }
}
