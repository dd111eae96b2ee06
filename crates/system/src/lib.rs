//! What differs between operating systems and computers, and the points at which tests make a process die.
//!
//! - [`platform`]: identity of files, syncing, memory of the process, signals, time during which the process runs
//! - [`failpoint`]: named points of a run
//! - [`time_text`]: times and durations as text, in the time zone of the computer
//!
//! Every call fails if the operating system refuses it. `# Errors` names other reasons.
//!
//! **Invariant:** other crates name an operating system only for the spelling of paths, to open the browser, in `cfg` of
//! Linux, and where they read `/proc`, which others do not have.

pub mod failpoint;
pub mod platform;
pub mod time_text;
