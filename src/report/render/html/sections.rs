//! The sections of the page.

use maud::{Markup, html};

use super::album::Album;
use super::markup::table;
use super::plots;
use crate::report::comparison::{Basis, Comparison};
use crate::report::model::{FailureGroup, Report};
use crate::report::number_format::NumberStyle::PValue;
use crate::report::number_format::{format_count, format_number};
use crate::report::render::comparison_tables::{
    comparison_sentences, comparisons, mean_intervals, score_comparisons,
};
use crate::report::render::report_tables as tables;
use crate::report::render::risk_coverage_tables::{full_tables, short_tables};
use crate::report::render::table::Table;
use crate::report::score_comparison::conclusions;

/// Longest error message that is shown in full, characters.
const MAX_ERROR_CHARS: usize = 600;

/// A section.
pub(super) struct Section {
    /// Its name in addresses.
    pub(super) id: &'static str,
    /// Its heading.
    pub(super) title: &'static str,
    /// Its content.
    pub(super) body: Markup,
}

/// Returns the sections that have content, in order.
pub(super) fn all(report: &Report, album: &Album) -> Vec<Section> {
    let section = |id, title, body| Section { id, title, body };
    let optional = |id, title, body: Option<Markup>| body.map(|body| section(id, title, body));
    let has_verdicts = report.has_verdicts();
    let sections = [
        Some(section("result", "Result", result(report))),
        optional("notes", "Notes", notes(report)),
        optional(
            "verdicts",
            "Verdicts",
            has_verdicts.then(|| verdicts(report)),
        ),
        optional("tests", "Methods compared", tests(report)),
        optional(
            "truth",
            "Against ground truth",
            report.has_truth().then(|| truth(report)),
        ),
        optional(
            "manual",
            "Against manual alignments",
            tables::manual_alignments(report).map(|found| table(&found)),
        ),
        optional(
            "coverage",
            "What the confidence is worth",
            confidence(report),
        ),
        optional(
            "thresholds",
            "Thresholds",
            tables::thresholds(report)
                .map(|found| html! { (plots::thresholds(report)) (table(&found)) }),
        ),
        optional(
            "times",
            "Computing times",
            tables::times(report).map(|found| html! { (plots::times(report)) (table(&found)) }),
        ),
        optional("failures", "Failed pairs", failures(report)),
        optional(
            "images",
            "Images",
            (!album.is_empty()).then(|| album.body()),
        ),
    ];
    sections.into_iter().flatten().collect()
}

fn tables_of(found: impl IntoIterator<Item = Table>) -> Markup {
    html! { @for found in found { (table(&found)) } }
}

fn result(report: &Report) -> Markup {
    html! {
        (table(&tables::scores(report)))
        (tables_of(mean_intervals(report)))
        @if report.has_verdicts() {
            (plots::accuracy(report, Basis::Verdicts))
        } @else {
            p { "Nobody has judged these results yet, so there is no Acc." }
        }
    }
}

fn notes(report: &Report) -> Option<Markup> {
    let warnings = &report.warnings;
    (!warnings.is_empty())
        .then(|| html! { ul.notes { @for warning in warnings { li { (warning) } } } })
}

fn verdicts(report: &Report) -> Markup {
    let more = [
        tables::rules(report),
        tables::fail_reasons(report),
        tables::attention_checks(report),
    ];
    html! { (table(&tables::verdicts(report))) (tables_of(more.into_iter().flatten())) }
}

fn truth(report: &Report) -> Markup {
    html! { (table(&tables::truth(report))) (plots::accuracy(report, Basis::Truth)) }
}

fn tests(report: &Report) -> Option<Markup> {
    let by_score = score_comparisons(report);
    let is_any = !report.comparisons.is_empty() || by_score.is_some();
    let sentences = report.comparisons.iter().zip(comparison_sentences(report));
    is_any.then(|| {
        html! {
            ul.conclusions { @for (found, sentence) in sentences { li { (sentence) (p_values(found)) } } }
            (tables_of(comparisons(report)))
            @if let Some(found) = by_score {
                h3 { "By score" }
                ul.conclusions { @for sentence in conclusions(&report.score_comparisons) { li { (sentence) } } }
                (table(&found))
            }
        }
    })
}

fn p_values(found: &Comparison) -> Markup {
    html! {
        @if let Some(p) = found.p_holm { " (p " (format_number(p, PValue)) " after Holm's correction)" }
    }
}

/// Returns the risk-coverage curves, a row a metric, with every number behind a fold; `None` without confidences.
fn confidence(report: &Report) -> Option<Markup> {
    let short = short_tables(report);
    (!short.is_empty()).then(|| {
        html! {
            (tables_of(short))
            details { summary { "With intervals" } (tables_of(full_tables(report))) }
        }
    })
}

fn failures(report: &Report) -> Option<Markup> {
    let groups = &report.failures;
    (!groups.is_empty()).then(|| html! { @for group in groups { (failure(group)) } })
}

fn failure(group: &FailureGroup) -> Markup {
    let more = group.count - group.pairs.len() as u64;
    html! {
        h3 { (group.class.name().replace('_', " ")) ": " (format_count(group.count)) }
        ul.failures {
            @for pair in &group.pairs {
                li { strong { (pair.id) } ", " (pair.stage) ": " (shortened(&pair.error)) }
            }
            @if more > 0 { li { "and " (format_count(more)) " more" } }
        }
    }
}

/// Returns an error message, shortened if it is very long.
fn shortened(error: &str) -> String {
    let mut chars = error.chars();
    let mut text: String = chars.by_ref().take(MAX_ERROR_CHARS).collect();
    if chars.next().is_some() {
        text.push('\u{2026}');
    }
    text
}
