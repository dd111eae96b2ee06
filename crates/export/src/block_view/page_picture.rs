//! The image of a page, decoded, with its ink.

use super::block_error::BlockViewError;
use crate::pictures::Rgb;
use crate::source_print::SourcePrint;
use mocban_align::block::PageInk;
use mocban_core::domain::ContentHash;
use mocban_core::raster::ImageLimits;
use mocban_store::Project;

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
        let source = SourcePrint::read_stored(project, stored_path, aligned, limits)?;
        let hash = source.hash();
        let image = source.picture;
        Ok(Self {
            hash,
            ink: PageInk::of(&image)?,
            picture: image.rgb.into_rgb8(),
        })
    }
}
