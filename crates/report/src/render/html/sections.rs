//! The sections of the page.

use maud::{Markup, html};

use super::album::Album;
use super::markup::{prose, sentence, table};
use super::plots;
use crate::comparison::Basis;
use crate::model::{FailureGroup, Report};
use crate::render::block_table::blocks;
use crate::render::comparison_tables::{
    comparison_sentences, comparisons, mean_intervals, score_comparisons,
};
use crate::render::provenance_lines::provenance_lines;
use crate::render::report_tables as tables;
use crate::render::risk_coverage_tables::{full_tables, short_tables};
use crate::render::table::Table;
use crate::score_comparison::conclusions;
use mocban_core::domain::one_line;
use mocban_results::number_format::format_count;

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

/// Returns the sections that have content, in order: pictures come before tables.
pub(super) fn all(report: &Report, album: &Album<'_>) -> Vec<Section> {
    let manual = tables::manual_alignments(report);
    let thresholds = tables::thresholds(report);
    let times = tables::times(report);
    let with_plot =
        |plot: Markup, found: Option<Table>| found.map(|found| html! { (plot) (table(&found)) });
    let sections = [
        ("overview", "Overview", overview(report)),
        ("notes", "Notes", notes(report)),
        ("images", "Images", album.body()),
        ("result", "Scores", Some(result(report))),
        ("verdicts", "Verdicts", verdicts(report)),
        ("tests", "Methods compared", tests(report)),
        ("truth", "Against ground truth", truth(report)),
        (
            "manual",
            "Against manual alignments",
            manual.map(|found| table(&found)),
        ),
        (
            "coverage",
            "What the confidence is worth",
            confidence(report),
        ),
        (
            "thresholds",
            "Thresholds",
            with_plot(plots::thresholds(report), thresholds),
        ),
        (
            "times",
            "Computing times",
            with_plot(plots::times(report), times),
        ),
        ("failures", "Failed pairs", failures(report)),
        ("provenance", "Provenance", Some(provenance(report))),
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

/// Returns the plots that show the answer, or `None` if there are none.
fn overview(report: &Report) -> Option<Markup> {
    let plots: Vec<Markup> = (Basis::ALL.into_iter())
        .flat_map(|basis| {
            [
                plots::accuracy(report, basis),
                plots::risk_coverage(report, basis),
            ]
        })
        .filter(|plot| !plot.0.is_empty())
        .collect();
    (!plots.is_empty()).then(|| html! { div.plots { @for plot in plots { (plot) } } })
}

fn tables_of(found: impl IntoIterator<Item = Table>) -> Markup {
    html! { @for found in found { (table(&found)) } }
}

fn result(report: &Report) -> Markup {
    html! { (table(&tables::scores(report))) (tables_of(mean_intervals(report))) }
}

fn notes(report: &Report) -> Option<Markup> {
    let warnings = &report.warnings;
    (!warnings.is_empty())
        .then(|| html! { ul.notes { @for warning in warnings { li { (sentence(warning)) } } } })
}

fn verdicts(report: &Report) -> Option<Markup> {
    report.has_verdicts().then(|| {
        html! {
            (table(&tables::verdicts(report)))
            (tables_of(tables::rules(report)))
            (tables_of(tables::fail_reasons(report)))
            (tables_of(tables::attention_checks(report)))
        }
    })
}

fn truth(report: &Report) -> Option<Markup> {
    let of_blocks = blocks(report);
    let pairs = report.has_truth().then(|| tables::truth(report));
    let is_any = pairs.is_some() || of_blocks.is_some();
    is_any.then(|| tables_of(pairs.into_iter().chain(of_blocks)))
}

fn tests(report: &Report) -> Option<Markup> {
    let by_score = score_comparisons(report);
    let is_any = !report.comparisons.is_empty() || by_score.is_some();
    is_any.then(|| {
        html! {
            ul.conclusions { @for text in comparison_sentences(report) { li { (prose(&text)) } } }
            (tables_of(comparisons(report)))
            @if let Some(found) = by_score {
                h3 { "By score" }
                ul.conclusions { @for text in conclusions(&report.score_comparisons) { li { (text) } } }
                (table(&found))
            }
        }
    })
}

/// Returns the list of what the numbers were computed from.
fn provenance(report: &Report) -> Markup {
    html! {
        dl.provenance {
            @for (what, text) in provenance_lines(report) { dt { (what) } dd { (text) } }
        }
        p { "Hashes are the first 12 digits. The report as JSON has them whole, and all digits of every number." }
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
