//! The sections of the page, those that have something to tell.

use maud::{Markup, html};

use super::album::Album;
use super::markup::table;
use super::plots;
use crate::report::model::{Basis, Comparison, FailureGroup, Report};
use crate::report::render::table::{self as tables, basis, comparisons, p_value, title};
use crate::report::render::{coverage_tables, failed, scored, work};
use crate::report::score_comparison::in_words;

/// Longest error that is told in full, letters.
const LONGEST_ERROR: usize = 600;

/// A section.
pub(super) struct Section {
    /// Its name in addresses.
    pub(super) id: &'static str,
    /// Its head.
    pub(super) title: &'static str,
    /// What it tells.
    pub(super) body: Markup,
}

/// Every section that has something to tell, in order.
pub(super) fn all(report: &Report, album: &Album) -> Vec<Section> {
    let pictures = (!album.is_empty()).then(|| section("pictures", "Pictures", album.body()));
    let is_compared = !report.comparisons.is_empty() || scored::comparisons(report).is_some();
    let sections = [
        Some(section("result", "Result", result(report))),
        (!report.warnings.is_empty()).then(|| section("notes", "To be known", warnings(report))),
        report
            .anybody_read()
            .then(|| section("reviewers", "What reviewers said", reviewers(report))),
        is_compared.then(|| section("tests", "Methods compared", tests(report))),
        report
            .has_truth()
            .then(|| section("truth", "Against the truth", truth(report))),
        tables::by_hand(report)
            .map(|found| section("by-hand", "Against alignments by hand", table(&found))),
        confidence(report),
        work::thresholds(report).map(|found| {
            let body = html! { (plots::thresholds(report)) (table(&found)) };
            section("thresholds", "Where the relief is cut", body)
        }),
        work::times(report).map(|found| {
            let body = html! { (plots::times(report)) (table(&found)) };
            section("times", "Computing time", body)
        }),
        (!report.failures.is_empty())
            .then(|| section("failures", "Pairs without a result", failures(report))),
        pictures,
    ];
    sections.into_iter().flatten().collect()
}

const fn section(id: &'static str, title: &'static str, body: Markup) -> Section {
    Section { id, title, body }
}

/// Accuracy against coverage, a line a method, with every number behind a fold; none without confidences.
fn confidence(report: &Report) -> Option<Section> {
    let (short, full) = (
        coverage_tables::short(report),
        coverage_tables::full(report),
    );
    let body = html! {
        @for found in &short { (table(found)) }
        details { summary { "With intervals" } @for found in &full { (table(found)) } }
    };
    (!short.is_empty()).then(|| section("coverage", "What the confidence is worth", body))
}

fn result(report: &Report) -> Markup {
    html! {
        (table(&tables::scores(report)))
        @if let Some(found) = scored::intervals(report) { (table(&found)) }
        @if report.anybody_read() {
            (plots::accuracy(report, Basis::Verdicts))
        } @else {
            p { "Nobody has read these results yet, so there is no Acc." }
        }
    }
}

fn warnings(report: &Report) -> Markup {
    html! { ul.notes { @for warning in &report.warnings { li { (warning) } } } }
}

fn reviewers(report: &Report) -> Markup {
    let more = [
        tables::rules(report),
        failed::reasons(report),
        failed::caught(report),
    ];
    html! {
        (table(&tables::verdicts(report)))
        @for found in more.into_iter().flatten() { (table(&found)) }
    }
}

fn truth(report: &Report) -> Markup {
    html! { (table(&tables::truth(report))) (plots::accuracy(report, Basis::Truth)) }
}

fn tests(report: &Report) -> Markup {
    html! {
        ul.words { @for found in &report.comparisons { li { (sentence(found)) } } }
        @if let Some(found) = comparisons(report) { (table(&found)) }
        @if let Some(found) = scored::comparisons(report) {
            h3 { "By their scores" }
            ul.words { @for words in in_words(&report.score_comparisons) { li { (words) "." } } }
            (table(&found))
        }
    }
}

/// A comparison as a sentence.
fn sentence(found: &Comparison) -> Markup {
    html! {
        strong { (title(found)) } ", by " (basis(found.basis)) ": " (found.words)
        @if let Some(p) = found.p_holm { " (p " (p_value(p)) " after Holm)" }
        "."
    }
}

fn failures(report: &Report) -> Markup {
    html! { @for group in &report.failures { (failure(group)) } }
}

fn failure(group: &FailureGroup) -> Markup {
    let more = group.count - group.pairs.len() as u64;
    html! {
        h3 { (group.class.name().replace('_', " ")) ": " (group.count) }
        ul.failures {
            @for pair in &group.pairs {
                li { strong { (pair.id) } ", " (pair.stage) ": " (cut(&pair.error)) }
            }
            @if more > 0 { li { "and " (more) " more" } }
        }
    }
}

/// An error, shortened where it is very long.
fn cut(error: &str) -> String {
    let mut letters = error.chars();
    let mut text: String = letters.by_ref().take(LONGEST_ERROR).collect();
    if letters.next().is_some() {
        text.push('\u{2026}');
    }
    text
}
