//! The formats of a report.

mod agreement_text;
mod block_table;
mod code_spans;
mod comparison_tables;
mod csv;
mod earlier_report;
mod file_checksum;
mod html;
mod latex;
mod latex_text;
mod markdown;
mod provenance_lines;
mod report_tables;
mod risk_coverage_tables;
#[cfg(test)]
mod snapshot_tests;
mod table;
mod text;

use super::model::Report;
use mocban_core::domain::{enum_names, visible, visible_json};
use mocban_results::gallery::Gallery;

pub use agreement_text::agreement_text;
pub use earlier_report::{is_continued, is_report};
pub use file_checksum::{is_changed, with_checksum};
pub use html::{Cover, MAX_PAGE_BYTES, RESERVED_BYTES, page};
pub use text::summary;

/// A format of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportFormat {
    /// Aligned tables for a terminal of 80 columns.
    Text,
    /// The whole report, numbers with all digits.
    Json,
    /// One line per metric, numbers with all digits (RFC 4180).
    Csv,
    /// Tables of GitHub's dialect.
    Markdown,
    /// Tables with `booktabs` and `siunitx`.
    Latex,
    /// One HTML page that includes its images and needs no script or other file.
    Html,
}

enum_names! {
    pub ReportFormat, "a report format":
    Text = "text", Json = "json", Csv = "csv", Markdown = "markdown", Latex = "latex", Html = "html",
}

/// Returns the report in a format, with a newline at the end. Hidden characters of names and messages become visible.
/// For an HTML page with images, use [`page`].
pub fn render(report: &Report, format: ReportFormat) -> String {
    let text = match format {
        ReportFormat::Text => text::render(report),
        ReportFormat::Json => return visible_json(&json(report)).into_owned(),
        ReportFormat::Csv => csv::render(report),
        ReportFormat::Markdown => markdown::render(report),
        ReportFormat::Latex => latex::render(report),
        ReportFormat::Html => page(report, &Gallery::default(), &Cover::default()),
    };
    visible(&text).into_owned()
}

