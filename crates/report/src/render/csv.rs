//! The report as a tidy CSV (RFC 4180): one line per metric and quantity. Numbers have all digits.

use serde_json::{Value, json};

use crate::comparison::Basis;
use crate::model::{MetricRow, Report};
use crate::risk_coverage::{COVERAGE_PERCENT, LEAST_CONFIDENT_PERCENT};
use mocban_core::domain::{Reason, ThresholdMetric};

/// The columns.
pub(super) const HEADER: &str = "metric,quantity,n,value,low,high\r\n";

/// A quantity, and JSON pointers to its parts in the JSON that [`document`] returns.
struct CsvQuantity {
    name: String,
    value: String,
    /// How many results the value is computed from.
    n: String,
    /// The 95 % interval, or empty.
    interval: String,
}

/// Returns the report as CSV. Leaves out quantities that do not exist; a missing interval is two empty fields.
pub(super) fn render(report: &Report) -> String {
    let mut text = HEADER.to_owned();
    let quantities = quantities();
    for row in &report.rows {
        let document = document(report, row);
        for quantity in &quantities {
            text.extend(line(row, quantity, &document));
        }
    }
    text
}

/// Returns whether lines are rows of a report: metrics and quantities in their order, with four numbers of which some may be
/// missing.
pub(super) fn are_rows<'a>(mut lines: impl Iterator<Item = &'a str>) -> bool {
    let quantities = quantities();
    let place = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [metric, name, numbers @ ..] = cells.as_slice() else {
            return None;
        };
        let metric: ThresholdMetric = metric.parse().ok()?;
        let quantity = quantities.iter().position(|known| known.name == *name)?;
        let is_number = |cell: &&str| cell.is_empty() || cell.parse::<f64>().is_ok();
        (numbers.len() == 4 && numbers.iter().all(is_number)).then_some((metric, quantity))
    };
    let mut last = None;
    lines.all(|line| {
        let found = place(line);
        let is_next = found.is_some() && found > last;
        last = found;
        is_next
    })
}

/// Returns the line of a quantity, or `None` if it does not exist.
fn line(row: &MetricRow, quantity: &CsvQuantity, document: &Value) -> Option<String> {
    let number = |pointer: &str| match document.pointer(pointer) {
        Some(Value::Number(number)) => Some(digits(number)),
        Some(_) | None => None,
    };
    let value = number(&quantity.value)?;
    let n = number(&quantity.n).unwrap_or_default();
    let [low, high] = [0, 1].map(|i| number(&format!("{}/{i}", quantity.interval)));
    // The interval by block has the value of `acc`; without the interval, it says nothing new.
    if quantity.name == "acc_by_block" && low.is_none() {
        return None;
    }
    let [low, high] = [low, high].map(Option::unwrap_or_default);
    let (metric, name) = (row.metric, &quantity.name);
    Some(format!("{metric},{name},{n},{value},{low},{high}\r\n"))
}

/// Returns a number with all its digits and without an exponent.
fn digits(number: &serde_json::Number) -> String {
    match (number.as_u64(), number.as_f64()) {
        // Display of f64 has no exponent, unlike JSON.
        (None, Some(number)) => number.to_string(),
        (Some(_), _) | (None, None) => number.to_string(),
    }
}

/// Returns a row as JSON. Adds values of the row's metric from other parts of the report.
fn document(report: &Report, row: &MetricRow) -> Value {
    let mut value = serde_json::to_value(row).expect("a row is JSON");
    value["decided"] = json!(row.passed + row.failed);
    let mut thresholds = report.thresholds.iter();
    value["thresholds"] = json!(thresholds.find(|found| found.metric == row.metric));
    value["verdict_curve"] = json!(report.risk_coverage(Basis::Verdicts, row.metric));
    value["truth_curve"] = json!(report.risk_coverage(Basis::Truth, row.metric));
    if row.judged > 0 {
        for (reason, name) in reasons() {
            value["reasons"][name] = json!(row.failed_for(reason));
        }
    }
    value
}

/// Returns every reason with its name, and `no_reason` last.
fn reasons() -> impl Iterator<Item = (Option<Reason>, &'static str)> {
    let named = Reason::ALL.map(|reason| (Some(reason), reason.name()));
    named.into_iter().chain([(None, "no_reason")])
}

