//! The list of pairs of a project, as a gallery or a table.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::{IntoResponse as _, Redirect, Response};
use maud::{Markup, html};

use super::address::{PageQuery, encoded};
use super::choice_bar::{choice_bar, choice_box};
use super::chosen_pairs::{done_notice, metric_is_lacking, without_done};
use super::components::{NavSection, difference, empty, frame, grouped, score, stored_message};
use super::failure::AppResult;
use super::pair_filter_form::filter_form;
use super::pair_query::{PairQuery, cursor_text};
use super::projects::OpenProject;
use super::retired_pairs::retired_list;
use super::state::AppState;
use super::view_bar::view_bar;
use super::visit::Visit;
use mocban_catalog::{PairListPage, PairResults};
use mocban_core::domain::{MetricOutcome, PairName, ThresholdMetric, Verdict, one_line, sanitize};

/// Columns of the table that hold scores.
const NUMBER_COLUMNS: std::ops::Range<usize> = 4..8;
/// Most blocks that the filter suggests.
const SUGGESTED_BLOCKS: usize = 200;
/// Most reviewers of a verdict that a card names.
const NAMED_REVIEWERS: usize = 3;
/// Longest name of a reviewer on a card, in characters.
const NAME_CHARS: usize = 24;
/// Most ids that are suggested for one that does not exist.
const SUGGESTED_IDS: usize = 20;
/// Name of the sentence that an id does not exist.
const NO_SUCH_ID: &str = "no-such-id";

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    mut visit: Visit,
) -> AppResult<Response> {
    let open = state.open(&key).await?;
    let done = done_notice(&visit, &open).await?;
    let after = visit.query.get("after").unwrap_or_default().to_owned();
    visit.query = without_done(&visit.query).with("after", &after);
    if let Some(typed) = visit.query.get("id") {
        return jump(&visit, &open, typed.trim()).await;
    }
    let query = PairQuery::of(&visit.query);
    let title = visit.t("Pairs", "Các cặp");
    let blocks = open.catalog.first_listed_blocks(SUGGESTED_BLOCKS).await?;
    let retired = open.catalog.retired_count().await?;
    let saved = view_bar(&visit, &open).await;
    if query.is_retired {
        let list = retired_list(&visit, &open, &query).await?;
        let body = html! {
            (done)
            (jump_form(&visit))
            (filter_form(&visit, &blocks, retired))
            (saved)
            (list)
        };
        return Ok(frame(&visit, title, Some(&key), NavSection::Pairs, &body).into_response());
    }
    let list = if query.lacks_compared {
        PairListPage {
            pairs: Vec::new(),
            next: None,
            scanned: None,
        }
    } else {
        let (filter, order, metric) = (&query.filter, query.order, query.metric);
        let list = open
            .catalog
            .pair_list(filter, order, metric, query.after, query.page_size());
        list.await?
    };
    let body = html! {
        (done)
        (jump_form(&visit))
        (filter_form(&visit, &blocks, retired))
        (saved)
        (views(&visit, &query))
        @if query.lacks_compared {
            p.notice role="alert" { (metric_is_lacking().text(visit.language)) }
        } @else if list.pairs.is_empty() && list.next.is_some() {
            p.notice { (visit.t("None of the pairs that were looked at so far matches.", "Chưa có cặp nào phù hợp trong số các cặp đã xem.")) }
        } @else if list.pairs.is_empty() {
            (empty(visit.t("No pair matches.", "Không có cặp nào phù hợp."), &html! {
                p { a.button href=(visit.here) { (visit.t("Show all pairs", "Hiện tất cả các cặp")) } }
            }))
        } @else if query.is_table {
            (table(&visit, &query, &list.pairs))
        } @else {
            div.gallery { @for pair in &list.pairs {
                div.pick-card {
                    (pair_card(&visit, &visit.project_page(&key, ""), pair, query.metric, &query.of_pair()))
                    (choice_box(&visit, pair))
                }
            } }
        }
        (pager(&visit, &query, &list))
        (choice_bar(&visit, &key))
    };
    Ok(frame(&visit, title, Some(&key), NavSection::Pairs, &body).into_response())
}

/// Opens the page of a pair, which may be retired, or lists similar ids.
async fn jump(visit: &Visit, open: &OpenProject, typed: &str) -> AppResult<Response> {
    if let Ok(name) = typed.parse::<PairName>()
        && open
            .catalog
            .unknown_names(std::slice::from_ref(&name))
            .await?
            .is_empty()
    {
        let page = format!("pair/{}/", encoded(name.as_str()));
        return Ok(Redirect::to(&page).into_response());
    }
    let similar = open
        .catalog
        .pair_names_with_prefix(typed, SUGGESTED_IDS)
        .await?;
    let body = html! {
        (jump_form(visit))
        p.notice id=(NO_SUCH_ID) role="alert" { (visit.t("There is no pair with this id: ", "Không có cặp nào có mã này: ")) b { (one_line(typed)) } }
        @if !similar.is_empty() {
            p { (visit.t("Ids that begin like this:", "Các mã bắt đầu như vậy:")) }
            ul { @for name in &similar {
                li { a href={ "pair/" (encoded(name.as_str())) "/" } { (name) } }
            } }
        }
        p { a.button href=(visit.here) { (visit.t("Show all pairs", "Hiện tất cả các cặp")) } }
    };
    let title = visit.t("Pairs", "Các cặp");
    Ok(frame(visit, title, Some(&open.key), NavSection::Pairs, &body).into_response())
}

