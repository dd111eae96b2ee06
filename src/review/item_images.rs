//! Images of an item as PNG, rendered once and cached. Attention checks are rendered like results.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use serde::Deserialize;
use tokio::sync::{Mutex, OnceCell};

use super::item::ReviewItem;
use crate::catalog::{Catalog, CatalogError, PairResults};
use crate::domain::{Affine2, Stage};
use crate::export::pictures::{PrintView, shaded};
use crate::export::{SourcePrint, SourcePrintError};
use crate::raster::{self, DepthMap, Mask, png_mask, png_rgb8};
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// Longer side of an image in pixels.
pub(super) const IMAGE_SIDE: usize = 640;
/// Number of items whose images are cached.
const CACHED_ITEMS: usize = 48;

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
    /// Shaded relief in the depth map's frame, for manual alignment.
    DepthFrameRelief,
    /// Stroke mask in the depth map's frame.
    DepthFrameMask,
    /// Ink mask on the canvas on which scores are computed.
    CanvasMask,
}

/// Why the images of an item cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub(super) enum ImageError {
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
    #[error(transparent)]
    Print(#[from] SourcePrintError),
    /// The pair has a new result.
    #[error("this pair has a new result; reload the page")]
    Gone,
    #[error("rendering stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// The canvas on which the scores of a pair are computed.
#[derive(Debug)]
pub(super) struct ScoreCanvas {
    pub(super) print_mask: Mask,
    pub(super) from_print: Affine2,
}

/// Everything an item shows, read from the project.
#[derive(Debug)]
pub(super) struct ItemInputs {
    pub(super) print: SourcePrint,
    print_mask: Mask,
    pub(super) canvas: ScoreCanvas,
    pub(super) depth: DepthMap,
    pub(super) strokes: Mask,
}

impl ItemInputs {
    fn read(
        project: &Project,
        pair: &PairResults,
        item: &ReviewItem,
        limits: &raster::ImageLimits,
    ) -> Result<Self, ImageError> {
        let aligned = PairArtifacts::new(project, pair);
        let hashes = (
            aligned.stage(Stage::Depth)?.result_hash,
            aligned.stage(Stage::Normalize)?.print_hash,
        );
        if hashes != (item.view.depth_hash, Some(item.view.print_hash)) {
            return Err(ImageError::Gone);
        }
        let depth = aligned.depth()?;
        Ok(Self {
            print: SourcePrint::read(project, pair, limits)?,
            print_mask: aligned.print_mask()?,
            canvas: ScoreCanvas {
                print_mask: aligned.canvas_print_mask()?,
                from_print: aligned.canvas_from_print()?,
            },
            strokes: depth.stroke_mask(item.view.level),
            depth,
        })
    }

    /// Returns the frame of the rendered images.
    pub(super) fn view(&self) -> PrintView {
        PrintView::of_side(&self.print.picture, IMAGE_SIDE)
    }
}

/// The encoded images of an item, and what they were rendered from.
#[derive(Debug)]
pub(super) struct ItemImages {
    pub(super) inputs: ItemInputs,
    print: Vec<u8>,
    print_mask: Vec<u8>,
    relief: Vec<u8>,
    depth_mask: Vec<u8>,
}

impl ItemImages {
    fn render(inputs: ItemInputs, print_from_depth: &Affine2) -> Self {
        let view = inputs.view();
        Self {
            print: png_rgb8(&view.print(&inputs.print.picture)),
            print_mask: png_mask(&view.mask(&inputs.print_mask, &Affine2::IDENTITY)),
            relief: png_rgb8(&view.relief(&inputs.depth, print_from_depth)),
            depth_mask: png_mask(&view.mask(&inputs.strokes, print_from_depth)),
            inputs,
        }
    }

    /// Returns an image as PNG. Layers for manual alignment are rendered on demand, because they are rarely needed.
    pub(super) fn layer(&self, layer: ImageLayer) -> Vec<u8> {
        match layer {
            ImageLayer::Print => self.print.clone(),
            ImageLayer::PrintMask => self.print_mask.clone(),
            ImageLayer::Relief => self.relief.clone(),
            ImageLayer::DepthMask => self.depth_mask.clone(),
            ImageLayer::DepthFrameRelief => {
                let depth = &self.inputs.depth;
                let slope = depth.scale.height_per_level / depth.scale.mesh_unit_per_px;
                png_rgb8(&shaded(&depth.levels, slope))
            }
            ImageLayer::DepthFrameMask => png_mask(&self.inputs.strokes),
            ImageLayer::CanvasMask => png_mask(&self.inputs.canvas.print_mask),
        }
    }
}

/// Renders the images of items and caches the latest.
#[derive(Debug)]
pub(super) struct ImageCache {
    catalog: Catalog,
    project: Project,
    limits: raster::ImageLimits,
    slots: Mutex<CacheSlots>,
}

/// Cache entries by item id. The oldest entry is evicted first.
#[derive(Debug, Default)]
struct CacheSlots {
    images: BTreeMap<String, Arc<OnceCell<Arc<ItemImages>>>>,
    /// Item ids, oldest first.
    order: VecDeque<String>,
}

impl CacheSlots {
    /// Returns the entry of an item, evicting the oldest entry for a new one.
    fn entry(&mut self, id: &str) -> Arc<OnceCell<Arc<ItemImages>>> {
        if !self.images.contains_key(id) {
            self.order.push_back(id.to_owned());
            if self.order.len() > CACHED_ITEMS
                && let Some(oldest) = self.order.pop_front()
            {
                self.images.remove(&oldest);
            }
        }
        Arc::clone(self.images.entry(id.to_owned()).or_default())
    }
}

impl ImageCache {
    pub(super) fn new(catalog: Catalog, project: Project, limits: raster::ImageLimits) -> Self {
        Self {
            catalog,
            project,
            limits,
            slots: Mutex::default(),
        }
    }

    /// Returns the images of an item. Concurrent requests for one item share one rendering.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn of(&self, item: &Arc<ReviewItem>) -> Result<Arc<ItemImages>, ImageError> {
        let entry = self.slots.lock().await.entry(&item.id);
        let images = entry.get_or_try_init(|| self.render(item)).await?;
        Ok(Arc::clone(images))
    }

    async fn render(&self, item: &Arc<ReviewItem>) -> Result<Arc<ItemImages>, ImageError> {
        let found = self.catalog.pair(&item.pair).await?;
        let pair = found.ok_or(ImageError::Gone)?.results;
        let (project, limits, item) = (self.project.clone(), self.limits, Arc::clone(item));
        tokio::task::spawn_blocking(move || {
            let inputs = ItemInputs::read(&project, &pair, &item, &limits)?;
            let images = ItemImages::render(inputs, &item.view.print_from_depth);
            Ok(Arc::new(images))
        })
        .await?
    }
}

#[cfg(test)]
mod tests {
    use super::{CACHED_ITEMS, CacheSlots, ImageLayer};

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

    #[test]
    fn the_oldest_entry_is_evicted() {
        let mut slots = CacheSlots::default();
        for i in 0..=CACHED_ITEMS {
            slots.entry(&i.to_string());
        }
        slots.entry("1");
        assert_eq!(slots.images.len(), CACHED_ITEMS);
        assert!(!slots.images.contains_key("0") && slots.images.contains_key("1"));
    }
}
