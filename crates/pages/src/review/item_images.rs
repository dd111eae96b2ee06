//! Images of an item as PNG, rendered once and cached. Attention checks are rendered like results.
//!
//! The page never shows a print larger than [`IMAGE_SIDE`] pixels, even when it zooms in. Therefore only the rendered
//! images are cached. Prints are decoded one at a time, and dropped once their image is rendered.

use std::sync::Arc;

use axum::body::Bytes;
use serde::Deserialize;
use tokio::sync::{Mutex, Semaphore};

use super::alignment_inputs::{AlignmentInputs, PlacedRelief, require_current};
use super::cache_slots::CacheSlots;
use super::image_error::ImageError;
use super::item::ReviewItem;
use crate::local_server::WorkThread;
use mocban_align::stages::normalize::PrintMasks;
use mocban_align::stages::register::StrokeMap;
use mocban_catalog::{Catalog, PairResults};
use mocban_core::InputLimits;
use mocban_core::domain::{Affine2, Stage};
use mocban_core::raster::{self, MaskOverlap, png_grey8, png_mask, png_rgb8};
use mocban_export::SourcePrint;
use mocban_export::pictures::PrintView;
use mocban_export::scan_view::ScanView;
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::Project;

/// Longer side of an image in pixels.
pub(super) const IMAGE_SIDE: usize = 640;

/// One of the images of an item, by its name in URLs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ImageLayer {
    /// The print.
    Print,
    /// Ink mask of the print.
    PrintMask,
    /// Shaded relief in the print's frame.
    Relief,
    /// Stroke mask of the relief in the print's frame.
    DepthMask,
    /// Where mask and ink disagree, in the print's frame; values as in [`StrokeMap`].
    StrokeMap,
    /// Shaded relief in the depth map's frame, for manual alignment.
    DepthFrameRelief,
    /// Stroke mask in the depth map's frame.
    DepthFrameMask,
    /// Ink mask on the canvas on which scores are computed.
    CanvasMask,
}

/// The encoded images of an item, and their frame.
#[derive(Debug)]
pub(super) struct ItemImages {
    /// Frame of the images.
    pub(super) view: PrintView,
    /// Print pixels to pixels of the canvas on which scores are computed.
    pub(super) canvas_from_print: Affine2,
    /// Scores of the alignment that the item shows.
    pub(super) scores: MaskOverlap,
    print: Bytes,
    print_mask: Bytes,
    relief: Bytes,
    depth_mask: Bytes,
    stroke_map: Bytes,
}

impl ItemImages {
    fn render(
        project: &Project,
        pair: &PairResults,
        item: &ReviewItem,
        limits: &raster::ImageLimits,
    ) -> Result<Self, ImageError> {
        let aligned = PairArtifacts::new(project, pair);
        let inputs = AlignmentInputs::read(&aligned, item)?;
        let (view, print) = {
            let source = SourcePrint::read(project, pair, limits)?;
            let view = PrintView::of_side(&source.picture, IMAGE_SIDE);
            (view, png_rgb8(&view.print(&source.picture)))
        };
        let print_from_depth = &item.view.print_from_depth;
        let masks = PrintMasks::from_grey(&aligned.print_grey()?, aligned.mask_scale()?);
        let print_mask = view.mask(&masks.ink_of_print(), &Affine2::IDENTITY);
        Ok(Self {
            view,
            canvas_from_print: inputs.canvas_from_print,
            scores: inputs.mask_overlap(print_from_depth),
            print: exact(print),
            print_mask: exact(png_mask(&print_mask)),
            relief: exact(png_rgb8(&view.relief(&inputs.depth, print_from_depth))),
            depth_mask: exact(png_mask(&view.mask(&inputs.strokes, print_from_depth))),
            stroke_map: exact(stroke_map(&view, &inputs, &masks, item)),
        })
    }

    /// Returns the number of bytes of the images.
    const fn bytes(&self) -> usize {
        self.print.len()
            + self.print_mask.len()
            + self.relief.len()
            + self.depth_mask.len()
            + self.stroke_map.len()
    }
}

/// Returns an image without spare capacity, because [`ItemImages::bytes`] counts only its length.
fn exact(image: Vec<u8>) -> Bytes {
    image.into_boxed_slice().into()
}

