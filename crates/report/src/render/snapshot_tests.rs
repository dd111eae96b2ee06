//! Snapshots of every report format. `INSTA_UPDATE=always cargo test` rewrites the snapshots.

use insta::assert_snapshot;

use super::{ReportFormat, agreement_text, render};
use crate::{Report, ReportAccumulator, test_fixtures};
use mocban_core::domain::{FailureClass, Verdict};
use mocban_results::{IntervalMethod, TruthEvaluation};

/// Two results without verdicts or ground truth.
fn unjudged() -> Report {
    let mut report = ReportAccumulator::default();
    for name in ["a", "b"] {
        let pair = test_fixtures::done(name, 0.75, &[]);
        report.add(&pair, &TruthEvaluation::default());
    }
    report.finish()
}

/// Returns a report on a failed pair and three results. Two results have verdicts, and one has ground truth.
fn judged() -> Report {
    let mut report = ReportAccumulator::default();
    let none = TruthEvaluation::default();
    report.add(&test_fixtures::done("a", 0.75, &[Verdict::Pass]), &none);
    report.add(&test_fixtures::done("b", 0.75, &[Verdict::Fail]), &none);
    report.add(
        &test_fixtures::done("c", 0.75, &[]),
        &test_fixtures::truth(0.5, 2.0, 0.9),
    );
    let message = "d.stl is empty: 50 % of x_1 & <b>";
    let failed = test_fixtures::failed("d", FailureClass::BadInput, message);
    report.add(&failed, &none);
    report.finish()
}

/// The page without its style sheet.
fn html(report: &Report) -> String {
    let page = render(report, ReportFormat::Html);
    let (before, rest) = page.split_once("<style>").expect("a style sheet");
    let (_, after) = rest.split_once("</style>").expect("its end");
    format!("{before}{after}").replace("><", ">\n<")
}

#[test]
fn empty_project() {
    let report = ReportAccumulator::default().finish();
    assert_snapshot!("empty_text", render(&report, ReportFormat::Text));
    assert_snapshot!("empty_json", render(&report, ReportFormat::Json));
    assert_snapshot!("empty_markdown", render(&report, ReportFormat::Markdown));
}

#[test]
fn unjudged_results() {
    let report = unjudged();
    assert_snapshot!("unjudged_text", render(&report, ReportFormat::Text));
    assert_snapshot!("unjudged_markdown", render(&report, ReportFormat::Markdown));
    assert_snapshot!("unjudged_latex", render(&report, ReportFormat::Latex));
    assert_snapshot!("unjudged_csv", render(&report, ReportFormat::Csv));
}

#[test]
fn judged_results() {
    let report = judged();
    assert_snapshot!("judged_text", render(&report, ReportFormat::Text));
    assert_snapshot!("judged_markdown", render(&report, ReportFormat::Markdown));
    assert_snapshot!("judged_latex", render(&report, ReportFormat::Latex));
    assert_snapshot!("judged_csv", render(&report, ReportFormat::Csv));
    assert_snapshot!("judged_json", render(&report, ReportFormat::Json));
    assert_snapshot!("judged_html", html(&report));
}

#[test]
fn everything_in_a_report() {
    let report = test_fixtures::full_report();
    assert_snapshot!("full_text", render(&report, ReportFormat::Text));
    assert_snapshot!("full_markdown", render(&report, ReportFormat::Markdown));
    assert_snapshot!("full_latex", render(&report, ReportFormat::Latex));
    assert_snapshot!("full_csv", render(&report, ReportFormat::Csv));
    assert_snapshot!("full_json", render(&report, ReportFormat::Json));
    assert_snapshot!("full_html", html(&report));
    let exact = report.with_interval(IntervalMethod::Exact).without_times();
    assert_snapshot!("full_exact_text", render(&exact, ReportFormat::Text));
}

#[test]
fn agreement_of_reviewers() {
    assert_snapshot!(
        "agreement_rare_failures",
        agreement_text(&test_fixtures::agreement(584, 3))
    );
    assert_snapshot!(
        "agreement_few_results",
        agreement_text(&test_fixtures::agreement(28, 1))
    );
}
