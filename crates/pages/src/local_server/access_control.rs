//! Who may use a server: the accepted host names and the session.

use std::net::SocketAddr;

use super::address::hosts;
use super::session::{START, Session};

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
}
