//! Waiting for what other processes have locked, over and above the database's own waiting.

use std::path::Path;
use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep};

use super::{Result, Trouble, holder};

/// How long in all.
const PATIENCE: Duration = Duration::from_mins(1);
/// After so long it is said who is waited for.
const SILENCE: Duration = Duration::from_secs(5);
/// Between two tries: some locks are refused at once.
const BETWEEN: Duration = Duration::from_millis(5);

/// Tries again for as long as others have the catalog locked, so that "busy" reaches no caller before its time.
pub(super) struct Patience<'p> {
    catalog: &'p Path,
    begun: Instant,
    is_told: bool,
}

impl<'p> Patience<'p> {
    /// From now on, with this catalog.
    pub(super) fn begin(catalog: &'p Path) -> Self {
        Self {
            catalog,
            begun: Instant::now(),
            is_told: false,
        }
    }

    /// What to wait for before the next try; `None` where this was the last one.
    pub(super) fn wait<T>(&mut self, outcome: &Result<T>) -> Option<Sleep> {
        let error = outcome.as_ref().err()?;
        let waited = self.begun.elapsed();
        if error.trouble() != Some(Trouble::Busy) || waited >= PATIENCE {
            return None;
        }
        tracing::debug!(%error, "the catalog is busy, waiting");
        if waited >= SILENCE && !self.is_told {
            self.is_told = true;
            self.tell();
        }
        Some(sleep(BETWEEN))
    }

    fn tell(&self) {
        let catalog = self.catalog.display();
        let by = holder(self.catalog)
            .map_or_else(|| "another process".to_owned(), |holder| holder.to_string());
        tracing::warn!("{catalog} is kept locked by {by}; waiting");
    }
}
