//! The router of a server: its start address, and pages that only the session sees.

use std::sync::Arc;

use axum::extract::{RawQuery, State};
use axum::http::{Method, StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::{Router, middleware};

use super::access_control::{AccessControl, Entrance};
use super::guard::guard;
use super::page_frame::{closed_page, forward_page};
use super::session::{ICON, SESSION_SCRIPT, START};

/// Lifetime of the cookie of a guest in seconds: a reviewer continues on another day, in a browser that was closed.
const GUEST_COOKIE_S: u32 = 30 * 24 * 60 * 60;

impl AccessControl {
    /// Returns the router of a server: the start address, and `pages` for requests of the session. The paths of `pages`
    /// are those below the path of the session, so links between pages must be relative.
    pub fn guarded(self: &Arc<Self>, pages: Router) -> Router {
        let script = [(header::CONTENT_TYPE, "text/javascript; charset=utf-8")];
        let text = include_str!("../../../../assets/local-server/session.js");
        let drawing = [(header::CONTENT_TYPE, "image/svg+xml")];
        let icon = include_str!("../../../../assets/local-server/icon.svg");
        Router::new()
            .route(START, get(start))
            .with_state(Arc::clone(self))
            .route(SESSION_SCRIPT, get(async move || (script, text)))
            .route(ICON, get(async move || (drawing, icon)))
            .fallback_service(pages)
            .layer(middleware::from_fn_with_state(Arc::clone(self), guard))
    }
}

/// Accepts the one-time token, sets the session cookie, and responds with a page that leads on to the session. A redirect
/// would not work: a browser sends a `SameSite=Strict` cookie only if the navigation starts on this site.
async fn start(
    State(access): State<Arc<AccessControl>>,
    method: Method,
    RawQuery(query): RawQuery,
) -> Response {
    // Programs that preview links send HEAD, which must not use up the token.
    if method != Method::GET {
        return StatusCode::METHOD_NOT_ALLOWED.into_response();
    }
    let session = &access.session;
    if session.open(start_token(query.as_deref())) {
        let mut cookie = session.set_cookie();
        if access.entrance == Entrance::Invitation {
            cookie.extend([format!("; Max-Age={GUEST_COOKIE_S}")]);
        }
        let cookie = [(header::SET_COOKIE, cookie)];
        return (cookie, Html(forward_page(&session.path).into_string())).into_response();
    }
    // The script of this page leads a browser that has opened the session on to it.
    (
        StatusCode::FORBIDDEN,
        Html(closed_page(access.entrance).into_string()),
    )
        .into_response()
}

/// Returns the token in the query of a start address.
pub(super) fn start_token(query: Option<&str>) -> &str {
    let token = query.and_then(|query| query.strip_prefix("token="));
    token.unwrap_or_default()
}
