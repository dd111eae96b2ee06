//! Web servers of this machine: checked requests, limited connections, and sessions.
//!
//! [`LocalServer`] binds a port and serves the routes of pages behind the guard of one session. The session opens
//! at the start address, which works once; its pages are below a secret path. [`GuestServer`] has a session for each person who
//! was invited. A server without a session, such as that of the metrics, wraps its routes with [`ServedNames::guarded`].

mod access_control;
mod address;
mod connection;
mod connections;
mod guard;
mod guarded_pages;
mod guest_server;
mod host_check;
mod page_frame;
mod server;
mod session;
mod work_thread;

/// Fails if an asset loads something from another host, or runs text as code.
#[cfg(test)]
pub(crate) fn assert_loads_nothing(name: &str, text: &str) {
    // The XML namespace of icons is not fetched.
    let text = text.replace("http://www.w3.org/2000/svg", "");
    for outside in [
        "http:",
        "https:",
        "//cdn",
        "@import",
        "eval(",
        "sourceMappingURL",
    ] {
        assert!(!text.contains(outside), "{name} has {outside}");
    }
}

pub use access_control::AccessControl;
pub use address::{listen, network_address};
pub use connection::ConnectionLimits;
pub use connections::serve;
pub use guard::asks_for_page;
pub use guarded_pages::respond;
pub use guest_server::{Guest, GuestServer};
pub use host_check::ServedNames;
pub use page_frame::document;
pub use server::{LocalServer, ServerError};
pub use work_thread::{WorkFailed, WorkThread};