/// Returns the quantities in their order.
fn quantities() -> Vec<CsvQuantity> {
    let mut found = Vec::new();
    let mut add = |prefix: &str, parent: &str, n: &str, fields: &str| {
        found.extend(fields.split_whitespace().map(|field| {
            let (name, field) = field.split_once('=').unwrap_or((field, field));
            quantity(&format!("{prefix}{name}"), &format!("{parent}/{field}"), n)
        }));
    };
    add(
        "",
        "",
        "/n",
        "results=n judged passed failed unsure conflicts stale disagreeing",
    );
    add("", "", "/decided", "acc acc_by_block=acc");
    add(
        "",
        "",
        "/n",
        "ssim nl_ssim iou iou_box dice missing_ink missing_wood",
    );
    let truth = "passed acc angle_le_5deg angle_median_deg tre_median_pct mask_iou_median mirrored";
    add("truth_", "/truth", "/truth/n", truth);
    add("", "/rules", "/judged", "double_read");
    for rule in ["either_fails", "adjudicated", "both_fail"] {
        let parent = format!("/rules/{rule}");
        add(
            &format!("{rule}_"),
            &parent,
            &format!("{parent}/n"),
            "acc=share",
        );
    }
    for (_, reason) in reasons() {
        add("failed_", "/reasons", "/failed", reason);
    }
    for (prefix, curve) in [("", "/verdict_curve"), ("truth_", "/truth_curve")] {
        add(
            &format!("{prefix}confidence_"),
            curve,
            &format!("{curve}/n"),
            "failures",
        );
        let least = format!("failures_in_least_{LEAST_CONFIDENT_PERCENT}=failures_in_least");
        add(
            &format!("{prefix}confidence_"),
            curve,
            &format!("{curve}/least_n"),
            &least,
        );
        for (i, at) in COVERAGE_PERCENT.into_iter().enumerate() {
            let point = format!("{curve}/points/{i}");
            let fields = format!("acc_at_{at}=acc least_confidence_at_{at}=least_confidence");
            add(prefix, &point, &format!("{point}/n"), &fields);
        }
    }
    add(
        "threshold_",
        "/thresholds",
        "/thresholds/n",
        "p5 median p95",
    );
    let manual = "angle_le_5deg angle_median_deg angle_p95_deg shift_median_pct shift_p95_pct scale_median_pct \
                  scale_p95_pct mirrored";
    add(
        "manual_alignment_",
        "/manual_alignment",
        "/manual_alignment/n",
        manual,
    );
    found
}

