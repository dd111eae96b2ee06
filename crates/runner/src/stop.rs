//! Stopping a run from outside: first a drain, then an immediate stop.

use tokio::sync::watch;

/// How a run is asked to stop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum StopLevel {
    /// Not at all.
    #[default]
    Go,
    /// Finish the stages in progress, except if one reads a file or writes to an object store for too long. Start no new
    /// ones.
    Drain,
    /// Stop at once: stages in progress are lost, stored results stay.
    Now,
}

impl StopLevel {
    /// Returns the next more urgent level.
    pub(super) const fn next(self) -> Self {
        match self {
            Self::Go => Self::Drain,
            Self::Drain | Self::Now => Self::Now,
        }
    }
}

/// A stop request that signal handlers and the run share.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    level: watch::Sender<StopLevel>,
}

impl Stop {
    /// No request yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Raises the request by one level: first to a drain, then to an immediate stop. Returns the new level.
    pub fn escalate(&self) -> StopLevel {
        self.level.send_modify(|level| *level = level.next());
        self.level()
    }

    /// Requests a drain, unless more was requested already.
    pub fn drain(&self) {
        self.level
            .send_modify(|level| *level = (*level).max(StopLevel::Drain));
    }

    /// Returns the requested level.
    pub fn level(&self) -> StopLevel {
        *self.level.borrow()
    }

    /// Waits until this level or a higher one is requested.
    pub async fn reached(&self, level: StopLevel) {
        let mut receiver = self.level.subscribe();
        // The sender lives in `self`, so the channel cannot close while this waits.
        let _ = receiver.wait_for(|now| *now >= level).await;
    }
}
