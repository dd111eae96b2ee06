//! State shared by the request handlers: the catalog, the reviewer's options, and the items served so far.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use super::image_cache::ImageCache;
use super::item::ReviewItem;
use super::options::ReviewOptions;
use super::planted_faults::{FaultPlanter, QueueError};
use super::review_queue::ReviewQueue;
use super::unstored::UnstoredEvents;
use mocban_catalog::Catalog;
use mocban_core::locked;
use mocban_store::Project;

/// State of one reviewer's pages.
#[derive(Debug)]
pub(super) struct ServerState {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) options: ReviewOptions,
    pub(super) images: ImageCache,
    pub(super) planter: FaultPlanter,
    pub(super) unstored: UnstoredEvents,
    /// Every item served since the server started, by id. Answers to these items are accepted even if their results
    /// were replaced.
    pub(super) served_items: Mutex<BTreeMap<String, Arc<ReviewItem>>>,
    /// The items of the queue that was read last.
    pub(super) current_items: Mutex<Vec<Arc<ReviewItem>>>,
}

impl ServerState {
    /// Reads the queue from the current state of the catalog and remembers its items.
    pub(super) async fn load_queue(&self) -> Result<ReviewQueue, QueueError> {
        let queue = ReviewQueue::read(&self.catalog, &self.planter, &self.options.queue).await?;
        let mut served = locked(&self.served_items);
        for item in &queue.items {
            served.insert(item.id.clone(), Arc::clone(item));
        }
        drop(served);
        locked(&self.current_items).clone_from(&queue.items);
        Ok(queue)
    }

    /// Returns the items of the queue that was read last.
    pub(super) fn current_items(&self) -> Vec<Arc<ReviewItem>> {
        locked(&self.current_items).clone()
    }

    /// Returns a served item by its id.
    pub(super) fn item(&self, id: &str) -> Option<Arc<ReviewItem>> {
        locked(&self.served_items).get(id).cloned()
    }
}
