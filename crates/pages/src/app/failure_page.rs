//! The page that says why a page or an action fails.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use maud::html;

use super::components::{NavSection, frame};
use super::failure::AppFailure;
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::asks_for_page;

/// Makes a page of a failure, or JSON if the request was an action or comes from a script that reads no page.
pub(super) async fn explain(
    State(state): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    let headers = request.headers();
    let reads_pages = !headers.contains_key(header::ACCEPT) || asks_for_page(headers);
    let is_page = request.method() == Method::GET && reads_pages;
    let (head, body) = request.into_parts();
    let visit = Visit::of(&head, &state);
    let response = next.run(Request::from_parts(head, body)).await;
    let Some(failure) = response.extensions().get::<AppFailure>().cloned() else {
        return response;
    };
    let (status, text) = (failure.status(), failure.text(visit.language));
    if !is_page {
        return (status, Json(failure.json(visit.language))).into_response();
    }
    let title = visit.t("This did not work", "Không thực hiện được");
    let body = html! {
        p.notice.bad role="alert" { (text) }
        p {
            a.button href={ (visit.here) (visit.query.text()) } { (visit.t("Try again", "Thử lại")) } " "
            a.button href=(visit.root) { (visit.t("All projects", "Tất cả dự án")) }
        }
    };
    let page = frame(&visit, title, None, NavSection::None, &body);
    (status, page).into_response()
}
