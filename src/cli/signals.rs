//! Ctrl-C, SIGTERM and a closed terminal: the first drains the run, the second stops it now.

use tokio::signal::unix::{SignalKind, signal};
use tokio::task::JoinHandle;

use crate::runner::Stop;

/// Watches for signals until the handle is aborted.
///
/// # Errors
/// When the system refuses a handler.
pub(super) fn watch(stop: &Stop) -> std::io::Result<JoinHandle<()>> {
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    let stop = stop.clone();
    Ok(tokio::spawn(async move {
        loop {
            tokio::select! {
                Some(()) = interrupt.recv() => stop.escalate(),
                Some(()) = terminate.recv() => stop.escalate(),
                Some(()) = hang_up.recv() => stop.escalate(),
                else => return,
            };
        }
    }))
}
