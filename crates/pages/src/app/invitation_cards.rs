//! The invitations of a project on the page of reviews, and what a guest sees.

use std::sync::Arc;

use axum::extract::{Extension, Path, Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse as _, Response};
use axum::{Json, Router};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::components::action_form;
use super::failure::AppResult;
use super::invitations::SentInvitation;
use super::opened_review::{ReviewPlace, open_review};
use super::projects::OpenProject;
use super::qr_code::qr_code;
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::AccessControl;
use mocban_core::domain::one_line;

/// Invites a reviewer. An earlier invitation of the same reviewer to the same results ends.
pub(super) async fn invite(
    state: &AppState,
    open: &Arc<OpenProject>,
    reviewer: &str,
    choice: &str,
) -> AppResult<()> {
    let query = PageQuery::parse(choice);
    let pages = open_review(open, reviewer, &query, ReviewPlace::default()).await?;
    let pages = Router::new()
        .fallback(judge)
        .layer(Extension(pages))
        .layer(Extension(Arc::clone(open)));
    let id = [open.key.as_str(), reviewer, choice].map(str::to_owned);
    state.invitations.send(id, pages).await
}

/// Passes a request of a guest on to the pages of the review, unless the project was made anew.
async fn judge(
    Extension(open): Extension<Arc<OpenProject>>,
    Extension(pages): Extension<Router>,
    Extension(access): Extension<Arc<AccessControl>>,
    request: Request,
) -> Response {
    if !open.is_current() {
        let text = "the project has changed: ask for a new invitation / dự án đã thay đổi: hãy xin một lời mời mới";
        return (StatusCode::GONE, text).into_response();
    }
    let pages = TowerToHyperService::new(pages.layer(Extension(access)));
    let Ok(response) = pages.call(request).await;
    response
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
    let id = [key.clone(), body.reviewer.clone(), body.choice.clone()];
    match body.change {
        InvitationChange::Withdraw => state.invitations.withdraw(&id).await,
        // It may have been withdrawn in another tab.
        InvitationChange::Renew if state.invitations.is_sent(&id).await => {
            let open = state.open(&key).await?;
            invite(&state, &open, &body.reviewer, &body.choice).await?;
        }
        InvitationChange::Renew => {}
    }
    Ok(Json(json!({ "reload": true })))
}

/// Returns the invitations of a project, with links that were not opened.
pub(super) fn invitation_list(visit: &Visit, sent: &[SentInvitation]) -> Markup {
    html! {
        @if !sent.is_empty() {
            h2 { (visit.t("Invitations", "Lời mời")) }
            p.muted { (visit.t(
                "Each link works once, in one browser, which can continue later. When mocban ends, the links end too: answers are stored, and a new invitation continues where the reviewer stopped.",
                "Mỗi liên kết dùng được một lần, trong một trình duyệt, và trình duyệt đó có thể tiếp tục sau. Khi mocban dừng, các liên kết cũng hết hiệu lực: câu trả lời đã được lưu, và lời mời mới sẽ tiếp tục ở chỗ người đánh giá đã dừng.",
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
    let results = visit.t("results", "kết quả");
    let form = |change: &str, text: &str| {
        action_form(
            "actions/invitation",
            "inline",
            &html! {
                input type="hidden" name="reviewer" value=(invitation.reviewer);
                input type="hidden" name="choice" value=(invitation.choice);
                button name="change" value=(change) { (text) }
            },
        )
    };
    html! {
        section.card.invitation aria-label=(reviewer) {
            h3 { (reviewer) }
            p.muted { (metric) @if let Some(sample) = judged.get("sample") { ", " (sample) " " (results) } }
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
