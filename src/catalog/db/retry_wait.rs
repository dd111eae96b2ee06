//! Waits between attempts to reach a database server that is unavailable.

use std::hash::{BuildHasher as _, RandomState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::Notify;

use crate::catalog::db::error::CatalogError;
use crate::failpoint;

/// First wait before another attempt.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// Longest wait. A random factor of at most 1.5 spreads the attempts of many processes. A worker that waits must not be
/// taken for dead: see `runner/liveness.rs`.
const LONGEST_WAIT: Duration = Duration::from_secs(3);

/// Whether this process retries while its database server is unavailable.
#[derive(Debug, Default)]
pub(crate) struct RetryWait {
    is_stopped: AtomicBool,
    stopped: Notify,
}

impl RetryWait {
    /// Ends all waits, now and later.
    pub(crate) fn stop(&self) {
        self.is_stopped.store(true, Ordering::Release);
        self.stopped.notify_waiters();
    }

    /// Waits after the failed attempt `attempt`, counted from 0, and logs the first error. Returns `false` at once after
    /// [`Self::stop`].
    pub(crate) async fn wait(&self, attempt: u32, error: &CatalogError) -> bool {
        if attempt == 0 {
            tracing::warn!(%error, "the database server is unavailable; waiting");
        }
        let doubled = FIRST_WAIT.saturating_mul(1 << attempt.min(16));
        // Between 0.5 and 1.5. The standard library seeds each state at random.
        let random = RandomState::new().hash_one(attempt) >> 32;
        let factor = 0.5 + random as f64 / f64::from(u32::MAX);
        let longest = LONGEST_WAIT / failpoint::time_scale("MOCBAN_TIME_SCALE");
        let wait = tokio::time::sleep(doubled.min(longest).mul_f64(factor));
        let stopped = self.stopped.notified();
        if self.is_stopped.load(Ordering::Acquire) {
            return false;
        }
        tokio::select! {
            () = wait => true,
            () = stopped => false,
        }
    }
}
