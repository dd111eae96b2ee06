//! Inputs of a block in memory between its stages: faces by the hash of their stage's result, pages by their content.

use std::sync::{Arc, Mutex};

use super::context::StageContext;
use super::failure::failed;
use crate::block_stages::{BlockFile, BlockStageError};
use mocban_align::block::{CarvedFace, FaceOutcome, PageInk, StoredHeights, heights_role};
use mocban_core::domain::{BlockSide, BlockStage, ContentHash};
use mocban_core::locked;
use mocban_core::raster::{self, PrintImage};

/// What the last stage read.
#[derive(Debug, Default)]
pub(crate) struct HeldInputs {
    faces: Mutex<Option<(ContentHash, HeldFaces)>>,
    page: Mutex<Option<Arc<HeldPage>>>,
}

/// Forgets the inputs when it is dropped, also if a stage is cancelled or panics.
pub(crate) struct HeldGuard<'a>(pub(crate) Option<&'a HeldInputs>);

impl Drop for HeldGuard<'_> {
    fn drop(&mut self) {
        if let Some(held) = self.0 {
            held.clear();
        }
    }
}

/// The faces of a block.
pub(crate) type HeldFaces = Arc<Vec<(BlockSide, CarvedFace)>>;

/// A page, its ink and the hash of its file.
#[derive(Debug)]
pub(crate) struct HeldPage {
    pub(crate) hash: ContentHash,
    pub(crate) image: PrintImage,
    pub(crate) ink: PageInk,
}

impl HeldInputs {
    /// Forgets the inputs of a block that is finished.
    pub(crate) fn clear(&self) {
        *locked(&self.faces) = None;
        *locked(&self.page) = None;
    }

    /// Returns the faces of a block, from memory or from the artifacts of `face`.
    pub(crate) fn faces(&self, context: &StageContext<'_>) -> Result<HeldFaces, BlockStageError> {
        let record = context.record(BlockStage::Face)?;
        let mut held = locked(&self.faces);
        if let Some((hash, faces)) = &*held
            && *hash == record.result_hash
        {
            return Ok(Arc::clone(faces));
        }
        let outcome: FaceOutcome = context.outcome(BlockStage::Face)?;
        // The memory of another block is freed first.
        *held = None;
        let mut faces = Vec::new();
        for found in outcome.faces {
            let bytes = context.artifacts.read(record, &heights_role(found.side))?;
            let rerun = |_| BlockStageError::RerunFrom(BlockStage::Face);
            let values = raster::decode_grey16(&bytes).map_err(rerun)?;
            let header = found.heights;
            let face = CarvedFace::of(&StoredHeights { header, values });
            faces.extend(face.map(|face| (found.side, face)));
        }
        let faces = Arc::new(faces);
        *held = Some((record.result_hash, Arc::clone(&faces)));
        Ok(faces)
    }

    /// Returns the page of a block and its ink, from memory or from its file.
    pub(crate) fn page(
        &self,
        context: &StageContext<'_>,
    ) -> Result<Arc<HeldPage>, BlockStageError> {
        let file = &context.inputs.page;
        let bytes = file.read(context.limits.image.max_bytes, context.stop)?;
        let hash = ContentHash::of(&bytes);
        let mut held = locked(&self.page);
        if let Some(page) = held.as_ref().filter(|page| page.hash == hash) {
            return Ok(Arc::clone(page));
        }
        // The memory of another page is freed first.
        *held = None;
        let image = raster::decode(&bytes, &context.limits.image)
            .map_err(|error| file.failed(error.class(), error))?;
        drop(bytes);
        let ink = PageInk::of(&image).map_err(|error| {
            log_warning(file, &image);
            failed(file, error)
        })?;
        let page = Arc::new(HeldPage { hash, image, ink });
        *held = Some(Arc::clone(&page));
        Ok(page)
    }
}

/// Logs what may be wrong with the image of a page. The result of `align` keeps it; a failure does not.
pub(super) fn log_warning(file: &BlockFile, image: &PrintImage) {
    if let Some(warning) = image.profile_warning() {
        tracing::warn!("{}: {warning}", file.name());
    }
}
