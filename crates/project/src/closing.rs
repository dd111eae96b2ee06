//! Closes the catalog at the end of a command that handles signals itself. What was acknowledged is stored before, so
//! closing may be given up.

use std::time::Duration;

use mocban_catalog::Catalog;
use mocban_runner::{Stop, StopLevel};

/// Maximum time to close the catalog after a signal.
const AFTER_STOP: Duration = Duration::from_secs(2);
/// Maximum time to close the catalog if its server has already failed to reply for the time that a signal allows.
pub const AFTER_SILENCE: Duration = Duration::from_millis(500);

/// Closes the catalog. A first signal gives it `AFTER_STOP`, a second ends the wait at once.
pub async fn close(catalog: Catalog, stop: &Stop) {
    let stopped = async {
        stop.reached(StopLevel::Drain).await;
        tokio::time::sleep(AFTER_STOP).await;
    };
    give_up_after(catalog, stop, stopped).await;
}

/// Closes the catalog within a time. A second signal ends the wait at once.
pub async fn close_within(catalog: Catalog, stop: &Stop, limit: Duration) {
    give_up_after(catalog, stop, tokio::time::sleep(limit)).await;
}

async fn give_up_after(catalog: Catalog, stop: &Stop, limit: impl Future<Output = ()>) {
    tokio::select! {
        () = catalog.close() => {}
        () = limit => tracing::debug!("the catalog does not close"),
        () = stop.reached(StopLevel::Now) => {}
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{close, close_within};
    use mocban_catalog::Catalog;
    use mocban_runner::Stop;

    #[tokio::test]
    async fn closing_does_not_wait_for_a_writer_that_never_replies() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        let catalog = Catalog::create(&path).await.expect("a catalog");
        let _held = catalog.hold().await;
        let stop = Stop::new();
        close_within(catalog.clone(), &stop, Duration::from_millis(1)).await;
        // Two signals.
        stop.escalate();
        stop.escalate();
        close(catalog, &stop).await;
    }

    #[tokio::test]
    async fn closing_without_a_signal_waits_for_the_writer() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        let catalog = Catalog::create(&path).await.expect("a catalog");
        let held = catalog.hold().await;
        let stop = Stop::new();
        let closing = close(catalog, &stop);
        tokio::pin!(closing);
        assert!(futures_util::poll!(&mut closing).is_pending());
        held.send(()).expect("a busy writer");
        closing.await;
    }
}
