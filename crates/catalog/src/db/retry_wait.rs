//! Waits between attempts to reach a database server that is unavailable, and for its replies.

use std::hash::{BuildHasher as _, RandomState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::Notify;

use crate::db::error::{CatalogError, Result};
use crate::db::query::no_reply;
use mocban_system::failpoint;
use mocban_system::platform::sleep_active;

/// First wait before another attempt.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// Longest wait. A random factor of at most 1.5 spreads the attempts of many processes. A worker that waits must not be
/// taken for dead: see `crates/runner/src/worker_session.rs`.
const LONGEST_WAIT: Duration = Duration::from_secs(3);
/// Time without a reply after which an operation is given up once waits have ended.
const REPLY_AFTER_STOP: Duration = Duration::from_secs(5);
/// The same after an operation was given up, until the server replies again. Longer in unit tests, because a busy machine may
/// need seconds to connect again.
const REPLY_AFTER_SILENCE: Duration = Duration::from_secs(if cfg!(test) { 60 } else { 2 });

/// Whether this process waits while its database server is unavailable, and whether the server replies.
#[derive(Debug, Default)]
pub(crate) struct RetryWait {
    is_stopped: AtomicBool,
    stopped: Notify,
    /// Whether the last operation was given up.
    is_silent: AtomicBool,
}

impl RetryWait {
    /// Ends all waits, now and later.
    pub(crate) fn stop(&self) {
        self.is_stopped.store(true, Ordering::Release);
        self.stopped.notify_waiters();
    }

    /// Returns whether waits have ended.
    fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Acquire)
    }

    /// Returns whether the last operation was given up.
    pub(crate) fn is_silent(&self) -> bool {
        self.is_silent.load(Ordering::Acquire)
    }

    /// Runs an operation on the server. After [`Self::stop`], gives up an operation that has run for 5 s, or for 2 s if the
    /// last one was given up: the network may drop all packets, so that no connection is ever refused. The state of its
    /// connection is then unknown.
    ///
    /// # Errors
    /// Returns the error of the operation, or that there was no reply.
    pub(crate) async fn limit<T>(&self, operation: impl Future<Output = Result<T>>) -> Result<T> {
        let limit = if self.is_silent() {
            REPLY_AFTER_SILENCE
        } else {
            REPLY_AFTER_STOP
        };
        let silence = async {
            sleep_active(limit).await;
            self.stopped().await;
        };
        let outcome = tokio::select! {
            biased;
            outcome = operation => Some(outcome),
            () = silence => None,
        };
        self.is_silent.store(outcome.is_none(), Ordering::Release);
        outcome.unwrap_or_else(|| Err(no_reply(limit).into()))
    }

    /// Waits until waits have ended.
    async fn stopped(&self) {
        let stopped = self.stopped.notified();
        if !self.is_stopped() {
            stopped.await;
        }
    }

    /// Waits after the failed attempt `attempt`, counted from 0, and logs the first error. Returns `false` at once after
    /// [`Self::stop`].
    pub(crate) async fn wait(&self, attempt: u32, error: &CatalogError) -> bool {
        if self.is_stopped() {
            return false;
        }
        if attempt == 0 {
            tracing::warn!(%error, "the database server is unavailable; waiting");
        }
        let doubled = FIRST_WAIT.saturating_mul(1 << attempt.min(16));
        // Between 0.5 and 1.5. The standard library seeds each state at random.
        let random = RandomState::new().hash_one(attempt) >> 32;
        let factor = 0.5 + random as f64 / f64::from(u32::MAX);
        let longest = LONGEST_WAIT / failpoint::time_scale("MOCBAN_TIME_SCALE");
        let wait = tokio::time::sleep(doubled.min(longest).mul_f64(factor));
        tokio::select! {
            () = wait => true,
            () = self.stopped() => false,
        }
    }
}
