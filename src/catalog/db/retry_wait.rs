//! Waits for a database server that is away: restarted, unreachable, or behind a broken network.

use std::hash::{BuildHasher as _, RandomState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::Notify;

/// First wait before another attempt.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// Longest wait. Each wait is multiplied with a random factor, so that many processes do not come back together.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// Whether a process still waits for its server.
#[derive(Debug, Default)]
pub(crate) struct RetryWait {
    is_given_up: AtomicBool,
    given_up: Notify,
}

impl RetryWait {
    /// Ends all waits, now and later.
    pub(crate) fn give_up(&self) {
        self.is_given_up.store(true, Ordering::Release);
        self.given_up.notify_waiters();
    }

    /// Waits before attempt `attempt`, from 0. Returns `false`, at once, if nobody waits any more.
    pub(crate) async fn wait(&self, attempt: u32) -> bool {
        let doubled = FIRST_WAIT.saturating_mul(1 << attempt.min(16));
        // Between 0.5 and 1.5. The standard library seeds each state at random.
        let random = RandomState::new().hash_one(attempt) >> 32;
        let factor = 0.5 + random as f64 / f64::from(u32::MAX);
        let wait = tokio::time::sleep(doubled.min(LONGEST_WAIT).mul_f64(factor));
        let given_up = self.given_up.notified();
        if self.is_given_up.load(Ordering::Acquire) {
            return false;
        }
        tokio::select! {
            () = wait => true,
            () = given_up => false,
        }
    }
}
