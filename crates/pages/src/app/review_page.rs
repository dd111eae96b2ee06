//! The start of a review, and the pages of reviewers.

use std::collections::BTreeSet;
use std::sync::Arc;

use axum::extract::{Path, Request, State};
use axum::http::Method;
use axum::response::{Html, IntoResponse as _, Response};
use axum::{Extension, Json};
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::{PageQuery, encoded};
use super::chosen_sets::CHOSEN;
use super::components::{NavSection, action_form, choice, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::invitation_cards::{invitation_list, invite};
use super::opened_review::{ReviewPlace, open_review};
use super::pass_on::{in_chosen_language, pass_on};
use super::projects::OpenProject;
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::AccessControl;
use mocban_catalog::reviewer_name;
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{ReviewOrder, ThresholdMetric};
use mocban_project::error::explanation;
use mocban_project::reviewers::similar_names;

/// Size of the sample that the page suggests.
const SAMPLE: usize = 50;

/// The fields of the form that starts a review.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StartBody {
    reviewer: String,
    metric: String,
    sample: String,
    order: String,
    /// Whether a name that looks like another is that of another person.
    #[serde(default)]
    is_new: String,
    /// Whether the reviewer is invited instead of judging in this browser.
    #[serde(default)]
    invite: String,
    /// Key of the chosen pairs, if not all are judged.
    #[serde(default)]
    chosen: String,
}

/// Shows the form that starts a review; a script then asks for the reviewers.
pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let chosen = state.chosen.of(&key, &open.dir, &visit.query).await;
    let invited = state.invitations.of_project(&key).await;
    let body = html! {
        p { (visit.t(
            "The question is always the same: is the rotation within 5 degrees, and is the whole character there? Results come in random order, without scores, and each answer is stored at once.",
            "Câu hỏi luôn như nhau: góc xoay có lệch không quá 5 độ, và chữ có đủ không? Kết quả xuất hiện theo thứ tự ngẫu nhiên, không kèm điểm, và mỗi câu trả lời được lưu ngay.",
        )) }
        @match chosen {
            Ok(chosen) => (start_form(&visit, chosen.map(|pairs| pairs.len()))),
            Err(failure) => {
                p.notice.bad role="alert" { (failure.text(visit.language)) }
                (start_form(&visit, None))
            },
        }
        div #live data-live="3000" role="status" { (invitation_list(&visit, &invited)) }
        div #reviewers data-load="review/agreement" aria-live="polite" {
            p.muted { (visit.t("Reading the verdicts…", "Đang đọc các đánh giá…")) }
        }
    };
    let title = visit.t("Review", "Đánh giá");
    Ok(frame(&visit, title, Some(&key), NavSection::Review, &body))
}

/// Says how many pairs were chosen, and what their verdicts are good for.
fn chosen_part(visit: &Visit, pairs: usize) -> Markup {
    html! {
        input type="hidden" name=(CHOSEN) value=[visit.query.get(CHOSEN)];
        p #chosen-pairs.notice {
            (visit.t("Only the chosen pairs are judged", "Chỉ đánh giá các cặp đã chọn")) ": " b { (grouped(pairs as u64)) } ". "
            (visit.t(
                "They are no random sample, so their verdicts may bias Acc. There are no attention checks among them.",
                "Chúng không phải mẫu ngẫu nhiên nên đánh giá về chúng có thể làm lệch Acc. Không có hình kiểm tra sự chú ý.",
            )) " "
            a href=(visit.here) { (visit.t("Judge all pairs", "Đánh giá mọi cặp")) }
        }
    }
}

/// Returns the form that starts a review, of all pairs or of as many chosen ones.
fn start_form(visit: &Visit, chosen: Option<usize>) -> Markup {
    let metrics = ThresholdMetric::ALL.map(|metric| (metric.name(), visit.metric(metric)));
    // An address with an order has the choices of another review, of which all results have no sample.
    let asked = visit.query.get("order");
    let (metric, sample) = match asked {
        Some(_) => (
            visit.query.get("metric").unwrap_or(""),
            visit.query.parsed("sample"),
        ),
        None => (
            ThresholdMetric::DEFAULT.name(),
            chosen.is_none().then_some(SAMPLE),
        ),
    };
    action_form(
        "actions/review",
        "card fields",
        &html! {
            @if let Some(pairs) = chosen { (chosen_part(visit, pairs)) }
            label { span { (visit.t("Name of the reviewer", "Tên người đánh giá")) }
                input #reviewer name="reviewer" required maxlength="100" autocomplete="off";
            }
            label { span { (visit.t("Results of", "Kết quả của")) }
                select name="metric" {
                    @for (value, text) in metrics { (choice(value, text, Some(metric))) }
                    (choice("", visit.t("all metrics", "mọi độ đo"), Some(metric)))
                }
            }
            label { span { (visit.t("How many results (empty: all)", "Bao nhiêu kết quả (để trống: tất cả)")) }
                input.short type="number" name="sample" min="1" value=[sample];
            }
            label { span { (visit.t("Order", "Thứ tự")) }
                select name="order" {
                    (choice(ReviewOrder::Random.name(), visit.t("random, for an unbiased accuracy", "ngẫu nhiên, để đo độ chính xác"), asked))
                    (choice(ReviewOrder::LeastConfident.name(), visit.t("least confident first, to find failures", "độ tin cậy thấp trước, để tìm lỗi"), asked))
                    (choice(ReviewOrder::Adjudicate.name(), visit.t("disagreements of two others", "chỗ hai người khác bất đồng"), asked))
                }
            }
            label.check { input type="checkbox" name="is_new" value="yes"; " " (visit.t("another person with a similar name (only if the page asks)", "người khác có tên gần giống (chỉ khi trang hỏi)")) }
            button.primary { (visit.t("Start or continue", "Bắt đầu hoặc tiếp tục")) }
            button name="invite" value="yes" { (visit.t("Invite", "Mời")) }
            p.muted { (visit.t(
                "\"Invite\" makes a link for another computer, tablet or phone of your network. Whoever opens it can judge and align by hand under this name, and see no other page. The connection is not encrypted.",
                "\"Mời\" tạo một liên kết cho máy tính, máy tính bảng hoặc điện thoại khác trong mạng của bạn. Ai mở liên kết có thể đánh giá và căn chỉnh thủ công dưới tên này, và không xem được trang nào khác. Kết nối không được mã hóa.",
            )) }
        },
    )
}

