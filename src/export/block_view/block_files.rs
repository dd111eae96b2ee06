//! Reads the page of a block and the heights of its faces.

use super::block_error::BlockViewError;
use crate::block::{CarvedFace, FoundFace, PageInk, StoredHeights, heights_role};
use crate::domain::{ArtifactSet, BlockStage, ContentHash};
use crate::export::pictures::{Rgb, eight_bits};
use crate::export::source_print::SourcePrintError;
use crate::raster::{self, ImageLimits};
use crate::store::{Project, read_input};

/// The image of a page.
#[derive(Debug)]
pub(super) struct PagePicture {
    pub(super) hash: ContentHash,
    pub(super) picture: Rgb,
    pub(super) ink: PageInk,
}

impl PagePicture {
    /// Reads a page. `aligned` is the hash of the file that was aligned, if it must be the same.
    pub(super) fn read(
        project: &Project,
        stored_path: &str,
        aligned: Option<ContentHash>,
        limits: &ImageLimits,
    ) -> Result<Self, BlockViewError> {
        let input = project.input(stored_path);
        let path = input.path().to_owned();
        let file = read_input(&input, limits.max_bytes, "limits.image.max_bytes")
            .map_err(SourcePrintError::Read)?;
        let hash = file.digest.hash;
        if aligned.is_some_and(|aligned| aligned != hash) {
            return Err(SourcePrintError::Changed(path).into());
        }
        let image = raster::decode(&file.bytes, limits)
            .map_err(|source| SourcePrintError::Decode { path, source })?;
        drop(file);
        Ok(Self {
            hash,
            ink: PageInk::of(&image)?,
            picture: eight_bits(&image),
        })
    }
}

/// Reads the heights of a face. `files` are the artifacts of the stage `face`.
pub(super) fn read_face(
    project: &Project,
    files: &ArtifactSet,
    found: &FoundFace,
) -> Result<CarvedFace, BlockViewError> {
    let unusable = |why: &str| BlockViewError::Outcome {
        stage: BlockStage::Face,
        why: why.to_owned(),
    };
    let heights = files.get(&heights_role(found.side));
    let heights = heights.ok_or_else(|| unusable("it has no heights"))?;
    let values = raster::decode_grey16(&project.read_artifact(heights)?)?;
    let header = found.heights;
    let face = CarvedFace::of(&StoredHeights { header, values });
    face.ok_or_else(|| unusable("no surface fits its heights"))
}
