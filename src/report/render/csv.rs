//! The report as CSV (RFC 4180), with one line per metric. Numbers have all digits.

use serde_json::{Value, json};

use crate::domain::Reason;
use crate::report::comparison::Basis;
use crate::report::model::{MetricRow, Report};
use crate::report::risk_coverage::{COVERAGE_PERCENT, LEAST_CONFIDENT_PERCENT};

/// The columns. Each has a name, and a JSON pointer to its value in the JSON that [`document`] returns.
#[derive(Default)]
struct CsvColumns(Vec<[String; 2]>);

/// Returns the report as CSV. A value that does not exist is an empty field.
pub(super) fn render(report: &Report) -> String {
    let CsvColumns(columns) = columns();
    let mut text = line(columns.iter().map(|[name, _]| escape(name)));
    for row in &report.rows {
        let document = document(report, row);
        text += &line(
            columns
                .iter()
                .map(|[_, pointer]| field(document.pointer(pointer))),
        );
    }
    text
}

/// Returns a row as JSON. Adds values of the row's metric from other parts of the report.
fn document(report: &Report, row: &MetricRow) -> Value {
    let mut value = serde_json::to_value(row).expect("a row is JSON");
    let truth_ci95 = row.truth.as_ref().and_then(|truth| truth.acc_ci95);
    let has_interval = row.acc_ci95.or(truth_ci95).is_some();
    value["interval"] = json!(has_interval.then(|| report.interval.name()));
    let is_resampled = row.means_ci95.ssim.is_some();
    let bootstrap = report.bootstrap.filter(|_| is_resampled);
    value["bootstrap_by"] = json!(bootstrap.map(|settings| settings.by.plural()));
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

/// Returns the columns in their order.
fn columns() -> CsvColumns {
    let mut columns = CsvColumns::default();
    columns.add(
        "",
        "",
        "metric n judged passed failed unsure conflicts stale disagreeing acc acc_ci95 ssim nl_ssim iou iou_box dice",
    );
    columns.add(
        "truth_",
        "/truth",
        "n passed acc acc_ci95 angle_le_5deg angle_median_deg tre_median_pct mask_iou_median mirrored",
    );
    columns.add("", "", "interval");
    columns.add_risk_coverage("", "/verdict_curve");
    columns.add_risk_coverage("truth_", "/truth_curve");
    columns.add("rules_", "/rules", "double_read");
    for rule in ["either_fails", "adjudicated", "both_fail"] {
        let fields = "n acc=share acc_ci95=ci95";
        columns.add(&format!("{rule}_"), &format!("/rules/{rule}"), fields);
    }
    for (_, reason) in reasons() {
        columns.add("failed_", "/reasons", reason);
    }
    columns.add("threshold_", "/thresholds", "p5 median p95");
    for mean in ["ssim", "iou", "iou_box", "dice", "acc_by_block"] {
        columns.add("", "/means_ci95", &format!("{mean}_ci95={mean}"));
    }
    columns.add("", "", "missing_ink missing_wood");
    columns.add("", "", "bootstrap_by");
    columns.add(
        "manual_alignment_",
        "/manual_alignment",
        "n angle_le_5deg angle_median_deg angle_p95_deg shift_median_pct shift_p95_pct scale_median_pct scale_p95_pct \
         mirrored",
    );
    columns
}

impl CsvColumns {
    /// Adds columns for fields of the JSON object at `parent`. `fields` is a list such as `n acc=share`: an item is the
    /// field's name, or `column=field` if the column has another name. A column whose name ends with `ci95` is split in
    /// two, one for each bound.
    fn add(&mut self, prefix: &str, parent: &str, fields: &str) {
        for field in fields.split_whitespace() {
            let (name, field) = field.split_once('=').unwrap_or((field, field));
            let (name, pointer) = (format!("{prefix}{name}"), format!("{parent}/{field}"));
            if name.ends_with("ci95") {
                self.0.push([format!("{name}_low"), format!("{pointer}/0")]);
                self.0
                    .push([format!("{name}_high"), format!("{pointer}/1")]);
            } else {
                self.0.push([name, pointer]);
            }
        }
    }

    /// Adds the columns of a risk-coverage curve. For example, `acc_at_97` is the Acc of the 97 % most confident
    /// results.
    fn add_risk_coverage(&mut self, prefix: &str, parent: &str) {
        let least = format!("failures_in_least_{LEAST_CONFIDENT_PERCENT}=failures_in_least");
        let fields = format!("n failures {least}");
        self.add(&format!("{prefix}confidence_"), parent, &fields);
        for (i, at) in COVERAGE_PERCENT.into_iter().enumerate() {
            let acc = format!("acc_at_{at}=acc acc_at_{at}_ci95=acc_ci95");
            let fields = format!("{acc} least_confidence_at_{at}=least_confidence");
            self.add(prefix, &format!("{parent}/points/{i}"), &fields);
        }
    }
}

fn field(value: Option<&Value>) -> String {
    match value {
        Some(Value::String(text)) => escape(text),
        // Display of f64 has no exponent, unlike JSON.
        Some(Value::Number(number)) => match (number.as_u64(), number.as_f64()) {
            (None, Some(number)) => number.to_string(),
            (Some(_), _) | (None, None) => number.to_string(),
        },
        Some(Value::Null | Value::Bool(_) | Value::Array(_) | Value::Object(_)) | None => {
            String::new()
        }
    }
}

/// Returns a text as a CSV field, quoted if necessary. A leading `'` keeps spreadsheets from running it as a formula.
fn escape(text: &str) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let guarded = if is_formula { "'" } else { "" }.to_owned() + text;
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
    use super::{escape, render};
    use crate::domain::{Reason, Verdict};
    use crate::report::stats::wilson_95;
    use crate::report::{Report, ReportAccumulator, TruthEvaluation, test_fixtures};

    /// The fields of one row under their names.
    fn fields(report: &Report, row: usize) -> impl Fn(&str) -> String + use<> {
        let text = render(report);
        let lines: Vec<Vec<String>> = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect();
        move |name| {
            let index = lines[0].iter().position(|found| found == name);
            lines[row + 1][index.expect(name)].clone()
        }
    }

    #[test]
    fn every_line_has_every_field_and_ends_with_crlf() {
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
        let lines: Vec<&str> = text.split("\r\n").collect();
        assert_eq!((lines.len(), lines[5]), (6, ""));
        let columns = lines[0].split(',').count();
        assert!(
            lines[..5]
                .iter()
                .all(|line| line.split(',').count() == columns)
        );
        let golden = "nl_ssim,2,1,1,0,0,0,0,2,1,0.20654931437723745,1,0.81,0.82,0.75,0.9,";
        assert!(lines[1].starts_with(golden), "{}", lines[1]);
        let value = fields(&report, 0);
        let names = [
            "truth_angle_le_5deg",
            "truth_angle_median_deg",
            "truth_tre_median_pct",
        ];
        assert_eq!(names.map(&value), ["1", "1.5", "2"]);
        let names = ["truth_mask_iou_median", "truth_mirrored", "interval"];
        assert_eq!(names.map(&value), ["0.9", "0", "wilson"]);
    }

    #[test]
    fn every_column_has_a_value_in_a_full_report() {
        let report = test_fixtures::full_report();
        let text = render(&report);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        for (name, value) in lines[0].iter().zip(&lines[3]) {
            assert!(!value.is_empty(), "{name} is empty");
        }
    }

    #[test]
    fn a_missing_value_is_an_empty_field() {
        let text = render(&ReportAccumulator::default().finish());
        let line = text.lines().nth(2).expect("density");
        assert!(line.starts_with("density,0,0,0,0,0,0,0,0,"), "{line}");
        assert!(line.split(',').skip(9).all(str::is_empty), "{line}");
    }

    #[test]
    fn risk_coverage_is_under_its_names() {
        let mut report = ReportAccumulator::default();
        for (name, confidence, angle_deg) in [("a", 0.75, 1.0), ("b", 0.25, 90.0)] {
            let truth = test_fixtures::truth(angle_deg, 1.0, 0.9);
            report.add(&test_fixtures::with_confidence(name, confidence), &truth);
        }
        let value = fields(&report.finish(), 3);
        assert_eq!(value("metric"), "relief");
        assert_eq!(value("truth_confidence_n"), "2");
        assert_eq!(value("truth_confidence_failures_in_least_3"), "1");
        assert_eq!(value("truth_acc_at_100"), "0.5");
        assert_eq!(value("truth_acc_at_50"), "1");
        assert_eq!(value("truth_least_confidence_at_50"), "0.75");
        assert_eq!(value("acc_at_100"), "");
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
        let value = fields(&report.finish(), 0);
        assert_eq!(value("rules_double_read"), "3");
        assert_eq!(value("either_fails_n"), "3");
        assert_eq!(value("either_fails_acc"), (1.0 / 3.0).to_string());
        assert_eq!(value("adjudicated_n"), "2");
        assert_eq!(value("both_fail_acc"), (2.0 / 3.0).to_string());
        let low = wilson_95(2, 3).expect("three")[0];
        assert_eq!(value("both_fail_acc_ci95_low"), low.to_string());
        assert_eq!(value("failed_mirrored"), "1");
        assert_eq!(
            [value("failed_angle"), value("failed_no_reason")],
            ["0", "0"]
        );
        assert!(value("threshold_median").starts_with("0.4577"));
    }

    #[test]
    fn formulas_are_disarmed_and_quotes_doubled() {
        assert_eq!(escape("=1+1"), "'=1+1");
        assert_eq!(escape("-id"), "'-id");
        assert_eq!(escape("a,\"b\"\n"), "\"a,\"\"b\"\"\n\"");
        assert_eq!(escape("ensemble"), "ensemble");
    }
}
