//! Signals: the first one lets a run finish its current stages, the second stops it at once.

use tokio::task::JoinHandle;

use crate::runner::Stop;

/// Watches Ctrl-C, SIGTERM and a closed terminal until the handle is aborted.
#[cfg(unix)]
pub(super) fn watch(stop: &Stop) -> std::io::Result<JoinHandle<()>> {
    use tokio::signal::unix::{SignalKind, signal};
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

/// Watches Ctrl-C until the handle is aborted.
#[cfg(not(unix))]
pub(super) fn watch(stop: &Stop) -> std::io::Result<JoinHandle<()>> {
    let stop = stop.clone();
    Ok(tokio::spawn(async move {
        while tokio::signal::ctrl_c().await.is_ok() {
            stop.escalate();
        }
    }))
}
