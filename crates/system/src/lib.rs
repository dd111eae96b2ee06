//! What differs between operating systems and computers, and the points at which tests make a process die.
//!
//! - [`platform`]: identity of files, syncing, memory of the process, signals, time during which the process runs
//! - [`failpoint`]: named points of a run
//! - [`time_text`]: times and durations as text, in the time zone of the computer
//!
//! Every call fails if the operating system refuses it. `# Errors` names other reasons.
//!
//! **Invariant:** other crates name an operating system only for the spelling of paths and to open the browser, and in `cfg` of Linux.

pub mod failpoint;
pub mod platform;
pub mod time_text;
