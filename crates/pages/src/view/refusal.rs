//! Replies of the pages of a block that refuse something.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse as _, Response};
use serde_json::json;

use crate::messages::vietnamese;
use mocban_project::error::without_error_numbers;

/// Responds with why something was refused, also in Vietnamese if that is known.
pub(super) fn refused(status: StatusCode, why: &str) -> Response {
    (
        status,
        Json(json!({"error": without_error_numbers(why), "error_vi": vietnamese(why)})),
    )
        .into_response()
}

/// Responds with why something cannot be done now.
pub(super) fn unavailable(why: &str) -> Response {
    refused(StatusCode::SERVICE_UNAVAILABLE, why)
}
