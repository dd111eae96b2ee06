//! What a request must have before anything is done for it: our own host, the cookie, and for writes the page's word.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use super::desk::Desk;

/// Largest body of a request in bytes: a verdict with a long note is far below.
pub(super) const BODY_LIMIT: usize = 16 * 1024;
/// Header in which writes bring the page's word.
pub(super) const CSRF_HEADER: &str = "x-mocban-word";
/// Address that takes the token.
pub(super) const START: &str = "/start";

/// Headers of every answer.
const HEADERS: [(HeaderName, &str); 7] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; connect-src 'self'; \
         form-action 'self'; frame-ancestors 'none'; base-uri 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        "same-origin",
    ),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        "same-origin",
    ),
];

/// Why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refused {
    /// Sent to another name than ours, as by DNS rebinding.
    Host,
    /// Without the cookie of this start.
    Cookie,
    /// Written from another page, or from none.
    Origin,
    /// A body of another type than JSON, as a form of another page could send.
    ContentType,
    /// Without the word that only the page knows.
    Word,
}

impl Refused {
    const fn status(self) -> StatusCode {
        match self {
            Self::Host => StatusCode::MISDIRECTED_REQUEST,
            Self::Cookie => StatusCode::UNAUTHORIZED,
            Self::Origin | Self::Word => StatusCode::FORBIDDEN,
            Self::ContentType => StatusCode::UNSUPPORTED_MEDIA_TYPE,
        }
    }

    const fn sentence(self) -> &'static str {
        match self {
            Self::Host => {
                "this page goes by another name; open the address that the command printed"
            }
            Self::Cookie => "open the address that the command printed; it works once",
            Self::Origin => "only the review page may write here",
            Self::ContentType => "only application/json is taken",
            Self::Word => "the page is of an earlier start; reload it",
        }
    }
}

/// Checks a request and puts the headers on whatever is answered.
pub(super) async fn guard(State(desk): State<Arc<Desk>>, request: Request, next: Next) -> Response {
    let mut answer = match check(&desk, &request) {
        Ok(()) => next.run(request).await,
        Err(refused) => (refused.status(), refused.sentence()).into_response(),
    };
    let headers = answer.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    answer
}

fn check(desk: &Desk, request: &Request) -> Result<(), Refused> {
    let headers = request.headers();
    let host = text(headers, &header::HOST).ok_or(Refused::Host)?;
    if !desk.hosts.iter().any(|known| known == host) {
        return Err(Refused::Host);
    }
    let is_read = matches!(*request.method(), Method::GET | Method::HEAD);
    if is_read && request.uri().path() == START {
        return Ok(());
    }
    if !text(headers, &header::COOKIE).is_some_and(|cookie| desk.session.knows(cookie)) {
        return Err(Refused::Cookie);
    }
    if is_read {
        return Ok(());
    }
    let origin = text(headers, &header::ORIGIN).and_then(|origin| origin.strip_prefix("http://"));
    if origin != Some(host) {
        return Err(Refused::Origin);
    }
    let kind = text(headers, &header::CONTENT_TYPE).and_then(|kind| kind.split(';').next());
    if kind.map(str::trim) != Some("application/json") {
        return Err(Refused::ContentType);
    }
    let word = headers.get(CSRF_HEADER).and_then(|word| word.to_str().ok());
    if !word.is_some_and(|word| desk.session.is_from_page(word)) {
        return Err(Refused::Word);
    }
    Ok(())
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}
