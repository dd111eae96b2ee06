//! The images of the items of a review, rendered once and shared with other reviews of the server.

use std::sync::Arc;

use axum::body::Bytes;

use super::alignment_inputs::{AlignmentInputs, PlacedRelief, require_current};
use super::image_error::ImageError;
use super::item::ReviewItem;
use super::item_images::{ImageLayer, ItemImages};
use super::picture_work::{PictureWork, WorkLane};
use mocban_catalog::{Catalog, PairResults};
use mocban_core::InputLimits;
use mocban_core::domain::{Affine2, Stage};
use mocban_core::raster::png_mask;
use mocban_export::scan_view::ScanView;
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::Project;

/// Renders the images of the items of a review, and shares the latest with other reviews.
#[derive(Debug)]
pub(super) struct ImageCache {
    catalog: Catalog,
    project: Project,
    limits: InputLimits,
    work: Arc<PictureWork>,
}

impl ImageCache {
    /// Renders images with the threads of `work`, and keeps them there.
    pub(super) const fn new(
        catalog: Catalog,
        project: Project,
        limits: InputLimits,
        work: Arc<PictureWork>,
    ) -> Self {
        Self {
            catalog,
            project,
            limits,
            work,
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
            ImageLayer::DepthFrameRelief => self.draw(item, AlignmentInputs::relief).await?,
            ImageLayer::DepthFrameMask => {
                self.draw(item, |inputs| png_mask(&inputs.strokes)).await?
            }
            ImageLayer::CanvasMask => {
                self.draw(item, |inputs| png_mask(&inputs.canvas_mask))
                    .await?
            }
            rendered => {
                let images = self.of(item).await?;
                images.layer(rendered).ok_or(ImageError::Gone)?
            }
        })
    }

    /// Returns the images of an item. Concurrent requests for one view of a pair share one rendering.
    ///
    /// # Errors
    /// Returns an error if files of the pair cannot be read, or if the pair has a new result.
    pub(super) async fn of(&self, item: &Arc<ReviewItem>) -> Result<Arc<ItemImages>, ImageError> {
        let view = item.view.hash();
        // Other reviewers may see the same view, and other projects may have such a pair.
        let key = format!("{}\0{}\0{view}", self.project.dir().display(), item.pair);
        let slot = self.work.slots.lock().await.entry(&key);
        let render = async || {
            let limits = self.limits.image;
            let render = move |project: &Project, pair: &PairResults, item: &ReviewItem| {
                ItemImages::render(project, pair, item, &limits)
            };
            let images = Arc::new(self.read(self.work.lane_of(&view), item, render).await?);
            self.work.slots.lock().await.add(&key, images.bytes());
            Ok(images)
        };
        let images = slot.get_or_try_init(render).await.map(Arc::clone);
        if images.is_err() {
            self.work.slots.lock().await.remove_failed(&key, slot);
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
        self.read(&self.work.quick, item, read).await
    }

    /// Checks that the pair of an item still has the result that the item shows.
    ///
    /// # Errors
    /// Returns an error if the pair has a new result, or no complete result.
    pub(super) async fn require_current(&self, item: &Arc<ReviewItem>) -> Result<(), ImageError> {
        let read = |project: &Project, pair: &PairResults, item: &ReviewItem| {
            require_current(&PairArtifacts::new(project, pair), item)
        };
        self.read(&self.work.quick, item, read).await
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
        self.read(&self.work.quick, item, read).await
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
        self.read(self.work.lane_of(&item.view.hash()), item, read)
            .await
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
    use std::path::Path;
    use std::sync::Arc;

    use super::ImageCache;
    use crate::review::image_error::ImageError;
    use crate::review::item::ReviewItem;
    use crate::review::item::test_fixtures::item;
    use crate::review::picture_work::PictureWork;
    use mocban_catalog::Catalog;
    use mocban_core::InputLimits;
    use mocban_core::mesh::MeshLimits;
    use mocban_core::raster::ImageLimits;
    use mocban_store::Project;

    /// Returns the images of a review.
    fn images(catalog: &Catalog, project: &Project, work: &Arc<PictureWork>) -> ImageCache {
        let limits = InputLimits {
            mesh: MeshLimits::SUGGESTED,
            image: ImageLimits::SUGGESTED,
        };
        let (catalog, project) = (catalog.clone(), project.clone());
        ImageCache::new(catalog, project, limits, Arc::clone(work))
    }

    /// Creates a catalog without pairs.
    async fn empty(dir: &Path) -> (Catalog, Project) {
        let project = Project::at(dir);
        let catalog = Catalog::create(&project.catalog_path()).await;
        (catalog.expect("a catalog"), project)
    }

    #[tokio::test]
    async fn a_manual_alignment_does_not_wait_for_pictures() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let work = Arc::new(PictureWork::for_one());
        let (catalog, project) = empty(dir.path()).await;
        let images = images(&catalog, &project, &work);
        let item = Arc::new(item(1));
        let lane = work.lane_of(&item.view.hash());
        let busy = lane.reading.acquire().await.expect("a permit");
        {
            let picture = images.of(&item);
            tokio::pin!(picture);
            assert!(futures_util::poll!(&mut picture).is_pending());
            // The pair is not in the catalog.
            let current = images.require_current(&item).await;
            assert!(matches!(current, Err(ImageError::Gone)), "{current:?}");
            assert!(futures_util::poll!(&mut picture).is_pending());
        }
        drop(busy);
        assert!(matches!(images.of(&item).await, Err(ImageError::Gone)));
    }

    #[tokio::test]
    async fn the_pictures_of_all_reviewers_wait_for_two_threads() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (catalog, project) = empty(dir.path()).await;
        let work = Arc::new(PictureWork::for_many());
        let items: Vec<Arc<ReviewItem>> = (0..16).map(item).map(Arc::new).collect();
        let lanes: Vec<_> = items
            .iter()
            .map(|item| work.lane_of(&item.view.hash()))
            .collect();
        let other = lanes.iter().find(|lane| !std::ptr::eq(**lane, lanes[0]));
        let other = other.expect("a second thread");
        let busy = [
            lanes[0].reading.acquire().await.expect("a permit"),
            other.reading.acquire().await.expect("a permit"),
        ];
        for item in &items {
            let images = images(&catalog, &project, &work);
            let picture = images.of(item);
            tokio::pin!(picture);
            assert!(futures_util::poll!(&mut picture).is_pending());
            let scan = images.scan_view(item);
            tokio::pin!(scan);
            assert!(futures_util::poll!(&mut scan).is_pending());
        }
        drop(busy);
    }
}
