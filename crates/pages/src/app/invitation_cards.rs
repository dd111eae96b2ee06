//! The invitations of a project on the page of reviews, and what a guest sees.

use std::sync::Arc;

use axum::extract::{Extension, Path, Request, State};
use axum::http::StatusCode;
use axum::response::{Html, IntoResponse as _, Response};
use axum::{Json, Router};
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::chosen_sets::CHOSEN;
use super::components::{action_form, grouped};
use super::failure::{AppFailure, AppResult};
use super::invitations::{GuestReview, SentInvitation};
use super::number_text::english_count;
use super::open_pages::PagesId;
use super::opened_review::{ReviewPlace, open_review};
use super::projects::OpenProject;
use super::qr_code::qr_code;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::{asks_for_page, document, respond};
use crate::review::{Language, QueueCounts};
use mocban_core::domain::{ReviewOrder, one_line};

/// Invites a reviewer, unless the same invitation was sent before.
pub(super) async fn invite(
    state: &AppState,
    open: &Arc<OpenProject>,
    reviewer: &str,
    choice: &str,
) -> AppResult<()> {
    let id = invitation_id(open, reviewer, choice);
    match state.invitations.is_opened(&id).await {
        None => {
            state.invitations.require_room().await?;
            let pages = guest_pages(state, open, reviewer, choice).await?;
            state.invitations.send(id, open, pages, false).await
        }
        Some(false) => Ok(()),
        Some(true) => Err(AppFailure::refused(Sentence::new(
            format!(
                "{reviewer} is invited already and has opened the link: press \"New link\" below to replace it"
            ),
            format!(
                "{reviewer} đã được mời và đã mở liên kết: hãy bấm \"Liên kết mới\" bên dưới để thay liên kết"
            ),
        ))),
    }
}

fn invitation_id(open: &OpenProject, reviewer: &str, choice: &str) -> PagesId {
    [open.key.as_str(), reviewer, choice].map(str::to_owned)
}

/// Returns what a guest sees, and the review, which says how far the guest is.
async fn guest_pages(
    state: &AppState,
    open: &Arc<OpenProject>,
    reviewer: &str,
    choice: &str,
) -> AppResult<(Router, Arc<GuestReview>)> {
    let query = PageQuery::parse(choice);
    let pairs = state.chosen.of(&open.key, &open.dir, &query).await?;
    let pages = open_review(
        open,
        reviewer,
        &query,
        ReviewPlace::of_guest(Arc::clone(&state.review_work)),
        pairs,
    )
    .await?;
    let routes = pages.routes();
    let review = Arc::new(GuestReview::new(pages));
    let router = Router::new()
        .fallback(judge)
        .layer(Extension(routes))
        .layer(Extension(Arc::clone(&review)))
        .layer(Extension(Arc::clone(open)));
    Ok((router, review))
}

/// Says that the project is not there; the page of a guest keeps its answers.
const PROJECT_GONE: [&str; 2] = [
    "The project is not in its place. Tell the person who invited you, and keep this page open: your answers are sent when it is back.",
    "Dự án không còn ở chỗ của nó. Hãy báo cho người mời bạn và giữ trang này mở: các câu trả lời sẽ được gửi khi dự án trở lại.",
];

/// Passes a request of a guest on to the pages of the review, unless the project is not there or was made anew.
async fn judge(
    Extension(open): Extension<Arc<OpenProject>>,
    Extension(pages): Extension<Router>,
    Extension(review): Extension<Arc<GuestReview>>,
    request: Request,
) -> Response {
    review.see();
    if open.is_current() {
        return respond(pages, request).await;
    }
    let [english, vietnamese] = PROJECT_GONE;
    if !asks_for_page(request.headers()) {
        let body = Json(json!({ "error": english, "error_vi": vietnamese }));
        return (StatusCode::SERVICE_UNAVAILABLE, body).into_response();
    }
    let body = html! {
        body { main {
            h1 { "The project is not there" }
            p { (english) }
            div lang="vi" {
                h1 { "Không thấy dự án" }
                p { (vietnamese) }
            }
        } }
    };
    let page = document("en", "mocban", &html! {}, &body);
    (StatusCode::SERVICE_UNAVAILABLE, Html(page.into_string())).into_response()
}

