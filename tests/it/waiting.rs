//! Waits for other processes.

use std::process::Child;
use std::time::{Duration, Instant};

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
    while !condition() {
        assert_eq!(child.try_wait().expect("a child"), None, "it ended");
        pause();
    }
}

/// Waits until something is so.
#[track_caller]
pub(crate) fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_mins(1);
    while !is_so() {
        assert!(Instant::now() < deadline, "never: {what}");
        pause();
    }
}
