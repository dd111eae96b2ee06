//! The pages that a person opens in the browser.
//!
//! - [`app`]: the projects of a folder: state, runs, pairs, reviews
//! - [`review`]: verdicts, manual alignments, attention checks
//! - [`view`]: one scan on its print in 3D, or a whole block with its page and control points
//! - [`local_server`]: what all have in common: a server for the browser of one user, with its session, its guard
//!   against other pages, connection limits and the frame of its pages
//! - `messages`: sentences of the other crates in Vietnamese
//!
//! Every call fails if the catalog cannot be read. `# Errors` names other reasons.
//!
//! **Invariant:** a request changes nothing unless it comes from a page of this server in a session of this server.

pub mod app;
mod digit_groups;
mod embedded;
pub mod local_server;
mod messages;
mod on_thread;
mod report_language;
pub mod review;
pub mod view;

pub use report_language::report_page;