/// Returns the form that opens the page of a pair. An id that does not exist stays in it, to be corrected.
fn jump_form(visit: &Visit) -> Markup {
    let unknown = visit.query.get("id");
    let why = unknown.map(|_| NO_SUCH_ID);
    html! {
        form.inline method="get" action=(visit.here) role="search" {
            label for="jump-id" { (visit.t("Go to id", "Đến mã")) }
            input #jump-id name="id" value=[unknown] autofocus[why.is_some()] aria-describedby=[why] autocomplete="off" required;
            button { (visit.t("Go", "Đến")) }
        }
    }
}

/// Returns the links to the gallery and the table of the same list.
fn views(visit: &Visit, query: &PairQuery) -> Markup {
    let link = |view: &str, is_shown: bool, text: &str| {
        let target = visit.query.with("view", view).with("after", "");
        html! {
            a href={ (visit.here) (target.text()) } aria-current=[is_shown.then_some("true")] { (text) }
        }
    };
    html! {
        p.views {
            (link("", !query.is_table, visit.t("Gallery", "Hình ảnh"))) " "
            (link("table", query.is_table, visit.t("Table", "Bảng")))
        }
    }
}

/// Returns the card of a pair. `base` is the relative address of its project, `shown` the query of its page.
pub(super) fn pair_card(
    visit: &Visit,
    base: &str,
    pair: &PairResults,
    metric: ThresholdMetric,
    shown: &PageQuery,
) -> Markup {
    let name = pair.attributes.name.as_str();
    let path = format!("{base}pair/{}/", encoded(name));
    let outcome = pair.metric(metric).map(|record| &record.outcome);
    let is_low = outcome.is_some_and(MetricOutcome::is_low_confidence);
    html! {
        a.pair-card href={ (path) (shown.text()) } {
            img src={ (path) "picture/thumb-" (metric) } alt="" loading="lazy" width="180" height="180";
            span.name title=(one_line(name)) { (one_line(name)) @if let Some(character) = &pair.attributes.character { " " span.character { (one_line(character)) } } }
            @match outcome {
                Some(outcome) => span.muted.warn[is_low] {
                    (visit.t("confidence", "độ tin cậy")) " " (score(visit, outcome.confidence))
                },
                None => span.state.(pair.status.name()) { (visit.status(pair.status)) },
            }
            (verdict_marks(visit, pair, metric))
        }
    }
}

/// Returns the verdicts on the result of a metric: each once, with its reviewers if there are several.
fn verdict_marks(visit: &Visit, pair: &PairResults, metric: ThresholdMetric) -> Markup {
    let verdicts = pair
        .metric(metric)
        .map_or(&[][..], |record| &record.verdicts);
    let given = Verdict::ALL.map(|verdict| {
        let of_it = verdicts.iter().filter(|given| given.verdict == verdict);
        let names = of_it.map(|given| sanitize(&given.reviewer, NAME_CHARS));
        (verdict, names.collect::<Vec<String>>())
    });
    let given: Vec<_> = given
        .iter()
        .filter(|(_, names)| !names.is_empty())
        .collect();
    html! {
        @if !given.is_empty() {
            span.verdicts { @for (index, (verdict, reviewers)) in given.iter().enumerate() {
                @if index > 0 { " · " }
                span.verdict.(verdict.name()) { (visit.verdict(*verdict)) }
                @if verdicts.len() > 1 { " (" (reviewers_text(reviewers)) ")" }
            } }
        }
    }
}

/// Returns the names of a few reviewers, or the number of many.
fn reviewers_text(reviewers: &[String]) -> String {
    match reviewers.len() {
        ..=NAMED_REVIEWERS => reviewers.join(", "),
        many => grouped(many as u64),
    }
}

