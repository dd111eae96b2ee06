//! Who may use a server: the accepted host names and the session.

use std::net::SocketAddr;

use super::address::hosts;
use super::session::{START, Session};

/// How a person comes to the start address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entrance {
    /// A command printed it.
    Command,
    /// Somebody sent it as an invitation.
    Invitation,
}

/// The accepted host names and the session of a server.
#[derive(Debug)]
pub struct AccessControl {
    address: SocketAddr,
    pub(super) entrance: Entrance,
    pub(super) session: Session,
    /// Accepted values of the `Host` header, with port.
    pub(super) hosts: Vec<String>,
}

impl AccessControl {
    /// Draws the secrets of a session on a server that is bound to `address`. Cookies are named after `page`.
    pub(super) fn new(
        page: &str,
        address: SocketAddr,
        entrance: Entrance,
    ) -> std::io::Result<Self> {
        Ok(Self {
            address,
            entrance,
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
