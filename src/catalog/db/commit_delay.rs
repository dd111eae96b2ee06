//! Waiting for delay: a request that can wait does so for a while, for others to share its commit.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::time::Instant;

/// How long a request that can wait does so at most. A process that is killed loses what it finished in that time.
const LONGEST: Duration = Duration::from_millis(250);

/// Who waits for whom, as the writer and those who send to it know it.
#[derive(Debug)]
pub(crate) struct CommitDelay {
    longest: Duration,
    waiting: AtomicUsize,
}

impl CommitDelay {
    /// As in a run.
    pub(crate) fn new() -> Arc<Self> {
        Self::of(LONGEST)
    }

    /// Requests that can wait do so for this long.
    pub(crate) fn of(longest: Duration) -> Arc<Self> {
        let waiting = AtomicUsize::new(0);
        Arc::new(Self { longest, waiting })
    }

    /// Until when to wait for others; `None` where somebody waits already.
    pub(crate) fn until(&self) -> Option<Instant> {
        let nobody = self.waiting.load(Ordering::Relaxed) == 0;
        nobody.then(|| Instant::now() + self.longest)
    }
}

/// Somebody who waits for what was sent to the catalog: as long as this lives, no commit waits for delay.
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
