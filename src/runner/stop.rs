//! Stopping a run from outside: first a drain, then at once.

use tokio::sync::watch;

/// How a run is asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StopLevel {
    /// Not at all.
    Go,
    /// Finish the stages in hand, claim nothing new.
    Drain,
    /// Stop now; stages in hand are lost, what is stored stays.
    Now,
}

/// A handle that signal handlers and the run share.
#[derive(Debug, Clone)]
pub struct Stop {
    level: watch::Sender<StopLevel>,
}

impl Default for Stop {
    fn default() -> Self {
        Self::new()
    }
}

impl Stop {
    /// A handle that asks for nothing yet.
    pub fn new() -> Self {
        Self {
            level: watch::Sender::new(StopLevel::Go),
        }
    }

    /// One step further: the first call drains, the second stops now. Gives the new level.
    pub fn escalate(&self) -> StopLevel {
        self.level.send_modify(|level| {
            *level = match level {
                StopLevel::Go => StopLevel::Drain,
                StopLevel::Drain | StopLevel::Now => StopLevel::Now,
            };
        });
        self.level()
    }

    /// Asks for at least a drain.
    pub fn drain(&self) {
        self.level
            .send_modify(|level| *level = (*level).max(StopLevel::Drain));
    }

    /// What is asked for.
    pub fn level(&self) -> StopLevel {
        *self.level.borrow()
    }

    /// Waits until at least this much is asked for.
    pub async fn reached(&self, level: StopLevel) {
        let mut receiver = self.level.subscribe();
        // The sender lives in `self`, so the channel cannot close while we wait.
        let _ = receiver.wait_for(|now| *now >= level).await;
    }
}
