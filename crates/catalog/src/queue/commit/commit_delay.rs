//! The delay of commits. If no caller waits for a reply, a commit is delayed so that later requests can share it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::time::Instant;

/// Longest delay of a commit. A process that is killed loses the stages that it finished during the delay.
const LONGEST: Duration = Duration::from_millis(250);

/// The delay, and how many callers currently forbid it.
#[derive(Debug)]
pub(crate) struct CommitDelay {
    longest: Duration,
    waiting: AtomicUsize,
}

impl CommitDelay {
    /// Returns the delay of a run.
    pub(crate) fn new() -> Arc<Self> {
        Self::of(LONGEST)
    }

    /// Returns a delay of this length.
    pub(crate) fn of(longest: Duration) -> Arc<Self> {
        let waiting = AtomicUsize::new(0);
        Arc::new(Self { longest, waiting })
    }

    /// Returns when the delay of a commit ends, or `None` if a caller waits.
    pub(crate) fn until(&self) -> Option<Instant> {
        let nobody = self.waiting.load(Ordering::Relaxed) == 0;
        nobody.then(|| Instant::now() + self.longest)
    }
}

/// Turns the commit delay off while it lives.
#[derive(Debug)]
pub struct Waiting(Arc<CommitDelay>);

impl Waiting {
    /// Turns the delay off until the result is dropped.
    pub(crate) fn new(delay: &Arc<CommitDelay>) -> Self {
        delay.waiting.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(delay))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}