/// Draws where the mask and the ink of an item disagree. The map is computed again from the alignment that the item
/// shows, because no map of an attention check is stored.
fn stroke_map(
    view: &PrintView,
    inputs: &AlignmentInputs,
    masks: &PrintMasks,
    item: &ReviewItem,
) -> Vec<u8> {
    let map = StrokeMap::of_alignment(
        &inputs.depth,
        masks,
        &inputs.canvas_from_print,
        &item.view.print_from_depth,
        inputs.canvas_mask.width() as u32,
        item.view.level,
    );
    let print_from_canvas = inputs.canvas_from_print.inverse();
    let print_from_canvas = print_from_canvas.unwrap_or(Affine2::IDENTITY);
    png_grey8(&view.labels(&map.grey, StrokeMap::DISAGREEMENTS, &print_from_canvas))
}

/// Renders the images of items and caches the latest.
#[derive(Debug)]
pub(super) struct ImageCache {
    catalog: Catalog,
    project: Project,
    limits: InputLimits,
    slots: Mutex<CacheSlots<ItemImages>>,
    pictures: WorkLane,
    alignments: WorkLane,
}

/// A thread, on which one item at a time is read.
#[derive(Debug)]
struct WorkLane {
    /// Permits one item at a time to read its results, its print or its artifacts.
    reading: Semaphore,
    work: Arc<WorkThread>,
}

impl WorkLane {
    const fn new(work: Arc<WorkThread>) -> Self {
        Self {
            reading: Semaphore::const_new(1),
            work,
        }
    }
}

impl ImageCache {
    /// Creates an empty cache. Pictures of whole prints are drawn on a thread of their own; `quick` is the thread for work
    /// that takes milliseconds and needs no print.
    pub(super) fn new(
        catalog: Catalog,
        project: Project,
        limits: InputLimits,
        quick: Arc<WorkThread>,
    ) -> Self {
        Self {
            catalog,
            project,
            limits,
            slots: Mutex::default(),
            pictures: WorkLane::new(Arc::default()),
            alignments: WorkLane::new(quick),
        }
    }

