//! An aligned block whose page is open: what is read for it before it is asked for.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use axum::body::Bytes;
use tokio::task::JoinSet;

use super::block_pictures::BlockPictures;
use crate::local_server::WorkThread;
use mocban_core::locked;
use mocban_export::block_view::{AlignedBlock, BlockView, PageLayer, PageRegion};

/// Work before it is asked for. It is cancelled when this is dropped.
#[derive(Debug, Default)]
struct EarlyWork(Mutex<JoinSet<()>>);

impl EarlyWork {
    /// Begins work. What it returns is asked for later, also why it failed.
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
    early: EarlyWork,
    /// Whether the layers were read or are being read.
    has_layers: AtomicBool,
}

impl ShownBlock {
    /// Begins to draw the page, so that its picture is there earlier than if its request began it.
    pub(super) fn begin(block: AlignedBlock, dir: PathBuf, work: Arc<WorkThread>) -> Arc<Self> {
        let shown = Self::with(BlockPictures::new(block, dir, work), false);
        let first = Arc::clone(&shown.pictures);
        shown
            .early
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
            early: EarlyWork::default(),
            has_layers: AtomicBool::new(has_layers),
        })
    }

    /// Begins to read the files of the layers, once. They take the thread of the pictures for seconds, so the page asks for this
    /// only when it shows enough.
    pub(super) fn read_layers(&self) {
        if !self.has_layers.swap(true, Ordering::Relaxed) {
            let pictures = Arc::clone(&self.pictures);
            self.early.begin(async move { pictures.layers().await });
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

    use super::EarlyWork;

    #[tokio::test]
    async fn early_work_ends_with_the_page() {
        let early = EarlyWork::default();
        let (begun, begins) = oneshot::channel();
        let (held, ended) = oneshot::channel::<()>();
        early.begin(async move {
            let _held = held;
            begun.send(()).expect("a receiver");
            std::future::pending::<()>().await;
        });
        begins.await.expect("it begins");
        drop(early);
        ended.await.expect_err("nothing is sent any more");
    }
}
