//! Signals: the first one lets a run finish its current stages, the second stops it at once.

use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::task::JoinHandle;

use crate::runner::Stop;

/// Watches Ctrl-C, SIGTERM and a closed terminal until the handle is aborted. SIGHUP stays ignored if it was ignored
/// when this process started, as under `nohup`.
pub(super) fn watch(stop: &Stop) -> std::io::Result<JoinHandle<()>> {
    let is_ignored = IgnoredSignals::of_this_process().contains(SignalKind::hangup());
    let hang_up = (!is_ignored).then(|| signal(SignalKind::hangup()));
    let mut hang_up = hang_up.transpose()?;
    let mut interrupt = Some(signal(SignalKind::interrupt())?);
    let mut terminate = Some(signal(SignalKind::terminate())?);
    let stop = stop.clone();
    Ok(tokio::spawn(async move {
        loop {
            tokio::select! {
                () = next(&mut interrupt) => stop.escalate(),
                () = next(&mut terminate) => stop.escalate(),
                () = next(&mut hang_up) => stop.escalate(),
            };
        }
    }))
}

/// Waits for a signal. Never returns if the signal is not watched.
async fn next(signal: &mut Option<Signal>) {
    let received = match signal {
        Some(signal) => signal.recv().await,
        None => None,
    };
    if received.is_none() {
        std::future::pending::<()>().await;
    }
}

/// The signals that this process ignores, as a bit mask in which bit 0 is signal 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct IgnoredSignals(u64);

impl IgnoredSignals {
    /// Reads the mask that Linux shows (`proc_pid_status(5)`). On other systems no signal counts as ignored.
    fn of_this_process() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        Self::parse(&status)
    }

    fn parse(status: &str) -> Self {
        let mask = status
            .lines()
            .find_map(|line| line.strip_prefix("SigIgn:"))
            .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        Self(mask.unwrap_or(0))
    }

    fn contains(self, kind: SignalKind) -> bool {
        let bit = kind.as_raw_value() - 1;
        self.0 >> bit & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use tokio::signal::unix::SignalKind;

    use super::IgnoredSignals;

    #[test]
    fn ignored_signals_are_read_from_the_mask() {
        let ignored =
            IgnoredSignals::parse("SigBlk:\t0000000000000002\nSigIgn:\t0000000000001001\n");
        assert!(ignored.contains(SignalKind::hangup()));
        assert!(!ignored.contains(SignalKind::interrupt()));
        assert!(!ignored.contains(SignalKind::terminate()));
        assert_eq!(IgnoredSignals::parse("Name:\tmocban\n"), IgnoredSignals(0));
    }
}