/// Checks the fields of a review and replies with its address, or makes an invitation.
pub(super) async fn start(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<StartBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let reviewer = reviewer_name(&body.reviewer);
    let reviewer =
        reviewer.map_err(|error| AppFailure::refused(Sentence::of_program(&error.to_string())))?;
    if body.is_new.is_empty() {
        refuse_similar(&open, &reviewer).await?;
    }
    let query = PageQuery::default()
        .with("metric", &body.metric)
        .with("sample", &body.sample)
        .with("order", &body.order)
        .with(CHOSEN, &body.chosen);
    let text = query.text();
    let choice = text.trim_start_matches('?');
    if !body.invite.is_empty() {
        invite(&state, &open, &reviewer, choice).await?;
        return Ok(Json(json!({ "reload": true })));
    }
    // Opening refuses a queue without items before the page is left.
    let _router = review(&state, &open, &reviewer, choice).await?;
    let go = format!("review/{}/{}/", encoded(&reviewer), encoded(choice));
    Ok(Json(json!({ "go": go })))
}

/// Refuses a new reviewer whose name looks like another.
async fn refuse_similar(open: &OpenProject, reviewer: &str) -> AppResult<()> {
    let rights = open.catalog.review_rights().await?;
    let names = BTreeSet::from([reviewer.to_owned()]);
    let similar = similar_names(&open.catalog, &rights, &names).await;
    let similar = similar.map_err(|error| AppFailure::of(error, &open.dir))?;
    let Some((new, known)) = similar else {
        return Ok(());
    };
    let [new, known] = [new, known].map(|name| quoted(&name));
    Err(AppFailure::refused(Sentence::new(
        format!(
            "{known} and {new} are nearly the same name: if they are one person, write {known}, or else tick \"another person\""
        ),
        format!(
            "{known} và {new} gần như cùng một tên: nếu là một người, hãy viết {known}, nếu không hãy chọn \"người khác\""
        ),
    )))
}

/// Passes a request on to the pages of a reviewer.
pub(super) async fn pages(
    State(state): State<Arc<AppState>>,
    Path(parts): Path<Vec<String>>,
    Extension(access): Extension<Arc<AccessControl>>,
    request: Request,
) -> AppResult<Response> {
    let [key, reviewer, choice, ..] = parts.as_slice() else {
        return Err(AppFailure::not_found());
    };
    let request = match in_chosen_language(&state, request, &[""]) {
        Ok(request) => request,
        Err(plain) => return Ok(plain.into_response()),
    };
    let open = state.open(key).await?;
    let router = match review(&state, &open, reviewer, choice).await {
        Ok(router) => router,
        // An open page keeps its answers until the review is open again.
        Err(failure) if request.method() == Method::POST => return Err(failure.for_later()),
        Err(failure) => return Err(failure),
    };
    pass_on(router, access, request).await
}

/// Returns the pages of a reviewer, which are opened if they are not.
async fn review(
    state: &AppState,
    open: &Arc<OpenProject>,
    reviewer: &str,
    choice: &str,
) -> AppResult<axum::Router> {
    let id = [open.key.as_str(), reviewer, choice].map(str::to_owned);
    if let Some(router) = state.reviews.get(&id, open) {
        return Ok(router);
    }
    // Two requests at once may both open it; both get the same pages.
    let of_app = ReviewPlace {
        command: Some(format!(
            "mocban -C {}",
            shell_quoted(&open.dir.to_string_lossy())
        )),
        explain: explanation,
        project_page: Some("../../../"),
        work: Arc::clone(&state.review_work),
    };
    let query = PageQuery::parse(choice);
    let pairs = state.chosen.of(&open.key, &open.dir, &query).await?;
    let opened = open_review(open, reviewer, &query, of_app, pairs).await?;
    Ok(state.reviews.keep(id, open, opened.routes()))
}
