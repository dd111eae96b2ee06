//! The pictures of an aligned block: its image of the page, and the layers that need more time.

use std::path::PathBuf;
use std::sync::Arc;

use axum::body::Bytes;

use super::read_once::ReadOnce;
use crate::local_server::WorkThread;
use mocban_export::block_view::{
    AlignedBlock, BlockView, BlockViewError, DecodedPage, PageLayer, PageLayers, PageRegion,
};
use mocban_project::ProjectError;

/// Longer side of the image of a whole layer or of a region, pixels. Closer views ask for regions, which show a smaller
/// part and so never have fewer pixels.
const LONGEST_SIDE: usize = 3000;
/// Longer side of the image of the whole page, which is seen first, pixels. It is sharp in a window of this size, and has a
/// fifth of the pixels; larger windows and closer views then ask for regions.
const FIRST_SIDE: usize = 1280;

/// An aligned block, with the pictures of it that were asked for.
#[derive(Debug)]
pub(super) struct BlockPictures {
    pub(super) block: AlignedBlock,
    /// Reads files and draws, one picture after another.
    pub(super) work: Arc<WorkThread>,
    /// Folder of the project, which errors name.
    dir: PathBuf,
    page: ReadOnce<DecodedPage>,
    layers: ReadOnce<PageLayers>,
    overviews: [ReadOnce<Bytes>; PageLayer::ALL.len()],
}

impl BlockPictures {
    /// Starts without pictures. Reads nothing.
    pub(super) fn new(block: AlignedBlock, dir: PathBuf, work: Arc<WorkThread>) -> Arc<Self> {
        Arc::new(Self {
            block,
            work,
            dir,
            page: ReadOnce::default(),
            layers: ReadOnce::default(),
            overviews: PageLayer::ALL.map(|_| ReadOnce::default()),
        })
    }

    /// Starts with the files of all layers.
    pub(super) fn of(view: BlockView, dir: PathBuf, work: Arc<WorkThread>) -> Arc<Self> {
        let BlockView { block, layers } = view;
        Arc::new(Self {
            block,
            work,
            dir,
            page: ReadOnce::of(DecodedPage::of_layers(&layers)),
            layers: ReadOnce::of(layers),
            overviews: PageLayer::ALL.map(|_| ReadOnce::default()),
        })
    }

    /// Returns the image of the page. Returns a sentence if it cannot be read.
    pub(super) async fn page(self: &Arc<Self>) -> Result<Arc<DecodedPage>, String> {
        self.page
            .get(|| self.read(|own| own.block.read_page()))
            .await
    }

    /// Returns what the other layers show. Returns a sentence if a file cannot be read.
    pub(super) async fn layers(self: &Arc<Self>) -> Result<Arc<PageLayers>, String> {
        let page = self.page().await?;
        let read = move |own: &Self| own.block.read_layers(&page);
        self.layers.get(|| self.read(read)).await
    }

    /// Reads files on the thread for long work.
    async fn read<T: Send + 'static>(
        self: &Arc<Self>,
        read: impl FnOnce(&Self) -> Result<T, BlockViewError> + Send + 'static,
    ) -> Result<T, String> {
        let own = Arc::clone(self);
        let read = self.work.call(move || read(&own)).await;
        let read = read.map_err(|error| error.to_string())?;
        read.map_err(|error| ProjectError::from(error).text(&self.dir))
    }

    /// Returns the image of a whole layer as JPEG, which is drawn once. Returns a sentence if a file cannot be read.
    pub(super) async fn overview(
        self: &Arc<Self>,
        layer: PageLayer,
    ) -> Result<Option<Bytes>, String> {
        let at = PageLayer::ALL.iter().position(|one| *one == layer);
        let Some(stored) = at.and_then(|at| self.overviews.get(at)) else {
            return Ok(None);
        };
        let whole = self.page().await?.whole();
        let longest = match layer {
            PageLayer::Page => FIRST_SIDE,
            PageLayer::Relief | PageLayer::Overlay => LONGEST_SIDE,
        };
        let drawn = stored.get(|| self.draw(layer, whole, longest)).await?;
        Ok(Some((*drawn).clone()))
    }

    /// Draws the part of a layer that lies in a region as JPEG; `None` if the region lies beside the page. Returns a sentence
    /// if a file cannot be read.
    pub(super) async fn region(
        self: &Arc<Self>,
        layer: PageLayer,
        region: PageRegion,
    ) -> Result<Option<Bytes>, String> {
        match region.within(self.page().await?.size()) {
            Some(part) => Ok(Some(self.draw(layer, part, LONGEST_SIDE).await?)),
            None => Ok(None),
        }
    }

    /// Draws a region of a layer as JPEG on the thread for long work. Its longer side has at most `longest` pixels.
    async fn draw(
        self: &Arc<Self>,
        layer: PageLayer,
        region: PageRegion,
        longest: usize,
    ) -> Result<Bytes, String> {
        let drawn = if layer == PageLayer::Page {
            let page = self.page().await?;
            self.work.call(move || page.jpeg(region, longest)).await
        } else {
            let layers = self.layers().await?;
            let draw = move || layers.jpeg(layer, region, longest);
            self.work.call(draw).await
        };
        drawn.map(Bytes::from).map_err(|error| error.to_string())
    }
}
