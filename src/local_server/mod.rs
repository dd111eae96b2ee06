//! A web server for one user's browser on this machine: checked requests, limited connections, and one session.
//!
//! A page binds its port with [`listen`], passes every request through [`guard`], opens the session at [`START`] with
//! [`AccessControl::start`], and serves its routes with [`serve`].

mod access_control;
mod address;
mod connection;
mod connections;
mod guard;
mod page_frame;
mod request_work;
mod session;

pub use access_control::{AccessControl, START};
pub use address::listen;
pub use connection::ConnectionLimits;
pub use connections::serve;
pub use guard::guard;
pub use page_frame::{document, forward_page, used_token_page};
pub use request_work::run_for_request;
