//! The sections of the page.

use maud::{Markup, html};

use super::album::Album;
use super::markup::table;
use super::plots;
use crate::domain::one_line;
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
pub(super) fn all(report: &Report, album: &Album<'_>) -> Vec<Section> {
    let manual_alignments = tables::manual_alignments(report);
    let thresholds = tables::thresholds(report);
    let times = tables::times(report);
    let sections = [
        ("result", "Result", Some(result(report))),
        ("notes", "Notes", notes(report)),
        (
            "verdicts",
            "Verdicts",
            report.has_verdicts().then(|| verdicts(report)),
        ),
        ("tests", "Methods compared", tests(report)),
        (
            "truth",
            "Against ground truth",
            report.has_truth().then(|| truth(report)),
        ),
        (
            "manual",
            "Against manual alignments",
            manual_alignments.map(|found| table(&found)),
        ),
        (
            "coverage",
            "What the confidence is worth",
            confidence(report),
        ),
        (
            "thresholds",
            "Thresholds",
            thresholds.map(|found| html! { (plots::thresholds(report)) (table(&found)) }),
        ),
        (
            "times",
            "Computing times",
            times.map(|found| html! { (plots::times(report)) (table(&found)) }),
        ),
        ("failures", "Failed pairs", failures(report)),
        ("images", "Images", album.body()),
    ];
    let section = |(id, title, body): (_, _, Option<Markup>)| {
        Some(Section {
            id,
            title,
            body: body?,
        })
    };
    sections.into_iter().filter_map(section).collect()
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
    html! {
        (table(&tables::verdicts(report)))
        (tables_of(tables::rules(report)))
        (tables_of(tables::fail_reasons(report)))
        (tables_of(tables::attention_checks(report)))
    }
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

/// Returns the section on risk-coverage curves, whose full tables are collapsed. Returns `None` without curves.
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
                li { strong { (pair.id) } ", " (pair.stage) ": " (shortened(&one_line(&pair.error))) }
            }
            @if more > 0 { li { "and " (format_count(more)) " more" } }
        }
    }
}

/// Returns an error message, shortened if it is very long.
fn shortened(error: &str) -> String {
    match error.char_indices().nth(MAX_ERROR_CHARS) {
        Some((end, _)) => format!("{}\u{2026}", &error[..end]),
        None => error.to_owned(),
    }
}
