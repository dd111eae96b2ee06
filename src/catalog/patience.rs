//! Waiting for what other processes have locked, over and above the database's own waiting.

use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep};

use super::{Result, Trouble};

/// How long in all.
const PATIENCE: Duration = Duration::from_mins(1);
/// Between two tries: some locks are refused at once.
const BETWEEN: Duration = Duration::from_millis(5);

/// Tries again for as long as others have the catalog locked, so that "busy" reaches no caller before its time.
pub(super) struct Patience(Instant);

impl Patience {
    /// From now on.
    pub(super) fn begin() -> Self {
        Self(Instant::now() + PATIENCE)
    }

    /// What to wait for before the next try; `None` where this was the last one.
    pub(super) fn wait<T>(&self, outcome: &Result<T>) -> Option<Sleep> {
        let error = outcome.as_ref().err()?;
        if error.trouble() != Some(Trouble::Busy) || Instant::now() >= self.0 {
            return None;
        }
        tracing::debug!(%error, "the catalog is busy, waiting");
        Some(sleep(BETWEEN))
    }
}
