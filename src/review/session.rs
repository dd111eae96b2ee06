//! Who may use the page: a token that opens it once, then a cookie; writes need a second word that only the page knows.

use std::sync::atomic::{AtomicBool, Ordering};

use rand::TryRng as _;
use rand::rngs::SysRng;

use crate::domain::ContentHash;

/// The secrets of one start of the server.
#[derive(Debug)]
pub(super) struct Session {
    token: String,
    cookie: String,
    csrf: String,
    cookie_name: String,
    is_opened: AtomicBool,
}

impl Session {
    /// New secrets from the system.
    ///
    /// # Errors
    /// When the system has no randomness.
    pub(super) fn new(port: u16) -> std::io::Result<Self> {
        Ok(Self {
            token: secret()?,
            cookie: secret()?,
            csrf: secret()?,
            // Cookies do not know ports: two servers on one machine must not overwrite each other's.
            cookie_name: format!("mocban_review_{port}"),
            is_opened: AtomicBool::new(false),
        })
    }

    /// The token of the start address.
    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// The word that writes must bring.
    pub(super) fn csrf(&self) -> &str {
        &self.csrf
    }

    /// Takes the token once; from then on it opens nothing.
    pub(super) fn open(&self, token: &str) -> bool {
        same(token, &self.token) && !self.is_opened.swap(true, Ordering::SeqCst)
    }

    /// The cookie as it is set.
    pub(super) fn set_cookie(&self) -> String {
        let (name, value) = (&self.cookie_name, &self.cookie);
        format!("{name}={value}; HttpOnly; SameSite=Strict; Path=/")
    }

    /// Whether a `Cookie` header holds ours.
    pub(super) fn knows(&self, header: &str) -> bool {
        let mut pairs = header
            .split(';')
            .filter_map(|pair| pair.trim().split_once('='));
        pairs.any(|(name, value)| name == self.cookie_name && same(value, &self.cookie))
    }

    /// Whether the word of a write is ours.
    pub(super) fn is_from_page(&self, csrf: &str) -> bool {
        same(csrf, &self.csrf)
    }
}

/// 256 bits in hexadecimal.
fn secret() -> std::io::Result<String> {
    let mut bytes = [0; 32];
    SysRng
        .try_fill_bytes(&mut bytes)
        .map_err(std::io::Error::other)?;
    Ok(ContentHash::from_bytes(bytes).to_hex())
}

/// Compares by hash, so that the time it takes tells nothing of where two words part.
fn same(a: &str, b: &str) -> bool {
    ContentHash::of(a.as_bytes()) == ContentHash::of(b.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::Session;

    #[test]
    fn token_opens_once_and_only_itself() {
        let session = Session::new(8000).expect("secrets");
        assert!(!session.open("") && !session.open("guess"));
        let token = session.token().to_owned();
        assert_eq!(token.len(), 64);
        assert!(session.open(&token));
        assert!(!session.open(&token));
    }

    #[test]
    fn cookie_is_found_among_others_and_by_its_port() {
        let session = Session::new(8000).expect("secrets");
        let set = session.set_cookie();
        let ours = set.split(';').next().expect("name and value");
        assert!(set.contains("HttpOnly") && set.contains("SameSite=Strict"));
        assert!(session.knows(&format!("a=b; {ours}; c=d")));
        assert!(!session.knows("mocban_review_8000=; x"));
        assert!(!session.knows(&ours.replace("8000", "8001")));
        assert!(!Session::new(8000).expect("secrets").knows(ours));
    }
}