fn table(visit: &Visit, query: &PairQuery, pairs: &[PairResults]) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(visit.t("Pairs", "Các cặp")) {
            table {
                thead { tr {
                    th scope="col" { span.visually-hidden { (visit.t("Choose", "Chọn")) } }
                    @for (index, title) in [
                        visit.t("Id", "Mã"), visit.t("Character", "Chữ"), visit.t("Block", "Ván"), visit.t("State", "Trạng thái"),
                        visit.t("Confidence", "Độ tin cậy"), "IoU", "SSIM", "Dice", visit.t("Verdict", "Đánh giá"),
                        visit.t("Why failed", "Lý do lỗi"),
                    ].into_iter().enumerate() { th.number[NUMBER_COLUMNS.contains(&index)] scope="col" { (title) } }
                    @if let Some(other) = query.compared {
                        th.number scope="col" { "IoU, " (visit.metric(other)) }
                        th.number scope="col" { (visit.t("Difference", "Chênh lệch")) }
                    }
                } }
                tbody { @for pair in pairs { (table_row(visit, query, pair)) } }
            }
        }
    }
}

fn table_row(visit: &Visit, query: &PairQuery, pair: &PairResults) -> Markup {
    let name = pair.attributes.name.as_str();
    let outcome = pair.metric(query.metric).map(|record| &record.outcome);
    let scores = outcome.map(|outcome| outcome.scores);
    let failure = pair.failure.as_ref().map(|stored| &stored.failure);
    html! {
        tr {
            td { (choice_box(visit, pair)) }
            th scope="row" { a href={ "pair/" (encoded(name)) "/" (query.of_pair().text()) } { (one_line(name)) } }
            td { (pair.attributes.character.as_deref().map(one_line).unwrap_or_default()) }
            td { (pair.attributes.block.as_deref().map(one_line).unwrap_or_default()) }
            td { span.state.(pair.status.name()) { (visit.status(pair.status)) } }
            td.number { (score(visit, outcome.and_then(|outcome| outcome.confidence))) }
            td.number { (score(visit, scores.map(|scores| scores.iou))) }
            td.number { (score(visit, scores.map(|scores| scores.ssim))) }
            td.number { (score(visit, scores.map(|scores| scores.dice))) }
            td { (verdict_marks(visit, pair, query.metric)) }
            td.reason { @if let Some(failure) = failure { (stored_message(visit, &failure.message)) } }
            @if let Some(other) = query.compared {
                @let iou = pair.metric(other).map(|record| record.outcome.scores.iou);
                td.number { (score(visit, iou)) }
                td.number { (difference(visit, scores.map(|scores| scores.iou), iou, 3)) }
            }
        }
    }
}

fn pager(visit: &Visit, query: &PairQuery, list: &PairListPage) -> Markup {
    let next = list
        .next
        .map(|next| visit.query.with("after", &cursor_text(next)));
    html! {
        @if let Some(scanned) = list.scanned {
            p.notice {
                (visit.t("Pairs looked at for this page", "Số cặp đã xem cho trang này")) ": " (grouped(scanned as u64)) ". "
                (visit.t("There may be more matches.", "Có thể còn cặp phù hợp."))
            }
        }
        nav.pager aria-label=(visit.t("Pages of the list", "Các trang của danh sách")) {
            @if query.after.is_some() {
                a.button href={ (visit.here) (visit.query.with("after", "").text()) } { (visit.t("First page", "Trang đầu")) } " "
            }
            @if let Some(next) = next {
                a.button rel="next" href={ (visit.here) (next.text()) } { (visit.t("Next page", "Trang sau")) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{jump_form, verdict_marks};
    use crate::app::address::PageQuery;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::{ThresholdMetric, Verdict};
    use mocban_results::test_fixtures;

    #[test]
    fn an_id_that_does_not_exist_stays_in_its_field() {
        for language in Language::ALL {
            let mut visit = Visit::in_language(language);
            let empty = jump_form(&visit).into_string();
            assert!(!empty.contains(" value=") && !empty.contains("autofocus"));
            visit.query = PageQuery::parse("id=b4%22");
            let typed = jump_form(&visit).into_string();
            let part = " value=\"b4&quot;\" autofocus aria-describedby=\"no-such-id\"";
            assert!(typed.contains(part), "{typed}");
        }
    }

    #[test]
    fn verdicts_of_several_reviewers_are_named_once_with_who_gave_them() {
        let marks = |language, verdicts: &[Verdict]| {
            let pair = test_fixtures::done("a", 0.5, verdicts);
            let visit = Visit::in_language(language);
            let marks = verdict_marks(&visit, &pair, ThresholdMetric::DEFAULT).into_string();
            let mut text = String::new();
            for part in marks.split('<').filter(|part| !part.is_empty()) {
                text.push_str(part.split_once('>').expect("a tag").1);
            }
            text
        };
        let both = [Verdict::Pass, Verdict::Fail, Verdict::Pass];
        for (language, verdicts, expected) in [
            (Language::English, &[][..], ""),
            (Language::English, &[Verdict::Fail], "failed"),
            (Language::English, &both, "passed (r0, r2) · failed (r1)"),
            (Language::Vietnamese, &both, "đạt (r0, r2) · không đạt (r1)"),
            (Language::Vietnamese, &[Verdict::Pass; 4], "đạt (4)"),
        ] {
            assert_eq!(marks(language, verdicts), expected);
        }
    }
}
