//! Passes a request on to pages that have their own routes.

use std::sync::Arc;

use axum::Router;
use axum::extract::Request;
use axum::http::Extensions;
use axum::response::Response;

use super::failure::{AppFailure, AppResult};
use crate::local_server::{AccessControl, respond};

/// Returns the path below an address of five segments, such as `/p/PROJECT/review/REVIEWER/CHOICE/`.
pub(super) fn path_below(request: &Request) -> &str {
    request
        .uri()
        .path()
        .splitn(7, '/')
        .nth(6)
        .unwrap_or_default()
}

/// Passes a request for the path below an address of five segments on to a router.
pub(super) async fn pass_on(
    router: Router,
    access: Arc<AccessControl>,
    request: Request,
) -> AppResult<Response> {
    let below = path_below(&request);
    let target = match request.uri().query() {
        Some(query) => format!("/{below}?{query}"),
        None => format!("/{below}"),
    };
    let (mut head, body) = request.into_parts();
    head.uri = target.parse().map_err(|_invalid| AppFailure::not_found())?;
    // The parameters of this address are not those of the page.
    head.extensions = Extensions::new();
    head.extensions.insert(access);
    let request = Request::from_parts(head, body);
    Ok(respond(router, request).await)
}
