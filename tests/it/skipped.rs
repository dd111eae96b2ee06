//! Says which tests are skipped because a program is not installed.

use std::io::Write as _;

/// Writes on stderr that the test of this thread is skipped, or a part of it, and why. Writes directly, because the test
/// harness hides what a passing test prints.
pub(crate) fn say_skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    let line = format!("skipped: {test}: {why}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
}
