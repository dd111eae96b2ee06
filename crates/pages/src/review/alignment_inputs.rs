//! What a manual alignment of an item starts from, and what is stored with it.

use super::image_error::ImageError;
use super::item::ReviewItem;
use mocban_core::domain::{Affine2, ContentHash, PrintFromMesh, Stage};
use mocban_core::raster::{DepthMap, Mask, MaskOverlap, png_rgb8, warp_mask};
use mocban_export::pictures::shaded;
use mocban_results::pair_artifacts::PairArtifacts;

/// The depth map of an item, and the canvas on which its scores are computed.
#[derive(Debug)]
pub(super) struct AlignmentInputs {
    pub(super) canvas_mask: Mask,
    pub(super) canvas_from_print: Affine2,
    pub(super) depth: DepthMap,
    pub(super) strokes: Mask,
}

impl AlignmentInputs {
    /// Reads the inputs of an item.
    ///
    /// # Errors
    /// Returns an error if an artifact cannot be read, or if the pair has a new result.
    pub(super) fn read(aligned: &PairArtifacts<'_>, item: &ReviewItem) -> Result<Self, ImageError> {
        require_current(aligned, item)?;
        let depth = aligned.depth()?;
        Ok(Self {
            canvas_mask: aligned.canvas_print_mask()?,
            canvas_from_print: aligned.canvas_from_print()?,
            strokes: depth.stroke_mask(item.view.level),
            depth,
        })
    }

    /// Computes the overlap of stroke and ink mask as results are scored, with the relief placed by `print_from_depth`.
    pub(super) fn mask_overlap(&self, print_from_depth: &Affine2) -> MaskOverlap {
        let map = self.canvas_from_print.after(print_from_depth);
        let (width, height) = (self.canvas_mask.width(), self.canvas_mask.height());
        warp_mask(&self.strokes, &map, width, height).overlap(&self.canvas_mask)
    }

    /// Returns the shaded relief in the depth map's frame.
    pub(super) fn relief(&self) -> Vec<u8> {
        let slope = self.depth.scale.height_per_level / self.depth.scale.mesh_unit_per_px;
        png_rgb8(&shaded(&self.depth.levels, slope))
    }
}

/// Checks that a pair still has the depth map and the print that an item shows.
///
/// # Errors
/// Returns an error if it has others.
pub(super) fn require_current(
    aligned: &PairArtifacts<'_>,
    item: &ReviewItem,
) -> Result<(), ImageError> {
    let hashes = (
        aligned.stage(Stage::Depth)?.result_hash,
        aligned.stage(Stage::Normalize)?.print_hash,
    );
    if hashes != (item.view.depth_hash, Some(item.view.print_hash)) {
        return Err(ImageError::Gone);
    }
    Ok(())
}

/// The relief of an item on its print, as a reviewer placed it.
#[derive(Debug)]
pub(super) struct PlacedRelief {
    pub(super) scores: MaskOverlap,
    pub(super) print_from_mesh: PrintFromMesh,
    /// Hash of the mesh that the result was computed from.
    pub(super) mesh_hash: ContentHash,
}
