//! Waits for other processes.

use std::time::Duration;

/// Pauses between two looks at what another process brings about. Without a pause, a test that waits takes a core from
/// the processes that it waits for.
pub(crate) fn pause() {
    std::thread::sleep(Duration::from_millis(5));
}
