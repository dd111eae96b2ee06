//! Passes a request on to pages that have their own routes.

use std::sync::Arc;

use axum::Router;
use axum::extract::Request;
use axum::http::Extensions;
use axum::response::{Redirect, Response};

use super::failure::{AppFailure, AppResult};
use super::state::AppState;
use crate::local_server::{AccessControl, respond};
use crate::review::Language;

/// Returns the path below an address of five segments, such as `/p/PROJECT/review/REVIEWER/CHOICE/`.
pub(super) fn path_below(request: &Request) -> &str {
    request
        .uri()
        .path()
        .splitn(7, '/')
        .nth(6)
        .unwrap_or_default()
}

/// Asks for one of `pages`, which are paths below an address of five segments, in the language that the user has chosen. Their
/// routes outlive a choice, so the language is in each request.
///
/// # Errors
/// If the address names a language, chooses that of all pages, and returns the address without it: a page that is read again then
/// follows a later choice.
pub(super) fn in_chosen_language(
    state: &AppState,
    mut request: Request,
    pages: &[&str],
) -> Result<Request, Redirect> {
    if !pages.contains(&path_below(&request)) {
        return Ok(request);
    }
    let path = request.uri().path();
    if let Some(language) = Language::asked_for(request.uri().query()) {
        state.set_language(language);
        let page = path.rsplit('/').next().unwrap_or_default();
        return Err(Redirect::to(if page.is_empty() { "./" } else { page }));
    }
    if let Some(language) = state.language() {
        let address = format!("{path}?lang={}", language.name());
        if let Ok(address) = address.parse() {
            *request.uri_mut() = address;
        }
    }
    Ok(request)
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
