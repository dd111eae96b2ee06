//! Checks every request before it reaches a handler. All requests need a valid `Host`, and all but the start address
//! need the session: its path and its cookie. Writes also need a valid `Origin`, a JSON body and the CSRF token. Bodies are
//! read whole before, except for files, which handlers read as they arrive.

use std::sync::Arc;
use std::time::Duration;

use axum::body::to_bytes;
use axum::extract::{Request, State};
use axum::http::header::AsHeaderName;
use axum::http::uri::{InvalidUri, Uri};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{Html, IntoResponse as _, Response};

use super::access_control::AccessControl;
use super::page_frame::closed_page;
use super::session::{ICON, SESSION_SCRIPT, SESSION_STYLE, START};
use mocban_system::failpoint::time_scale;

/// Maximum size of a request body of a guest in bytes. A verdict with a note of ordinary length is far smaller.
const GUEST_BODY_LIMIT: usize = 16 * 1024;
/// Maximum size of a request body of the user in bytes. A thousand ids of pairs are smaller.
const BODY_LIMIT: usize = 256 * 1024;
/// Maximum time in which the body arrives.
const BODY_TIMEOUT: Duration = Duration::from_secs(10);
/// Pages of a session, other than that of a guest, to which a browser sends files.
const FILES: &str = "/uploads/";
/// Request header that carries the CSRF token.
const CSRF_HEADER: &str = "x-csrf-token";

/// Security headers of every response.
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