/// What is done to an invitation.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum InvitationChange {
    Renew,
    Withdraw,
}

/// The fields of the buttons of an invitation.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InvitationBody {
    reviewer: String,
    choice: String,
    change: InvitationChange,
}

/// Withdraws an invitation, or replaces its link.
pub(super) async fn change(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<InvitationBody>,
) -> AppResult<Json<Value>> {
    let InvitationBody {
        reviewer,
        choice,
        change,
    } = body;
    match change {
        InvitationChange::Withdraw => state.invitations.withdraw(&[key, reviewer, choice]).await,
        InvitationChange::Renew => {
            let open = state.open(&key).await?;
            let pages = guest_pages(&state, &open, &reviewer, &choice).await?;
            let id = invitation_id(&open, &reviewer, &choice);
            state.invitations.send(id, &open, pages, true).await?;
        }
    }
    Ok(Json(json!({ "reload": true })))
}

/// Returns the invitations of a project, with links that were not opened.
pub(super) fn invitation_list(visit: &Visit, sent: &[SentInvitation]) -> Markup {
    html! {
        @if !sent.is_empty() {
            h2 { (visit.t("Invitations", "Lời mời")) }
            p.muted { (visit.t(
                "Each link works once, in one browser, which can continue later. When mocban ends or this computer gets another address, the links end too: answers are stored, and a new invitation continues where the reviewer stopped.",
                "Mỗi liên kết dùng được một lần, trong một trình duyệt, và trình duyệt đó có thể tiếp tục sau. Khi mocban dừng hoặc máy này có địa chỉ khác, các liên kết cũng hết hiệu lực: câu trả lời đã được lưu, và lời mời mới sẽ tiếp tục ở chỗ người đánh giá đã dừng.",
            )) }
            div.cards { @for invitation in sent { (card(visit, invitation)) } }
        }
    }
}

fn card(visit: &Visit, invitation: &SentInvitation) -> Markup {
    let reviewer = one_line(&invitation.reviewer);
    let judged = PageQuery::parse(&invitation.choice);
    let metric = match judged.parsed("metric") {
        Some(metric) => visit.metric(metric),
        None => visit.t("all metrics", "mọi độ đo"),
    };
    let results = match (&invitation.progress, judged.parsed("sample")) {
        (Some(counts), _) => Some(counts.results as u64),
        (None, sample) => sample,
    };
    let order = match judged.parsed("order") {
        Some(ReviewOrder::LeastConfident) => {
            visit.t("least confident first", "độ tin cậy thấp trước")
        }
        Some(ReviewOrder::Adjudicate) => {
            visit.t("disagreements of two others", "chỗ hai người khác bất đồng")
        }
        Some(ReviewOrder::Random) | None => visit.t("random order", "thứ tự ngẫu nhiên"),
    };
    let question = visit.t(
        "The reviewer must open a new link to go on. Answers that were sent are stored. Continue?",
        "Người đánh giá phải mở liên kết mới để tiếp tục. Các câu trả lời đã gửi vẫn được lưu. Tiếp tục?",
    );
    let is_opened = invitation.url.is_none();
    let form = |change: &str, text: &str| {
        action_form(
            "actions/invitation",
            "inline",
            &html! {
                input type="hidden" name="reviewer" value=(invitation.reviewer);
                input type="hidden" name="choice" value=(invitation.choice);
                button name="change" value=(change) data-confirm=[is_opened.then_some(question)] { (text) }
            },
        )
    };
    html! {
        div.card.invitation role="group" aria-label={ (reviewer) ", " (metric) ", " (order) } {
            h3 { (reviewer) }
            p.muted { (metric) @if let Some(results) = results { ", " (grouped(results)) " " (visit.form(results, ["result", "results"], "kết quả")) } ", " (order) @if judged.get(CHOSEN).is_some() { ", " (visit.t("chosen pairs", "các cặp đã chọn")) } }
            (progress(visit, invitation))
            @match &invitation.url {
                Some(url) => {
                    input.link readonly value=(url) aria-label=(visit.t("Link", "Liên kết"));
                    button type="button" data-copy=(url) data-copied=(visit.t("Copied", "Đã sao chép")) { (visit.t("Copy the link", "Sao chép liên kết")) }
                    @if let Ok(code) = qr_code(url, visit.t("QR code of the link", "Mã QR của liên kết")) { (code) }
                }
                None => p.good { (visit.t("The link has been opened.", "Liên kết đã được mở.")) },
            }
            div.row {
                (form("renew", visit.t("New link", "Liên kết mới")))
                (form("withdraw", visit.t("Withdraw", "Thu hồi")))
            }
        }
    }
}

