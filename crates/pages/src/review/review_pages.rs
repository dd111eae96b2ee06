//! The pages of one reviewer: reads the queue, and gives the routes for a server.

use std::sync::Arc;

use axum::Router;

use super::history::ReviewerHistory;
use super::image_cache::ImageCache;
use super::item::ReviewItem;
use super::options::ReviewOptions;
use super::picture_work::PictureWork;
use super::planted_faults::{FaultPlanter, FaultShortage, QueueError};
use super::routes;
use super::state::ServerState;
use super::unstored::UnstoredEvents;
use crate::local_server::WorkFailed;
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::explained_by_cause;
use mocban_store::Project;

/// Why the queue cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReviewError {
    /// The catalog cannot be read.
    #[error("cannot read the review queue: {0}")]
    Catalog(#[source] CatalogError),
    /// An attention check could not be planted.
    #[error("cannot plant an attention check: {0}")]
    Fault(WorkFailed),
}

explained_by_cause! { ReviewError: Catalog }

/// The pages of a reviewer, with the queue at their start.
#[derive(Debug)]
pub struct ReviewPages {
    state: Arc<ServerState>,
    counts: QueueCounts,
    shortage: Option<FaultShortage>,
}

/// Number of items in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueCounts {
    /// All items.
    pub items: usize,
    /// Items that show results. All other items are attention checks.
    pub results: usize,
    /// Items that the reviewer has answered.
    pub answered: usize,
}

impl QueueCounts {
    fn of(items: &[Arc<ReviewItem>], history: &ReviewerHistory) -> Self {
        let count = |is: &dyn Fn(&ReviewItem) -> bool| items.iter().filter(|item| is(item)).count();
        Self {
            items: items.len(),
            results: count(&|item| item.check.is_none()),
            answered: count(&|item| history.answer(item).is_some()),
        }
    }
}

impl ReviewPages {
    /// Reads the queue of a reviewer. `work` is for all reviews of the server.
    ///
    /// # Errors
    /// Returns an error if the queue cannot be read.
    pub async fn open(
        catalog: Catalog,
        project: Project,
        options: ReviewOptions,
        work: Arc<PictureWork>,
    ) -> Result<Self, ReviewError> {
        let quick = Arc::clone(&work.quick.work);
        let (read, files) = (catalog.clone(), project.clone());
        let state = ServerState {
            planter: FaultPlanter::new(read.clone(), files.clone(), quick),
            images: ImageCache::new(read, files, options.limits, work),
            catalog,
            project,
            options,
            unstored: UnstoredEvents::default(),
            served_items: std::sync::Mutex::default(),
            current_items: std::sync::Mutex::default(),
        };
        // Loads the items now: after a restart, a page may resend an answer before it requests the queue.
        let queue = state.load_queue().await.map_err(|error| match error {
            QueueError::Catalog(error) => ReviewError::Catalog(error),
            QueueError::Stopped(error) => ReviewError::Fault(error),
        })?;
        Ok(Self {
            counts: QueueCounts::of(&queue.items, &queue.history),
            shortage: queue.shortage,
            state: Arc::new(state),
        })
    }

    /// Returns the number of items in the queue.
    pub const fn counts(&self) -> QueueCounts {
        self.counts
    }

    /// Returns how many items of the queue that was read last the reviewer has answered by now.
    ///
    /// # Errors
    /// Returns an error if the answers cannot be read.
    pub async fn progress(&self) -> Result<QueueCounts, CatalogError> {
        let (items, reviewer) = (
            self.state.current_items(),
            &self.state.options.queue.reviewer,
        );
        let history = ReviewerHistory::answers(&self.state.catalog, reviewer).await?;
        Ok(QueueCounts::of(&items, &history))
    }

    /// Returns whether the reviewer has answered every item by now. Returns `false` if that cannot be read.
    pub async fn is_finished(&self) -> bool {
        let queue = self.state.load_queue().await;
        queue.is_ok_and(|queue| {
            let mut items = queue.items.iter();
            items.all(|item| queue.history.answer(item).is_some())
        })
    }

    /// Returns whether fewer faults could be planted than wanted.
    pub const fn shortage(&self) -> Option<&FaultShortage> {
        self.shortage.as_ref()
    }

    /// Returns the routes of the pages.
    pub fn routes(&self) -> Router {
        routes::router(&self.state)
    }

    /// Returns the number of requests that browsers keep because they are not stored.
    pub fn unstored(&self) -> usize {
        self.state.unstored.count()
    }
}

/// Returns a name that is the same on every start for a project and reviewer. The browser keeps unsaved answers per
/// origin, so a restarted server needs the same port to receive these answers.
pub fn origin_name(project: &Project, reviewer: &str) -> String {
    let dir = project.dir();
    let dir = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    format!("{}\0{reviewer}", dir.display())
}
