//! Session secrets: a one-time token that opens the session, the path of its pages, its cookie, and a CSRF token.

use std::sync::atomic::{AtomicBool, Ordering};

use rand::TryRng as _;
use rand::rngs::SysRng;

use mocban_core::domain::ContentHash;

/// Path that accepts the one-time token.
pub(super) const START: &str = "/start";
/// Path of the script that opens the page of the browser's session. It is no secret.
pub(super) const SESSION_SCRIPT: &str = "/session.js";
/// Path of the style of pages without a session. It is no secret.
pub(super) const SESSION_STYLE: &str = "/session.css";
/// Path of the icon of all pages. It is no secret.
pub(super) const ICON: &str = "/icon.svg";

/// Start of the paths of all sessions.
const PATHS: &str = "/s/";

/// Secrets of one session: of a start of the server, or of a guest.
///
/// A request needs both the cookie and the path. Browsers send a cookie to all ports of a host, but send the
/// path of a page to no other server. The history of the browser has the path, but not the cookie.
#[derive(Debug)]
pub(super) struct Session {
    /// The one-time token of the start address.
    pub(super) token: String,
    /// Path below which the pages are, without a slash at the end.
    pub(super) path: String,
    cookie: String,
    pub(super) csrf_token: String,
    cookie_name: String,
    is_opened: AtomicBool,
}

impl Session {
    /// Draws new secrets from the operating system. Cookies are named after the page and its port.
    /// The path ends with `place`, if it has any.
    pub(super) fn new(page: &str, port: u16, place: &str) -> std::io::Result<Self> {
        let place = if place.is_empty() {
            String::new()
        } else {
            format!("/{place}")
        };
        Ok(Self {
            token: secret()?,
            path: format!("{PATHS}{}{place}", secret()?),
            cookie: secret()?,
            csrf_token: secret()?,
            cookie_name: format!("mocban_{page}_{port}"),
            is_opened: AtomicBool::new(false),
        })
    }

    /// Accepts the one-time token. Returns `false` if the token is wrong or was already used.
    pub(super) fn open(&self, token: &str) -> bool {
        self.has_token(token) && !self.is_opened.swap(true, Ordering::SeqCst)
    }

    /// Returns the value of the `Set-Cookie` header. The browser sends the cookie only with the path of the session, so
    /// other ports do not get it.
    pub(super) fn set_cookie(&self) -> String {
        let (name, value, path) = (&self.cookie_name, &self.cookie, &self.path);
        format!("{name}={value}; HttpOnly; SameSite=Strict; Path={path}")
    }

    /// Returns whether the one-time token has been used.
    pub(super) fn is_opened(&self) -> bool {
        self.is_opened.load(Ordering::SeqCst)
    }

    /// Returns whether a token would open the session now.
    pub(super) fn is_open_to(&self, token: &str) -> bool {
        self.has_token(token) && !self.is_opened()
    }

    /// Returns whether a token is that of this session, used or not.
    pub(super) fn has_token(&self, token: &str) -> bool {
        is_equal(token, &self.token)
    }

    /// Returns whether a `Cookie` header contains the session cookie.
    pub(super) fn has_cookie(&self, header: &str) -> bool {
        let mut pairs = header
            .split(';')
            .filter_map(|pair| pair.trim().split_once('='));
        pairs.any(|(name, value)| name == self.cookie_name && is_equal(value, &self.cookie))
    }

    /// Returns the part of a path below the path of the session; `None` for any other path.
    pub(super) fn page<'p>(&self, path: &'p str) -> Option<&'p str> {
        let (prefix, page) = path.split_at_checked(self.path.len())?;
        (page.starts_with('/') && is_equal(prefix, &self.path)).then_some(page)
    }

    /// Returns whether the CSRF token is right.
    pub(super) fn is_csrf_token(&self, token: &str) -> bool {
        is_equal(token, &self.csrf_token)
    }
}

/// Returns 256 random bits in hexadecimal.
fn secret() -> std::io::Result<String> {
    let mut bytes = [0; 32];
    SysRng
        .try_fill_bytes(&mut bytes)
        .map_err(std::io::Error::other)?;
    Ok(ContentHash::from_bytes(bytes).to_hex())
}

/// Compares two secrets by their hashes, so that the time taken does not depend on where the secrets differ.
fn is_equal(a: &str, b: &str) -> bool {
    ContentHash::of(a.as_bytes()) == ContentHash::of(b.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::Session;

    fn session() -> Session {
        Session::new("review", 8000, "").expect("secrets")
    }

    #[test]
    fn token_opens_once_and_only_itself() {
        let session = session();
        assert!(!session.open("") && !session.open("guess"));
        let token = session.token.clone();
        assert_eq!(token.len(), 64);
        assert!(session.open(&token));
        assert!(!session.open(&token));
    }

    #[test]
    fn cookie_is_found_among_others_and_by_its_port() {
        let session = session();
        let set = session.set_cookie();
        let ours = set.split(';').next().expect("name and value");
        assert!(set.contains("HttpOnly") && set.contains("SameSite=Strict"));
        assert!(session.has_cookie(&format!("a=b; {ours}; c=d")));
        assert!(!session.has_cookie("mocban_review_8000=; x"));
        assert!(!session.has_cookie(&ours.replace("8000", "8001")));
        assert!(!self::session().has_cookie(ours));
    }

    #[test]
    fn only_paths_below_the_secret_one_are_pages() {
        let session = session();
        let below = |rest: &str| format!("{}{rest}", session.path);
        assert_eq!(session.page(&below("/")), Some("/"));
        assert_eq!(session.page(&below("/api/queue")), Some("/api/queue"));
        let other = format!("{}/", self::session().path);
        for wrong in [
            "",
            "/",
            "/s/",
            "/api/queue",
            "/ữ",
            &below(""),
            &below("x/"),
            &other,
        ] {
            assert_eq!(session.page(wrong), None, "{wrong}");
        }
        assert!(
            session.set_cookie().ends_with(&below("")),
            "no other port gets it"
        );
    }
}
