//! Who may use a server: the accepted host names and the secrets of one start.

use std::net::SocketAddr;

use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse as _, Redirect, Response};

use super::address::hosts;
use super::session::Session;

/// Path that accepts the one-time token.
pub const START: &str = "/start";

/// The accepted host names and the session of a server.
#[derive(Debug)]
pub struct AccessControl {
    address: SocketAddr,
    pub(super) session: Session,
    /// Accepted values of the `Host` header, with port.
    pub(super) hosts: Vec<String>,
}

impl AccessControl {
    /// Draws the secrets of a server that is bound to `address`. Cookies are named after `page`.
    ///
    /// # Errors
    /// Returns an error if the operating system provides no randomness.
    pub fn new(page: &str, address: SocketAddr) -> std::io::Result<Self> {
        Ok(Self {
            address,
            session: Session::new(page, address.port())?,
            hosts: hosts(address),
        })
    }

    /// Returns the start URL with the one-time token.
    pub fn url(&self) -> String {
        format!(
            "http://{}{START}?token={}",
            self.address, self.session.token
        )
    }

    /// Returns the CSRF token that writes must carry.
    pub fn csrf_token(&self) -> &str {
        &self.session.csrf_token
    }

    /// Answers a request of the start address with this query. Accepts the one-time token, sets the session cookie and
    /// responds with `forward`, a page that leads on to `/`. A redirect would not work: a browser sends a
    /// `SameSite=Strict` cookie only if the navigation starts on this site. Responds with `refused` if the token is
    /// wrong or was used before.
    pub fn start(
        &self,
        query: Option<&str>,
        forward: impl FnOnce() -> String,
        refused: impl FnOnce() -> String,
    ) -> Response {
        let token = query.and_then(|query| query.strip_prefix("token="));
        let token = token.unwrap_or_default();
        if self.session.open(token) {
            let cookie = [(header::SET_COOKIE, self.session.set_cookie())];
            return (cookie, Html(forward())).into_response();
        }
        // Without a token, the page opens if the browser already has the cookie.
        if token.is_empty() {
            return Redirect::to("/").into_response();
        }
        (StatusCode::FORBIDDEN, Html(refused())).into_response()
    }
}
