//! Waiting for company: a request that can wait does so for a while, for others to share its commit.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::time::Instant;

use crate::catalog::db::error::Result;
use crate::catalog::db::writer::Message;
use crate::catalog::handle::Catalog;

/// How long a request that can wait does so at most. A process that is killed loses what it finished in that time.
const LONGEST: Duration = Duration::from_millis(250);

/// Who waits for whom, as the writer and those who send to it know it.
#[derive(Debug)]
pub(crate) struct Company {
    longest: Duration,
    waiting: AtomicUsize,
}

impl Company {
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

/// Somebody who waits for what was sent to the catalog: as long as this lives, no commit waits for company.
#[derive(Debug)]
pub struct Waiting(Arc<Company>);

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Catalog {
    /// Has stored at once what was sent, and what is sent while the answer lives.
    ///
    /// # Errors
    /// When the catalog is closed.
    pub async fn waiting(&self) -> Result<Waiting> {
        self.company.waiting.fetch_add(1, Ordering::Relaxed);
        let waiting = Waiting(Arc::clone(&self.company));
        self.send(Message::Hurry).await?;
        Ok(waiting)
    }
}