/// Returns the report as indented JSON.
fn json(report: &Report) -> String {
    let mut text = serde_json::to_string_pretty(report)
        .expect("a report holds only strings, finite numbers, lists and fields");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::{ReportFormat, render};
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_core::domain::Verdict;
    use mocban_results::{IntervalMethod, TruthEvaluation};
    use serde_json::{Value, json};

    #[test]
    fn every_format_is_found_by_its_name() {
        for format in ReportFormat::ALL {
            assert_eq!(format.name().parse(), Ok(format));
        }
        assert!("pdf".parse::<ReportFormat>().is_err());
    }

    #[test]
    fn json_has_the_fixed_names_and_nulls_without_verdicts() {
        let mut report = ReportAccumulator::default();
        report.add(
            &test_fixtures::done("a", 0.75, &[]),
            &TruthEvaluation::default(),
        );
        let text = render(&report.finish(), ReportFormat::Json);
        let value: Value = serde_json::from_str(&text).expect("the report is JSON");
        assert_eq!((&value["schema"], &value["pairs"]), (&json!(1), &json!(1)));
        let metrics: Vec<_> = value["rows"].as_array().expect("rows").iter().collect();
        let names = ["nl_ssim", "density", "ensemble", "relief"];
        assert_eq!(metrics.len(), names.len());
        for (row, metric) in metrics.iter().zip(names) {
            assert_eq!(row["metric"], metric);
            assert_eq!(
                (&row["n"], &row["judged"], &row["passed"]),
                (&json!(1), &json!(0), &json!(0))
            );
            assert_eq!(
                (&row["acc"], &row["acc_ci95"]),
                (&Value::Null, &Value::Null)
            );
            assert_eq!(
                (&row["ssim"], &row["iou"], &row["iou_box"]),
                (&json!(0.81), &json!(0.75), &json!(0.9))
            );
            assert!(row["dice"].is_f64());
            assert!(row.get("truth").is_none());
        }
        assert_eq!(value["comparisons"], json!([]));
    }

    #[test]
    fn every_format_names_the_interval_that_was_asked_for() {
        let mut report = ReportAccumulator::default();
        for (name, verdict) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.75, &[verdict]);
            report.add(&pair, &test_fixtures::truth(1.0, 2.0, 0.9));
        }
        let report = report.finish().with_interval(IntervalMethod::Exact);
        let row = &report.rows[0];
        assert_eq!(row.acc_ci95, IntervalMethod::Exact.interval_95(1, 2));
        let truth = row.truth.as_ref().expect("both have truth");
        assert_eq!(truth.acc_ci95, IntervalMethod::Exact.interval_95(2, 2));
        let rules = row.rules.expect("both are judged");
        assert_eq!(
            rules.adjudicated.ci95,
            IntervalMethod::Exact.interval_95(1, 2)
        );
        // The CSV has one column for each number and none for the method.
        let formats = ReportFormat::ALL.into_iter();
        for format in formats.filter(|format| *format != ReportFormat::Csv) {
            let text = render(&report, format);
            let names = [
                "95 % exact",
                r"95\,\% exact",
                "95\u{202f}% exact",
                r#""interval": "exact""#,
            ];
            assert!(names.iter().any(|name| text.contains(name)), "{text}");
            assert!(!text.to_lowercase().contains("wilson"), "{text}");
        }
    }

    #[test]
    fn every_format_for_people_opens_with_the_answer_and_ends_with_its_origin() {
        let report = test_fixtures::full_report();
        for (format, table, end) in [
            (ReportFormat::Text, "Method  ", "Program "),
            (ReportFormat::Markdown, "| Method", "- Program:"),
            (ReportFormat::Latex, "\\begin{table}", "Program &"),
            (ReportFormat::Html, "<table", "<dt>Program"),
        ] {
            let text = render(&report, format);
            let at = |part: &str| {
                text.find(part)
                    .unwrap_or_else(|| panic!("{format}: {part}"))
            };
            let answers = [
                "36 of 38 pairs",
                "Acc of Ensemble",
                "By verdicts, no two metrics",
            ];
            let [first, second, third] = answers.map(at);
            assert!(
                first < second && second < third && third < at(table),
                "{format}"
            );
            assert!(
                text.rfind("36 aligned pairs") > text.rfind("McNemar"),
                "{format}"
            );
            assert!(at(end) > at("McNemar"), "{format}");
        }
    }

    #[test]
    fn json_truth_has_the_fixed_names() {
        let mut report = ReportAccumulator::default();
        report.add(
            &test_fixtures::done("a", 0.75, &[]),
            &test_fixtures::truth(1.0, 2.0, 0.9),
        );
        let text = render(&report.finish(), ReportFormat::Json);
        let value: Value = serde_json::from_str(&text).expect("the report is JSON");
        let truth = &value["rows"][2]["truth"];
        let expected = json!({
            "n": 1, "acc": 1.0, "angle_le_5deg": 1.0, "angle_median_deg": 1.0,
            "tre_median_pct": 2.0, "mask_iou_median": 0.9,
        });
        for (name, wanted) in expected.as_object().expect("an object") {
            assert_eq!(&truth[name], wanted, "{name}");
        }
    }

    #[test]
    fn one_verdict_compares_no_metrics_and_every_row_says_how_many_were_judged() {
        let mut report = ReportAccumulator::default();
        for i in 0..60 {
            let verdicts: &[Verdict] = if i == 0 { &[Verdict::Fail] } else { &[] };
            let pair = test_fixtures::done(&format!("p{i:02}"), 0.75, verdicts);
            report.add(&pair, &TruthEvaluation::default());
        }
        let report = report.finish();
        assert_eq!(report.comparisons, []);
        for (format, row) in [
            (ReportFormat::Text, "Ensemble 60 1 0.0 "),
            (ReportFormat::Markdown, "| Ensemble | 60 | 1 | 0.0 |"),
            (ReportFormat::Latex, "Ensemble & 60 & 1 & 0.0 &"),
            (
                ReportFormat::Html,
                "<th scope=\"row\">Ensemble</th><td class=\"number\">60</td><td class=\"number\">1</td>\
                 <td class=\"number\">0.0</td>",
            ),
        ] {
            let text = render(&report, format);
            let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
            let why =
                "Metrics are not compared, because fewer than 6 pairs are judged for two of them";
            assert!(words.contains(why), "{format}: {words}");
            assert!(words.contains(row), "{format}: {words}");
            // Two metrics that are wrong about the only judged pair are not said to be alike or right.
            for untrue in ["By verdicts,", "metrics are right", "no two metrics differ"] {
                assert!(!words.contains(untrue), "{format}: {words}");
            }
        }
    }
}