/// Returns a quantity with the interval that belongs to its value, if there is one.
fn quantity(name: &str, value: &str, n: &str) -> CsvQuantity {
    let interval = match (name, value.strip_suffix("share")) {
        ("ssim" | "iou" | "iou_box" | "dice" | "acc_by_block", _) => format!("/means_ci95/{name}"),
        (_, Some(rate)) => format!("{rate}ci95"),
        _ if value.ends_with("/acc") => format!("{value}_ci95"),
        _ => String::new(),
    };
    CsvQuantity {
        name: name.to_owned(),
        value: value.to_owned(),
        n: n.to_owned(),
        interval,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{HEADER, quantities, render};
    use crate::{Report, ReportAccumulator, test_fixtures};
    use mocban_core::domain::{Reason, Verdict};
    use mocban_results::TruthEvaluation;
    use mocban_results::stats::wilson_95;

    /// Returns n, value, low and high of each quantity of a metric.
    fn quantities_of(report: &Report, metric: &str) -> BTreeMap<String, [String; 4]> {
        let text = render(report);
        let rows = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        rows.filter(|row| row[0] == metric)
            .map(|row| {
                let [_, name, numbers @ ..] = <[String; 6]>::try_from(row).expect("six fields");
                (name, numbers)
            })
            .collect()
    }

    #[test]
    fn every_line_has_six_fields_and_ends_with_crlf() {
        let mut report = ReportAccumulator::default();
        report.add(
            &test_fixtures::done("a", 0.75, &[Verdict::Pass]),
            &TruthEvaluation::default(),
        );
        report.add(
            &test_fixtures::done("b", 0.75, &[]),
            &test_fixtures::truth(1.5, 2.0, 0.9),
        );
        let report = report.finish();
        let text = render(&report);
        assert!(text.starts_with(HEADER) && text.ends_with("\r\n"));
        assert!(text.lines().all(|line| line.split(',').count() == 6));
        let found = quantities_of(&report, "nl_ssim");
        assert_eq!(found["results"], ["2", "2", "", ""]);
        assert_eq!(found["passed"], ["2", "1", "", ""]);
        assert_eq!(found["acc"], ["1", "1", "0.20654931437723745", "1"]);
        assert_eq!(found["iou"][..2], ["2", "0.75"]);
        assert_eq!(found["truth_angle_median_deg"], ["1", "1.5", "", ""]);
        assert_eq!(found["truth_mask_iou_median"][1], "0.9");
    }

    #[test]
    fn every_quantity_is_in_a_full_report_and_once() {
        let report = test_fixtures::full_report();
        let found = quantities_of(&report, "ensemble");
        for quantity in quantities() {
            assert!(found.contains_key(&quantity.name), "{}", quantity.name);
            assert!(
                !found[&quantity.name][0].is_empty(),
                "{} has no n",
                quantity.name
            );
        }
        assert_eq!(found.len(), quantities().len());
        for name in [
            "acc",
            "acc_by_block",
            "iou",
            "truth_acc",
            "both_fail_acc",
            "truth_acc_at_97",
        ] {
            assert!(!found[name][2].is_empty(), "{name} has no interval");
        }
    }

    #[test]
    fn a_missing_value_has_no_line() {
        let report = ReportAccumulator::default().finish();
        let found = quantities_of(&report, "density");
        assert_eq!(found["results"], ["0", "0", "", ""]);
        assert!(
            !found.contains_key("acc") && !found.contains_key("iou"),
            "{found:?}"
        );
    }

    #[test]
    fn risk_coverage_is_under_its_names() {
        let mut report = ReportAccumulator::default();
        for (name, confidence, angle_deg) in [("a", 0.75, 1.0), ("b", 0.25, 90.0)] {
            let truth = test_fixtures::truth(angle_deg, 1.0, 0.9);
            report.add(&test_fixtures::with_confidence(name, confidence), &truth);
        }
        let found = quantities_of(&report.finish(), "relief");
        assert_eq!(found["truth_confidence_failures"][..2], ["2", "1"]);
        assert_eq!(
            found["truth_confidence_failures_in_least_3"][..2],
            ["1", "1"]
        );
        assert_eq!(found["truth_acc_at_100"][..2], ["2", "0.5"]);
        assert_eq!(found["truth_acc_at_50"][..2], ["1", "1"]);
        assert_eq!(found["truth_least_confidence_at_50"][1], "0.75");
        assert!(!found.contains_key("acc_at_100"));
    }

    #[test]
    fn rules_reasons_and_thresholds_are_under_their_names() {
        let mut report = ReportAccumulator::default();
        for (name, first, second) in [
            ("a", Verdict::Pass, Verdict::Pass),
            ("b", Verdict::Pass, Verdict::Fail),
            ("c", Verdict::Fail, Verdict::Fail),
        ] {
            let mut pair = test_fixtures::done(name, 0.8, &[first, second]);
            for record in &mut pair.metrics {
                record.verdicts[1].reason = Some(Reason::Mirrored);
            }
            report.add(&pair, &TruthEvaluation::default());
        }
        let found = quantities_of(&report.finish(), "nl_ssim");
        assert_eq!(found["double_read"][1], "3");
        assert_eq!(
            found["either_fails_acc"][..2],
            ["3".to_owned(), (1.0 / 3.0).to_string()]
        );
        assert_eq!(found["adjudicated_acc"][0], "2");
        assert_eq!(found["both_fail_acc"][1], (2.0 / 3.0).to_string());
        let low = wilson_95(2, 3).expect("three")[0];
        assert_eq!(found["both_fail_acc"][2], low.to_string());
        assert_eq!(found["failed_mirrored"][1], "1");
        assert_eq!(
            [&found["failed_angle"][1], &found["failed_no_reason"][1]],
            ["0", "0"]
        );
        assert!(found["threshold_median"][1].starts_with("0.4577"));
    }
}
