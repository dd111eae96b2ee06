//! Signals: the first one lets a run finish its current stages, the second stops it at once.

use tokio::signal::unix::{SignalKind, signal};
use tokio::task::JoinHandle;

use crate::runner::Stop;

/// Watches Ctrl-C, SIGTERM and a closed terminal until the handle is aborted.
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
