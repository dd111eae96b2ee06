//! An aligned block whose page is open, and its pictures that are read ahead of requests.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use axum::body::Bytes;
use tokio::task::JoinSet;

use super::block_pictures::BlockPictures;
use crate::local_server::WorkThread;
use mocban_core::locked;
use mocban_export::block_view::{AlignedBlock, BlockView, PageLayer, PageRegion};

/// Tasks that read ahead of requests. They are cancelled when this is dropped.
#[derive(Debug, Default)]
struct ReadAhead(Mutex<JoinSet<()>>);

impl ReadAhead {
    /// Starts a task. Its result, or its error, is returned by the request for the same picture.
    fn begin<T>(&self, work: impl Future<Output = T> + Send + 'static) {
        let work = async move {
            work.await;
        };
        locked(&self.0).spawn(work);
    }
}

/// An aligned block with its pictures, as long as its page is open.
#[derive(Debug)]
pub(super) struct ShownBlock {
    pub(super) pictures: Arc<BlockPictures>,
    read_ahead: ReadAhead,
    /// Whether the layers were read or are being read.
    has_layers: AtomicBool,
}

impl ShownBlock {
    /// Begins to draw the page, before the browser asks for its picture.
    pub(super) fn begin(block: AlignedBlock, dir: PathBuf, work: Arc<WorkThread>) -> Arc<Self> {
        let shown = Self::with(BlockPictures::new(block, dir, work), false);
        let first = Arc::clone(&shown.pictures);
        shown
            .read_ahead
            .begin(async move { first.overview(PageLayer::Page).await });
        shown
    }

    /// Starts with the files of all layers.
    pub(super) fn of(view: BlockView, dir: PathBuf, work: Arc<WorkThread>) -> Arc<Self> {
        Self::with(BlockPictures::of(view, dir, work), true)
    }

    fn with(pictures: Arc<BlockPictures>, has_layers: bool) -> Arc<Self> {
        Arc::new(Self {
            pictures,
            read_ahead: ReadAhead::default(),
            has_layers: AtomicBool::new(has_layers),
        })
    }

    /// Begins to read the files of the layers, once. They take the thread of the pictures for seconds, so the page asks for this
    /// only when it shows enough.
    pub(super) fn read_layers(&self) {
        if !self.has_layers.swap(true, Ordering::Relaxed) {
            let pictures = Arc::clone(&self.pictures);
            self.read_ahead
                .begin(async move { pictures.layers().await });
        }
    }

    /// Draws a region as [`BlockPictures::region`] does, and then begins to read the layers.
    pub(super) async fn region(
        &self,
        layer: PageLayer,
        region: PageRegion,
    ) -> Result<Option<Bytes>, String> {
        let drawn = self.pictures.region(layer, region).await;
        self.read_layers();
        drawn
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::oneshot;

    use super::ReadAhead;

    #[tokio::test]
    async fn reading_ahead_ends_with_the_page() {
        let read_ahead = ReadAhead::default();
        let (begun, begins) = oneshot::channel();
        let (held, ended) = oneshot::channel::<()>();
        read_ahead.begin(async move {
            let _held = held;
            begun.send(()).expect("a receiver");
            std::future::pending::<()>().await;
        });
        begins.await.expect("it begins");
        drop(read_ahead);
        ended.await.expect_err("nothing is sent any more");
    }
}
