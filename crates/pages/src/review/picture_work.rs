//! What the reviews of a server share, so that their memory has one bound: the rendered images, and the threads that draw.

use std::sync::Arc;

use tokio::sync::{Mutex, Semaphore};

use super::cache_slots::CacheSlots;
use super::item_images::ItemImages;
use crate::local_server::WorkThread;
use mocban_core::domain::ContentHash;

/// The rendered images and the threads of all reviews of a server.
#[derive(Debug)]
pub struct PictureWork {
    pub(super) slots: Mutex<CacheSlots<ItemImages>>,
    /// Each reads one print or scan at a time.
    pictures: Vec<WorkLane>,
    /// For work that takes milliseconds and needs no print.
    pub(super) quick: WorkLane,
}

/// A thread, on which one item at a time is read.
#[derive(Debug)]
pub(super) struct WorkLane {
    /// Permits one item at a time to read its results, its print or its artifacts.
    pub(super) reading: Semaphore,
    pub(super) work: Arc<WorkThread>,
}

impl WorkLane {
    fn new() -> Self {
        Self {
            reading: Semaphore::const_new(1),
            work: Arc::default(),
        }
    }
}

impl PictureWork {
    /// Serves one reviewer: one print at a time, and 32 MiB of images. The page keeps the newest ones itself.
    pub fn for_one() -> Self {
        Self::new(1, 32 << 20)
    }

    /// Serves many reviewers: two prints at a time, and 64 MiB of images, however many there are. An image that several of
    /// them see is rendered once.
    pub fn for_many() -> Self {
        Self::new(2, 64 << 20)
    }

    fn new(pictures: usize, cached_bytes: usize) -> Self {
        Self {
            slots: Mutex::new(CacheSlots::new(cached_bytes)),
            pictures: std::iter::repeat_with(WorkLane::new)
                .take(pictures)
                .collect(),
            quick: WorkLane::new(),
        }
    }

    /// Returns the lane for a view of a pair.
    pub(super) fn lane_of(&self, view: &ContentHash) -> &WorkLane {
        let number = usize::from(view.as_bytes()[0]);
        &self.pictures[number % self.pictures.len()]
    }
}
