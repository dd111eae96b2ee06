//! What happened to a pair, in order of time: its stages, its verdicts and its manual alignments.

use maud::{Markup, html};

use super::components::{score, stored_message};
use super::remedies::failed_part;
use super::visit::Visit;
use mocban_catalog::{AttemptRecord, PairAttributes, VerdictEvent};
use mocban_core::domain::{UnixMillis, one_line};
use mocban_project::details::{ManualResult, PairOverview};

/// Most events that are shown.
const SHOWN_EVENTS: usize = 50;

/// Returns the newest events, oldest first.
pub(super) fn history(visit: &Visit, overview: &PairOverview) -> Markup {
    let detail = &overview.detail;
    let attributes = &detail.results.attributes;
    let attempts = detail.attempts.iter();
    let attempts = attempts.map(|attempt| (attempt.at, attempt_line(visit, attributes, attempt)));
    let verdicts = detail.verdict_log.iter();
    let verdicts = verdicts.map(|event| (event.at, verdict_line(visit, event)));
    let manual = overview.manual.iter();
    let manual = manual.map(|made| (made.stored.at, manual_line(visit, made)));
    let mut events: Vec<(UnixMillis, Markup)> = attempts.chain(verdicts).chain(manual).collect();
    events.sort_by_key(|(at, _)| *at);
    let hidden = events.len().saturating_sub(SHOWN_EVENTS);
    html! {
        section {
            details {
                summary { h2 { (visit.t("History", "Lịch sử")) } }
                ul.history { @for (_, line) in events.iter().skip(hidden) { (line) } }
            }
        }
    }
}

fn attempt_line(visit: &Visit, pair: &PairAttributes, attempt: &AttemptRecord) -> Markup {
    let failure = attempt.failure.as_ref();
    let part = failure.map_or_else(
        || visit.stage(attempt.stage),
        |failure| failed_part(visit, pair, attempt.stage, &failure.message),
    );
    html! {
        li {
            (visit.time(attempt.at)) " · " (part) " · "
            @match &attempt.failure {
                Some(failure) => span.bad { (visit.class(failure.class)) ": " (stored_message(visit, &failure.message)) },
                None => { (visit.t("done", "xong")) @if let Some(ms) = attempt.ms { " (" (visit.duration(ms)) ")" } }
            }
        }
    }
}

/// Returns a line of the verdict log.
pub(super) fn verdict_line(visit: &Visit, event: &VerdictEvent) -> Markup {
    html! {
        li {
            (visit.time(event.at)) " · " (one_line(&event.reviewer)) " · " (visit.verdict(event.verdict))
            @if let Some(reason) = event.reason { ": " (visit.reason(reason)) }
            " (" (visit.metric(event.metric)) ")"
            @if event.undone_at.is_some() { " · " (visit.t("taken back", "đã rút lại")) }
            (note(visit, event.note.as_deref()))
        }
    }
}

fn manual_line(visit: &Visit, manual: &ManualResult) -> Markup {
    let made = &manual.stored.made;
    html! {
        li {
            (visit.time(manual.stored.at)) " · " (one_line(&made.reviewer)) " · " (visit.t("aligned by hand", "căn chỉnh thủ công"))
            " (IoU " (score(visit, Some(made.iou)))
            @if let Some(adjustment) = &manual.adjustment {
                "; " (visit.metric(adjustment.from)) ": " (score(visit, Some(adjustment.from_iou)))
            }
            ")"
            @if !manual.stored.holds { " · " (visit.t("of other files than now", "của các tệp khác hiện nay")) }
            (note(visit, made.note.as_deref()))
        }
    }
}

fn note(visit: &Visit, note: Option<&str>) -> Markup {
    html! { @if let Some(note) = note { " · " (visit.t("note", "ghi chú")) ": " q { (one_line(note)) } } }
}
