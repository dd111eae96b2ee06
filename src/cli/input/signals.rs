//! Signals: the first one lets a run finish its current stages, the second stops it at once.

use tokio::task::JoinHandle;

use mocban_runner::Stop;
use mocban_system::platform;

/// Watches Ctrl-C, a request to end and a closed terminal until the handle is aborted.
pub(crate) fn watch(stop: &Stop) -> std::io::Result<JoinHandle<()>> {
    let stop = stop.clone();
    platform::watch_signals(move || {
        stop.escalate();
    })
}
