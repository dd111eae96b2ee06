//! The router of a server: its start address, and pages that only the session sees.

use std::sync::Arc;

use axum::extract::{RawQuery, Request, State};
use axum::http::{Method, StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::{Router, middleware};
use hyper::service::Service as _;
use hyper_util::service::TowerToHyperService;

use super::access_control::AccessControl;
use super::guard::guard;
use super::page_frame::{closed_page, forward_page, welcome_page};
use super::session::{ICON, SESSION_SCRIPT, SESSION_STYLE, START};

/// Lifetime of the cookie of a guest in seconds: a reviewer continues on another day, in a browser that was closed.
const GUEST_COOKIE_S: u32 = 30 * 24 * 60 * 60;

impl AccessControl {
    /// Returns the router of a server: the start address, and `pages` for requests of the session. The paths of `pages`
    /// are those below the path of the session, so links between pages must be relative.
    pub fn guarded(self: &Arc<Self>, pages: Router) -> Router {
        let script = [(header::CONTENT_TYPE, "text/javascript; charset=utf-8")];
        let text = include_str!("../../../../assets/local-server/session.js");
        let css = [(header::CONTENT_TYPE, "text/css; charset=utf-8")];
        let style = include_str!("../../../../assets/local-server/session.css");
        let drawing = [(header::CONTENT_TYPE, "image/svg+xml")];
        let icon = include_str!("../../../../assets/local-server/icon.svg");
        Router::new()
            .route(START, get(start).post(start))
            .with_state(Arc::clone(self))
            .route(SESSION_SCRIPT, get(async move || (script, text)))
            .route(SESSION_STYLE, get(async move || (css, style)))
            .route(ICON, get(async move || (drawing, icon)))
            .fallback_service(pages)
            .layer(middleware::from_fn_with_state(Arc::clone(self), guard))
    }
}

/// Accepts the one-time token, sets the session cookie, and responds with a page that leads on to the session. A redirect
/// would not work: a browser sends a `SameSite=Strict` cookie only if the navigation starts on this site.
///
/// Programs that preview links must not use up the token. Those of a terminal send HEAD. The link of an invitation is sent by
/// chat programs, which fetch the page, so a person must press its button.
async fn start(
    State(access): State<Arc<AccessControl>>,
    method: Method,
    RawQuery(query): RawQuery,
) -> Response {
    let (session, token) = (&access.session, start_token(query.as_deref()));
    let opening = if access.is_guest() {
        Method::POST
    } else {
        Method::GET
    };
    if access.is_guest() && method == Method::GET && session.is_open_to(token) {
        return Html(welcome_page(token).into_string()).into_response();
    }
    if method != opening && method != Method::GET {
        return StatusCode::METHOD_NOT_ALLOWED.into_response();
    }
    if method == opening && session.open(token) {
        let mut cookie = session.set_cookie();
        if access.is_guest() {
            cookie.extend([format!("; Max-Age={GUEST_COOKIE_S}")]);
        }
        let cookie = [(header::SET_COOKIE, cookie)];
        return (cookie, Html(forward_page(&session.path).into_string())).into_response();
    }
    // The script of this page leads a browser that has opened the session on to it.
    (
        StatusCode::FORBIDDEN,
        Html(closed_page(&access.entrance).into_string()),
    )
        .into_response()
}

/// Calls pages that have their own routes.
pub async fn respond(pages: Router, request: Request) -> Response {
    let Ok(response) = TowerToHyperService::new(pages).call(request).await;
    response.into_response()
}

/// Returns the token in the query of a start address.
pub(super) fn start_token(query: Option<&str>) -> &str {
    let token = query.and_then(|query| query.strip_prefix("token="));
    token.unwrap_or_default()
}