/// Why a request is rejected: the status and the body of the response, a line in English and one in Vietnamese, because no
/// handler has chosen a language. Scripts show the line of their page.
type Rejection = (StatusCode, &'static str);

/// `Host` is not an address of this server, for example after DNS rebinding.
const WRONG_HOST: Rejection = (
    StatusCode::MISDIRECTED_REQUEST,
    "this host name is not served; open the address that the command printed\n\
     tên máy này không được phục vụ; hãy mở địa chỉ mà lệnh đã in ra",
);
/// The path or the cookie of the session is missing or of an earlier start.
const NO_SESSION: Rejection = (
    StatusCode::UNAUTHORIZED,
    "open the address that you were given; it works once\n\
     hãy mở địa chỉ bạn đã nhận; địa chỉ chỉ dùng được một lần",
);
/// `Origin` is missing or of another site.
const WRONG_ORIGIN: Rejection = (
    StatusCode::FORBIDDEN,
    "only the page itself may write here\n\
     chỉ chính trang này được ghi vào đây",
);
/// The body is not JSON. A form on another site could send such a body.
const NO_JSON: Rejection = (
    StatusCode::UNSUPPORTED_MEDIA_TYPE,
    "only application/json is accepted\n\
     chỉ nhận application/json",
);
/// The body is not marked as a file. A form on another site could send such a body.
const NO_FILE: Rejection = (
    StatusCode::UNSUPPORTED_MEDIA_TYPE,
    "only application/octet-stream is accepted\n\
     chỉ nhận application/octet-stream",
);
/// The CSRF token is missing or wrong.
const WRONG_TOKEN: Rejection = (
    StatusCode::FORBIDDEN,
    "the server was restarted; reload the page\n\
     chương trình đã được mở lại; hãy tải lại trang",
);

/// The body of a guest is larger than [`GUEST_BODY_LIMIT`].
const GUEST_TOO_LARGE: Rejection = (
    StatusCode::PAYLOAD_TOO_LARGE,
    "the request is too large: at most 16 KiB are accepted\n\
     yêu cầu quá lớn: chỉ nhận nhiều nhất 16 KiB",
);
/// The body of the user is larger than [`BODY_LIMIT`].
const TOO_LARGE: Rejection = (
    StatusCode::PAYLOAD_TOO_LARGE,
    "the request is too large: at most 256 KiB are accepted\n\
     yêu cầu quá lớn: chỉ nhận nhiều nhất 256 KiB",
);
/// The body did not arrive in time.
const TOO_SLOW: Rejection = (
    StatusCode::REQUEST_TIMEOUT,
    "the request took too long to arrive\n\
     yêu cầu đến quá chậm",
);

/// Rejects unauthorised requests and adds the security headers to every response. A request that is passed on has the
/// path below the path of its session.
pub(super) async fn guard(
    State(access): State<Arc<AccessControl>>,
    mut request: Request,
    next: Next,
) -> Response {
    let shows_html = asks_for_page(request.headers());
    let checked = match check(&access, &request) {
        Ok(uri) => {
            let is_file = takes_files(&access, &uri);
            *request.uri_mut() = uri;
            let (limit, too_large) = if access.is_guest() {
                (GUEST_BODY_LIMIT, GUEST_TOO_LARGE)
            } else {
                (BODY_LIMIT, TOO_LARGE)
            };
            if is_file {
                Ok(request)
            } else {
                with_whole_body(request, limit, too_large).await
            }
        }
        Err(rejection) => Err(rejection),
    };
    let mut response = match checked {
        Ok(request) => next.run(request).await,
        Err((status, _)) if shows_html && status == NO_SESSION.0 => {
            (status, Html(closed_page(&access.entrance).into_string())).into_response()
        }
        Err(rejection) => rejection.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Checks a request. Returns its address for the handlers.
fn check(access: &AccessControl, request: &Request) -> Result<Uri, Rejection> {
    let headers = request.headers();
    let host = text(headers, header::HOST).ok_or(WRONG_HOST)?;
    if !access.hosts.iter().any(|allowed| allowed == host) {
        return Err(WRONG_HOST);
    }
    let is_read = matches!(*request.method(), Method::GET | Method::HEAD);
    let path = request.uri().path();
    if is_read && [START, SESSION_SCRIPT, SESSION_STYLE, ICON].contains(&path) {
        return Ok(request.uri().clone());
    }
    let is_own = || {
        let origin = text(headers, header::ORIGIN);
        origin.and_then(|origin| origin.strip_prefix("http://")) == Some(host)
    };
    // The button of an invitation. Its secret is the token, and a form of a page without referrer sends the origin `null`.
    if access.is_guest() && *request.method() == Method::POST && path == START {
        let is_null = text(headers, header::ORIGIN) == Some("null");
        return (is_null || is_own())
            .then(|| request.uri().clone())
            .ok_or(WRONG_ORIGIN);
    }
    let page = access.session.page(path).ok_or(NO_SESSION)?;
    if !text(headers, header::COOKIE).is_some_and(|cookie| access.session.has_cookie(cookie)) {
        return Err(NO_SESSION);
    }
    let uri = page_uri(page, request.uri().query()).map_err(|_invalid| NO_SESSION)?;
    if is_read {
        return Ok(uri);
    }
    if !is_own() {
        return Err(WRONG_ORIGIN);
    }
    let kind = text(headers, header::CONTENT_TYPE).and_then(|kind| kind.split(';').next());
    let (wanted, other_kind) = if takes_files(access, &uri) {
        ("application/octet-stream", NO_FILE)
    } else {
        ("application/json", NO_JSON)
    };
    if kind.map(str::trim) != Some(wanted) {
        return Err(other_kind);
    }
    let token = text(headers, CSRF_HEADER);
    if !token.is_some_and(|token| access.session.is_csrf_token(token)) {
        return Err(WRONG_TOKEN);
    }
    Ok(uri)
}

/// Returns whether the body of a request for a page is passed on as it arrives.
fn takes_files(access: &AccessControl, page: &Uri) -> bool {
    !access.is_guest() && page.path().starts_with(FILES)
}

/// Returns the address of a page with the query of a request.
fn page_uri(page: &str, query: Option<&str>) -> Result<Uri, InvalidUri> {
    match query {
        Some(query) => format!("{page}?{query}").parse(),
        None => page.parse(),
    }
}

/// Returns whether the `Accept` header asks for a page, as browsers do for an address that a person opens.
pub fn asks_for_page(headers: &HeaderMap) -> bool {
    text(headers, header::ACCEPT).is_some_and(|accepted| accepted.contains("text/html"))
}

/// Reads the whole body first, so that no handler waits for a slow client. Rejects one beyond the limit with `too_large`.
async fn with_whole_body(
    request: Request,
    limit: usize,
    too_large: Rejection,
) -> Result<Request, Rejection> {
    let (head, body) = request.into_parts();
    let longest = BODY_TIMEOUT * time_scale("MOCBAN_LIMIT_FACTOR");
    match tokio::time::timeout(longest, to_bytes(body, limit)).await {
        Ok(Ok(body)) => Ok(Request::from_parts(head, body.into())),
        // Also returned if the client closed the connection, but then nobody reads it.
        Ok(Err(_)) => Err(too_large),
        Err(_) => Err(TOO_SLOW),
    }
}

fn text(headers: &HeaderMap, name: impl AsHeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

#[cfg(test)]
mod tests {
    use super::{
        GUEST_TOO_LARGE, NO_FILE, NO_JSON, NO_SESSION, TOO_LARGE, TOO_SLOW, WRONG_HOST,
        WRONG_ORIGIN, WRONG_TOKEN,
    };

    #[test]
    fn rejections_have_a_line_in_each_language() {
        for (status, text) in [
            WRONG_HOST,
            NO_SESSION,
            WRONG_ORIGIN,
            NO_JSON,
            NO_FILE,
            WRONG_TOKEN,
            GUEST_TOO_LARGE,
            TOO_LARGE,
            TOO_SLOW,
        ] {
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!(lines.len(), 2, "{status}: {text}");
            let [english, vietnamese] = [lines[0], lines[1]].map(str::is_ascii);
            assert!(english && !vietnamese, "{status}: {text}");
        }
    }
}
