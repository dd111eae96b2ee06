//! What differs between operating systems, and the points at which tests make a process die.
//!
//! - [`platform`]: identity of files, syncing, memory of the process, signals, time during which the process runs
//! - [`failpoint`]: named points of a run
//!
//! Every call fails if the operating system refuses it. `# Errors` names other reasons.
//!
//! **Invariant:** no other crate names an operating system in production code, apart from `cfg` of Linux.

pub mod failpoint;
pub mod platform;
