//! Who may use a server: the accepted host names and the session.

use std::net::SocketAddr;

use super::address::hosts;
use super::session::{START, Session};

/// How a person comes to the start address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Entrance {
    /// A command printed it.
    Command,
    /// Somebody sent it as an invitation. `place` is the last segment of the path of the session, of 16 hexadecimal digits. It
    /// stays the same if the link is replaced, so a browser knows which of its sessions and unsaved answers belong together.
    Invitation {
        /// Empty for a session that nobody opens.
        place: String,
    },
}

impl Entrance {
    /// Returns the last segment of the path of the session; empty if there is none.
    pub(super) fn place(&self) -> &str {
        match self {
            Self::Command => "",
            Self::Invitation { place } => place,
        }
    }
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
            session: Session::new(page, address.port(), entrance.place())?,
            entrance,
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

    /// Returns whether the session is that of a person who was invited.
    pub const fn is_guest(&self) -> bool {
        matches!(self.entrance, Entrance::Invitation { .. })
    }

    /// Returns the CSRF token that writes must carry.
    pub fn csrf_token(&self) -> &str {
        &self.session.csrf_token
    }
}
