//! Why a page or an action fails, and the page that says so.

use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::{FromRequestParts as _, Request, State};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use maud::html;
use serde_json::json;

use super::components::{NavSection, frame};
use super::state::AppState;
use super::visit::Visit;
use crate::local_server::WorkFailed;
use mocban_catalog::CatalogError;
use mocban_core::domain::ErrorCode;
use mocban_project::ProjectError;

/// Result of a handler.
pub(super) type AppResult<T> = Result<T, AppFailure>;

/// Why a page or an action fails.
#[derive(Debug, Clone)]
pub(super) struct AppFailure {
    status: StatusCode,
    /// One sentence. Empty if there is no such page.
    text: String,
}

impl AppFailure {
    /// There is no such page, project or pair.
    pub(super) const fn not_found() -> Self {
        Self {
            status: StatusCode::NOT_FOUND,
            text: String::new(),
        }
    }

    /// A request that cannot be done as asked.
    pub(super) fn refused(text: impl Into<String>) -> Self {
        Self {
            status: StatusCode::UNPROCESSABLE_ENTITY,
            text: text.into(),
        }
    }

    /// Explains an error of the project in a folder.
    pub(super) fn of(error: impl Into<ProjectError>, dir: &Path) -> Self {
        let error = error.into();
        let status = match error.code() {
            ErrorCode::Usage | ErrorCode::NothingSelected | ErrorCode::ProjectInUse => {
                StatusCode::UNPROCESSABLE_ENTITY
            }
            _ => StatusCode::SERVICE_UNAVAILABLE,
        };
        Self {
            status,
            text: error.text(dir),
        }
    }
}

impl AppFailure {
    /// Returns what failed.
    pub(super) fn text(self) -> String {
        self.text
    }
}

impl From<ProjectError> for AppFailure {
    fn from(error: ProjectError) -> Self {
        Self::of(error, Path::new("."))
    }
}

impl From<CatalogError> for AppFailure {
    fn from(error: CatalogError) -> Self {
        ProjectError::from(error).into()
    }
}

impl From<WorkFailed> for AppFailure {
    fn from(error: WorkFailed) -> Self {
        Self {
            status: StatusCode::INTERNAL_SERVER_ERROR,
            text: error.to_string(),
        }
    }
}

impl IntoResponse for AppFailure {
    fn into_response(self) -> Response {
        let mut response = self.status.into_response();
        response.extensions_mut().insert(self);
        response
    }
}

/// Makes a page of a failure, or JSON if the request was an action.
pub(super) async fn explain(
    State(state): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    let is_page = request.method() == Method::GET;
    let (mut head, body) = request.into_parts();
    let visit = Visit::from_request_parts(&mut head, &state).await;
    let response = next.run(Request::from_parts(head, body)).await;
    let Some(failure) = response.extensions().get::<AppFailure>().cloned() else {
        return response;
    };
    if !is_page {
        let error = json!({ "error": failure.text });
        return (failure.status, Json(error)).into_response();
    }
    let Ok(visit) = visit;
    let text = if failure.text.is_empty() {
        visit
            .t("There is no such page.", "Không có trang này.")
            .to_owned()
    } else {
        failure.text
    };
    let title = visit.t("This did not work", "Không thực hiện được");
    let body = html! {
        p.notice.bad role="alert" { (text) }
        p {
            a.button href=(visit.here) { (visit.t("Try again", "Thử lại")) } " "
            a.button href=(visit.root) { (visit.t("All projects", "Tất cả dự án")) }
        }
    };
    let page = frame(&visit, title, None, NavSection::None, &body);
    (failure.status, page).into_response()
}
