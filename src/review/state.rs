//! Server state shared by the request handlers: the catalog, the reviewer's options, the items served so far.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::i18n::Language;
use super::item::ReviewItem;
use super::item_images::{ImageCache, ImageError, ItemImages};
use super::queue_options::QueueOptions;
use super::review_queue::{QueueError, ReviewQueue};
use super::session::Session;
use crate::catalog::Catalog;
use crate::domain::UnixMillis;
use crate::store::Project;

/// State of one reviewer's server.
#[derive(Debug)]
pub(super) struct ServerState {
    pub(super) catalog: Catalog,
    pub(super) project: Project,
    pub(super) queue_options: QueueOptions,
    pub(super) language: Language,
    pub(super) keys: BTreeMap<String, String>,
    pub(super) min_view_ms: u64,
    pub(super) now: fn() -> UnixMillis,
    pub(super) session: Session,
    /// Accepted values of the `Host` header, with port.
    pub(super) hosts: Vec<String>,
    pub(super) images: ImageCache,
    /// Every item served since the start, by id. An answer is accepted even if the results have changed meanwhile.
    pub(super) served_items: Mutex<BTreeMap<String, Arc<ReviewItem>>>,
}

impl ServerState {
    /// Reads the queue from the current state of the catalog and remembers its items.
    ///
    /// # Errors
    /// When the catalog cannot be read.
    pub(super) async fn load_queue(&self) -> Result<ReviewQueue, QueueError> {
        let queue = ReviewQueue::read(&self.catalog, &self.project, &self.queue_options).await?;
        // A poisoned lock still holds a consistent map: each insertion is complete.
        let mut served = self
            .served_items
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        for item in &queue.items {
            served.insert(item.id.clone(), Arc::clone(item));
        }
        Ok(queue)
    }

    /// Returns a served item by its id.
    pub(super) fn item(&self, id: &str) -> Option<Arc<ReviewItem>> {
        let served = self
            .served_items
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        served.get(id).cloned()
    }

    /// Returns the images of an item.
    ///
    /// # Errors
    /// When files of the pair cannot be read.
    pub(super) async fn images(
        &self,
        item: &Arc<ReviewItem>,
    ) -> Result<Arc<ItemImages>, ImageError> {
        self.images.of(item).await
    }
}