/// Returns how many images a guest sees, which are more than the results if some are attention checks.
fn images_text(visit: &Visit, counts: QueueCounts) -> String {
    let images = grouped(counts.items as u64);
    let in_english = english_count(counts.items as u64, ["image", "images"]);
    let checks = counts.items.saturating_sub(counts.results) as u64;
    let results = grouped(counts.results as u64);
    match (visit.language, counts.items > counts.results) {
        (Language::English, true) => {
            format!(
                "{in_english} ({}, {})",
                english_count(counts.results as u64, ["result", "results"]),
                english_count(
                    checks,
                    ["attention check or repeat", "attention checks and repeats"]
                )
            )
        }
        (Language::English, false) => in_english,
        (Language::Vietnamese, true) => {
            format!(
                "{images} hình ({results} kết quả, {} hình kiểm tra và lặp lại)",
                grouped(checks)
            )
        }
        (Language::Vietnamese, false) => format!("{images} hình"),
    }
}

/// Says how much of the sample a guest has answered, and when the guest was last seen.
fn progress(visit: &Visit, invitation: &SentInvitation) -> Markup {
    html! {
        @if let Some(counts) = invitation.progress {
            p.answered {
                (visit.t("Answered", "Đã trả lời")) ": " b { (grouped(counts.answered as u64)) } " / " (images_text(visit, counts))
                @if counts.answered >= counts.items { " · " span.good { (visit.t("finished", "đã xong")) } }
            }
            progress value=(counts.answered) max=(counts.items.max(1)) aria-label=(visit.t("Answered", "Đã trả lời")) {}
        }
        @if let Some(seen) = invitation.seen {
            p.muted { (visit.t("Last seen", "Hoạt động gần nhất")) ": " time.seen { (visit.time(seen)) } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::card;
    use crate::app::invitations::SentInvitation;
    use crate::app::visit::Visit;
    use crate::review::{Language, QueueCounts};

    #[test]
    fn a_card_counts_what_the_guest_sees_and_how_much_of_it_are_results() {
        let shown = |language, items| {
            let invitation = SentInvitation {
                reviewer: "lan".to_owned(),
                choice: "metric=relief&sample=50".to_owned(),
                url: None,
                progress: Some(QueueCounts {
                    items,
                    results: 2,
                    answered: 1,
                }),
                seen: None,
            };
            card(&Visit::in_language(language), &invitation).into_string()
        };
        let english = shown(Language::English, 7);
        for part in [
            "Relief, 2 results, random order",
            "<b>1</b> / 7 images (2 results, 5 attention checks and repeats)",
        ] {
            assert!(english.contains(part), "{part}: {english}");
        }
        let vietnamese = shown(Language::Vietnamese, 7);
        let part = "<b>1</b> / 7 hình (2 kết quả, 5 hình kiểm tra và lặp lại)";
        assert!(vietnamese.contains(part), "{vietnamese}");
        let plain = shown(Language::English, 2);
        assert!(plain.contains("<b>1</b> / 2 images<"), "{plain}");
        let one = shown(Language::English, 3);
        assert!(
            one.contains("(2 results, 1 attention check or repeat)"),
            "{one}"
        );
    }
}
