//! Waits for other processes.

use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

use crate::cli::status;

/// Longest wait for what other processes, servers and browsers do. It only ends a test that would wait without end, so it is
/// longer than a busy machine needs.
pub(crate) const LONGEST: Duration = Duration::from_mins(10);

/// Variable with which a command waits for hours for requests, for their confirmation and for statements on a server. A test
/// shows then, at any speed, that something else does not wait for them.
pub(crate) const PATIENT: (&str, &str) = ("MOCBAN_LIMIT_FACTOR", "1000");

/// Variable with which a command waits for minutes for a connection to a database server.
pub(crate) const PATIENT_CONNECT: (&str, &str) = ("MOCBAN_CONNECT_FACTOR", "60");

/// Pauses between two looks at what another process brings about. Without a pause, a test that waits takes a core from
/// the processes that it waits for.
///
/// Not for a state that may be over in milliseconds: tests that wait for one yield instead.
pub(crate) fn pause() {
    std::thread::sleep(Duration::from_millis(5));
}

/// Waits until a process brings about what a condition looks for. It must not end before.
#[track_caller]
pub(crate) fn until(child: &mut Child, condition: impl Fn() -> bool) {
    loop {
        // Asked for first, because the last act of the process may be what is waited for.
        let ended = child.try_wait().expect("a child");
        if condition() {
            return;
        }
        assert_eq!(ended, None, "it ended");
        pause();
    }
}

/// Waits until something is so.
#[track_caller]
pub(crate) fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let deadline = Instant::now() + LONGEST;
    while !is_so() {
        assert!(Instant::now() < deadline, "never: {what}");
        pause();
    }
}

/// Waits until no run works on a project.
#[track_caller]
pub(crate) fn run_ends(project: &Path) {
    wait_until("the run ends", || status(project)["running"] == false);
}
