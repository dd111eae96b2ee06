//! Snapshots of every report format. `INSTA_UPDATE=always cargo test` rewrites the snapshots.

use insta::assert_snapshot;

use super::{Cover, ReportFormat, agreement_text, page, render};
use crate::test_fixtures::long_sentences;
use crate::{Report, ReportAccumulator, test_fixtures};
use mocban_core::domain::{FailureClass, Verdict};
use mocban_results::gallery::{Gallery, GalleryGroup, GalleryReason};
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

/// Returns the sentences of a rendered report, a paragraph a line: in text the lines that are no rows, in LaTeX captions and
/// paragraphs, in HTML the text of elements and the descriptions of plots.
fn prose(report: &Report, format: ReportFormat) -> String {
    let text = match format {
        ReportFormat::Html => {
            let groups = GalleryReason::ALL.map(|reason| GalleryGroup {
                reason,
                total: 1,
                items: Vec::new(),
            });
            let gallery = Gallery {
                seed: 11,
                groups: groups.to_vec(),
            };
            let page = page(report, &gallery, &Cover::default());
            let (_, body) = page.split_once("<body>").expect("a body");
            let inline = body.replace("<code>", "").replace("</code>", "");
            let described = inline
                .replace("aria-label=\"", ">")
                .replace("\" viewBox", "<");
            let parts = described.split('>').map(|part| part.split('<').next());
            return parts.flatten().collect::<Vec<_>>().join("\n");
        }
        ReportFormat::Latex => {
            let text = render(report, format).replace("\\,\\%", " %");
            let is_prose =
                |line: &&str| line.contains("\\caption") || !line.starts_with(['%', '\\', ' ']);
            return text.lines().filter(is_prose).collect::<Vec<_>>().join("\n");
        }
        _ => render(report, format),
    };
    let is_prose = |line: &str| !line.trim_start_matches(['!', ' ']).contains("  ");
    let blocks = text.split("\n\n").map(|block| {
        let lines = block.lines().filter(|line| is_prose(line));
        lines.map(str::trim).collect::<Vec<_>>().join(" ")
    });
    blocks.collect::<Vec<_>>().join("\n").replace(" ! ", "\n")
}

#[test]
fn sentences_have_at_most_20_words() {
    let full = test_fixtures::full_report();
    let empty = ReportAccumulator::default().finish();
    for report in [empty, unjudged(), judged(), full] {
        for format in [ReportFormat::Text, ReportFormat::Html, ReportFormat::Latex] {
            let text = prose(&report, format);
            assert_eq!(long_sentences(&text), Vec::<String>::new(), "{format}");
            for known in &report.headline {
                let known = known.replace('`', "").replace(" %", "");
                let start: String = known.chars().take(20).collect();
                let text = text
                    .replace('`', "")
                    .replace('\u{202f}', " ")
                    .replace(" %", "");
                assert!(text.contains(&start), "{format}: {start}: {text}");
            }
        }
    }
    for agreement in [
        test_fixtures::agreement(584, 3),
        test_fixtures::agreement(28, 1),
    ] {
        let text = agreement_text(&agreement);
        let captions = text.lines().filter(|line| !line.contains("  "));
        let captions = captions.collect::<Vec<_>>().join(" ");
        assert_eq!(long_sentences(&captions), Vec::<String>::new());
    }
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