    /// Returns an image as PNG. Layers for manual alignment are rendered on demand, because they are rarely needed.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn layer(
        &self,
        item: &Arc<ReviewItem>,
        layer: ImageLayer,
    ) -> Result<Bytes, ImageError> {
        Ok(match layer {
            ImageLayer::Print => self.of(item).await?.print.clone(),
            ImageLayer::PrintMask => self.of(item).await?.print_mask.clone(),
            ImageLayer::Relief => self.of(item).await?.relief.clone(),
            ImageLayer::DepthMask => self.of(item).await?.depth_mask.clone(),
            ImageLayer::StrokeMap => self.of(item).await?.stroke_map.clone(),
            ImageLayer::DepthFrameRelief => self.draw(item, AlignmentInputs::relief).await?,
            ImageLayer::DepthFrameMask => {
                self.draw(item, |inputs| png_mask(&inputs.strokes)).await?
            }
            ImageLayer::CanvasMask => {
                self.draw(item, |inputs| png_mask(&inputs.canvas_mask))
                    .await?
            }
        })
    }

    /// Returns the images of an item. Concurrent requests for one item share one rendering.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn of(&self, item: &Arc<ReviewItem>) -> Result<Arc<ItemImages>, ImageError> {
        let slot = self.slots.lock().await.entry(&item.id);
        let render = async || {
            let limits = self.limits.image;
            let render = move |project: &Project, pair: &PairResults, item: &ReviewItem| {
                ItemImages::render(project, pair, item, &limits)
            };
            let images = Arc::new(self.read(&self.pictures, item, render).await?);
            self.slots.lock().await.add(&item.id, images.bytes());
            Ok(images)
        };
        let images = slot.get_or_try_init(render).await.map(Arc::clone);
        if images.is_err() {
            self.slots.lock().await.remove_failed(&item.id, slot);
        }
        images
    }

    /// Draws an image for the manual alignment of an item.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    async fn draw(
        &self,
        item: &Arc<ReviewItem>,
        draw: impl FnOnce(&AlignmentInputs) -> Vec<u8> + Send + 'static,
    ) -> Result<Bytes, ImageError> {
        let read = move |project: &Project, pair: &PairResults, item: &ReviewItem| {
            let inputs = AlignmentInputs::read(&PairArtifacts::new(project, pair), item)?;
            Ok(draw(&inputs).into())
        };
        self.read(&self.alignments, item, read).await
    }

    /// Checks that the pair of an item still has the result that the item shows.
    ///
    /// # Errors
    /// Returns an error if the pair has a new result, or no complete result.
    pub(super) async fn require_current(&self, item: &Arc<ReviewItem>) -> Result<(), ImageError> {
        let read = |project: &Project, pair: &PairResults, item: &ReviewItem| {
            require_current(&PairArtifacts::new(project, pair), item)
        };
        self.read(&self.alignments, item, read).await
    }

    /// Computes what is stored with a manual alignment that places the relief by `print_from_depth`.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn place(
        &self,
        item: &Arc<ReviewItem>,
        print_from_depth: Affine2,
    ) -> Result<PlacedRelief, ImageError> {
        let read = move |project: &Project, pair: &PairResults, item: &ReviewItem| {
            let artifacts = PairArtifacts::new(project, pair);
            let inputs = AlignmentInputs::read(&artifacts, item)?;
            Ok(PlacedRelief {
                scores: inputs.mask_overlap(&print_from_depth),
                print_from_mesh: artifacts.print_from_mesh(&print_from_depth)?,
                mesh_hash: artifacts.stage(Stage::Fit)?.mesh_hash,
            })
        };
        self.read(&self.alignments, item, read).await
    }

    /// Returns the data of the 3D view of an item. It does not name the pair.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn scan_view(&self, item: &Arc<ReviewItem>) -> Result<Vec<u8>, ImageError> {
        let limits = self.limits;
        let read = move |project: &Project, pair: &PairResults, item: &ReviewItem| {
            AlignmentInputs::read(&PairArtifacts::new(project, pair), item)?;
            let (metric, _) = item.results.first().ok_or(ImageError::Gone)?;
            let (map, level) = (&item.view.print_from_depth, item.view.level);
            let view = ScanView::of_alignment(project, pair, *metric, map, level, limits)?;
            Ok(view.ok_or(ImageError::Gone)?.to_bytes())
        };
        self.read(&self.pictures, item, read).await
    }

    /// Calls `read` with the current results of the item's pair, on the thread of a lane. One call of a lane runs at a time.
    async fn read<T: Send + 'static>(
        &self,
        lane: &WorkLane,
        item: &Arc<ReviewItem>,
        read: impl FnOnce(&Project, &PairResults, &ReviewItem) -> Result<T, ImageError> + Send + 'static,
    ) -> Result<T, ImageError> {
        let permit = lane.reading.acquire().await;
        let _permit = permit.map_err(|_closed| ImageError::Gone)?;
        let found = self.catalog.pair(&item.pair).await?;
        let pair = found.ok_or(ImageError::Gone)?.results;
        if pair.next_stage.is_some() {
            return Err(ImageError::Incomplete);
        }
        let (project, item) = (self.project.clone(), Arc::clone(item));
        let work = move || read(&project, &pair, &item);
        lane.work.call(work).await?
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{ImageCache, ImageLayer};
    use crate::review::image_error::ImageError;
    use crate::review::item::test_fixtures::item;
    use mocban_catalog::Catalog;
    use mocban_core::InputLimits;
    use mocban_core::mesh::MeshLimits;
    use mocban_core::raster::ImageLimits;
    use mocban_store::Project;

    #[tokio::test]
    async fn a_manual_alignment_does_not_wait_for_pictures() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(dir.path());
        let catalog = Catalog::create(&project.catalog_path()).await;
        let limits = InputLimits {
            mesh: MeshLimits::SUGGESTED,
            image: ImageLimits::SUGGESTED,
        };
        let cache = ImageCache::new(catalog.expect("a catalog"), project, limits, Arc::default());
        let item = Arc::new(item(1));
        let busy = cache.pictures.reading.acquire().await.expect("a permit");
        {
            let picture = cache.of(&item);
            tokio::pin!(picture);
            assert!(futures_util::poll!(&mut picture).is_pending());
            // The pair is not in the catalog.
            let current = cache.require_current(&item).await;
            assert!(matches!(current, Err(ImageError::Gone)), "{current:?}");
            assert!(futures_util::poll!(&mut picture).is_pending());
        }
        drop(busy);
        assert!(matches!(cache.of(&item).await, Err(ImageError::Gone)));
    }

    #[test]
    fn layers_are_found_by_name_and_nothing_else_is() {
        let layer = |name: &str| serde_json::from_value::<ImageLayer>(name.into()).ok();
        assert_eq!(layer("print-mask"), Some(ImageLayer::PrintMask));
        assert_eq!(
            layer("depth-frame-relief"),
            Some(ImageLayer::DepthFrameRelief)
        );
        for name in ["", "PRINT", "../print", "print.png"] {
            assert_eq!(layer(name), None, "{name}");
        }
    }
}
