//! The reviewers of a project: how much each has judged, and how far they agree.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};

use super::address::PageQuery;
use super::components::{grouped, number_table, score};
use super::failure::AppResult;
use super::state::AppState;
use super::visit::Visit;
use mocban_core::domain::{ReviewOrder, ThresholdMetric, one_line};
use mocban_results::{
    Rate, ReviewerAgreement, ReviewerPair, ReviewerRecord, agreement_of_verdicts,
};

/// Responds with a part of the page of reviews. It reads all verdicts, so the page loads it afterwards.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let found = agreement_of_verdicts(&open.catalog).await?;
    Ok(Html(agreement_part(&visit, &found).into_string()))
}

fn agreement_part(visit: &Visit, found: &ReviewerAgreement) -> Markup {
    html! {
        h2 { (visit.t("Reviewers", "Người đánh giá")) }
        @if found.reviewers.is_empty() {
            p.muted { @if found.retired == 0 {
                (visit.t("Nobody has judged a result yet.", "Chưa ai đánh giá kết quả nào."))
            } @else {
                (visit.t(
                    "Nobody has judged a result of a pair that counts; verdicts on retired pairs are kept.",
                    "Chưa ai đánh giá kết quả nào của các cặp được tính; đánh giá về các cặp đã đưa ra khỏi thống kê vẫn được giữ.",
                ))
            } }
        } @else {
            (reviewer_table(visit, &found.reviewers))
            h2 { (visit.t("Agreement", "Mức độ thống nhất")) }
            @if found.reviewer_pairs.is_empty() {
                p.muted { (visit.t(
                    "No two reviewers have judged the same result yet. A second person who starts with the same choices gets the same results.",
                    "Chưa có hai người nào đánh giá cùng một kết quả. Người thứ hai bắt đầu với cùng các lựa chọn sẽ nhận cùng các kết quả.",
                )) }
            } @else {
                (pair_table(visit, &found.reviewer_pairs))
            }
            @if found.conflicts > 0 {
                p.notice { b { (grouped(found.conflicts)) } " " (visit.form(
                    found.conflicts,
                    [
                        "result on which reviewers disagree waits for a third person: choose the order \"disagreements of two others\".",
                        "results on which reviewers disagree wait for a third person: choose the order \"disagreements of two others\".",
                    ],
                    "kết quả có bất đồng đang chờ người thứ ba: hãy chọn thứ tự \"chỗ hai người khác bất đồng\".",
                )) }
                (conflicts_by_metric(visit, &found.conflicts_by_metric))
            }
        }
    }
}

/// Links the conflicts of each metric to the form that settles them.
fn conflicts_by_metric(visit: &Visit, conflicts: &BTreeMap<ThresholdMetric, u64>) -> Markup {
    let settle = PageQuery::default().with("order", ReviewOrder::Adjudicate.name());
    html! {
        ul #conflicts-by-metric { @for (metric, number) in conflicts {
            li {
                a href={ "review" (settle.with("metric", metric.name()).text()) } { (visit.metric(*metric)) }
                ": " (grouped(*number))
            }
        } }
        @if conflicts.len() > 1 {
            p.muted { (visit.t(
                "Metrics that gave the same image count once in the sum. An answer settles only the chosen metric, so such an image still waits for the others. With \"all metrics\", one answer settles all that gave this image.",
                "Các độ đo cho cùng một hình chỉ được tính một lần trong tổng. Câu trả lời chỉ quyết định cho độ đo đã chọn, nên hình đó vẫn chờ ở các độ đo khác. Với \"mọi độ đo\", một câu trả lời quyết định cho mọi độ đo cho hình đó.",
            )) }
        }
    }
}

fn reviewer_table(visit: &Visit, reviewers: &[ReviewerRecord]) -> Markup {
    let titles = [
        visit.t("Name", "Tên"),
        visit.t("results judged", "kết quả đã đánh giá"),
        visit.t("planted errors caught", "lỗi cài sẵn được phát hiện"),
        visit.t(
            "same answer when shown twice",
            "trả lời giống nhau khi xem lại",
        ),
    ];
    let rows = html! {
        @for record in reviewers {
            tr {
                th scope="row" { (one_line(&record.reviewer)) }
                td.number { (grouped(record.judged)) }
                td.number { (rate(record.attention_checks.all)) }
                td.number { (rate(record.duplicates)) }
            }
        }
    };
    number_table(visit.t("Reviewers", "Người đánh giá"), &titles, &rows)
}

fn pair_table(visit: &Visit, pairs: &[ReviewerPair]) -> Markup {
    let titles = [
        visit.t("Reviewers", "Người đánh giá"),
        visit.t("same results", "kết quả chung"),
        visit.t("agreed", "thống nhất"),
        "kappa",
        "AC1",
    ];
    let rows = html! {
        @for pair in pairs {
            @let agreement = &pair.agreement;
            @let value = |value: Option<f64>| score(visit, value.filter(|_| agreement.sufficient));
            tr {
                th scope="row" { (one_line(&pair.a)) ", " (one_line(&pair.b)) }
                td.number { (grouped(agreement.n)) }
                td.number { (grouped(agreement.agreed)) }
                td.number { (value(agreement.kappa)) }
                td.number { (value(agreement.ac1)) }
            }
        }
    };
    html! {
        (number_table(visit.t("Agreement", "Mức độ thống nhất"), &titles, &rows))
        p.muted { (visit.t("Kappa and AC1 are shown from 30 results on.", "Kappa và AC1 chỉ hiện từ 30 kết quả trở lên.")) }
    }
}

/// Returns a rate as a count of a count.
fn rate(rate: Rate) -> String {
    match rate.n {
        0 => "–".to_owned(),
        n => format!("{} / {}", grouped(rate.count), grouped(n)),
    }
}
