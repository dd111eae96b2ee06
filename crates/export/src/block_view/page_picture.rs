//! The image of a page, decoded, and its ink.

use std::sync::{Arc, Mutex};

use super::block_error::BlockViewError;
use super::page_layers::{PageLayers, PageRegion, jpeg, page_part};
use crate::pictures::Rgb;
use crate::source_print::SourcePrint;
use mocban_align::block::PageInk;
use mocban_core::domain::ContentHash;
use mocban_core::locked;
use mocban_core::raster::{ImageLimits, PrintImage};
use mocban_store::Project;

/// The image of a page with its ink.
#[derive(Debug)]
pub(super) struct PagePicture {
    pub(super) hash: ContentHash,
    pub(super) picture: Rgb,
    pub(super) ink: PageInk,
}

impl PagePicture {
    /// Reads a page.
    pub(super) fn read(
        project: &Project,
        stored_path: &str,
        limits: &ImageLimits,
    ) -> Result<Self, BlockViewError> {
        let source = SourcePrint::read_stored(project, stored_path, None, limits)?;
        let hash = source.hash();
        let image = source.picture;
        Ok(Self {
            hash,
            ink: PageInk::of(&image)?,
            picture: image.rgb.into_rgb8(),
        })
    }
}

/// The image of a page, whose ink is found later.
#[derive(Debug)]
pub struct DecodedPage {
    pub(super) picture: Arc<Rgb>,
    /// Its colours, until the ink is taken.
    image: Mutex<Option<PrintImage>>,
}

impl DecodedPage {
    /// Reads a page. `aligned` is the hash of the file that was aligned, if it must be the same.
    pub(super) fn read(
        project: &Project,
        stored_path: &str,
        aligned: Option<ContentHash>,
        limits: &ImageLimits,
    ) -> Result<Self, BlockViewError> {
        let source = SourcePrint::read_stored(project, stored_path, aligned, limits)?;
        Ok(Self {
            picture: Arc::new(source.picture.rgb.to_rgb8().into_owned()),
            image: Mutex::new(Some(source.picture)),
        })
    }

    /// Reads a page only for its ink. `aligned` is as for [`Self::read`].
    pub(super) fn read_ink(
        project: &Project,
        stored_path: &str,
        aligned: Option<ContentHash>,
        limits: &ImageLimits,
    ) -> Result<PageInk, BlockViewError> {
        let source = SourcePrint::read_stored(project, stored_path, aligned, limits)?;
        Ok(PageInk::of(&source.picture)?)
    }

    /// Returns the page of layers, whose ink was taken.
    pub fn of_layers(layers: &PageLayers) -> Self {
        Self {
            picture: Arc::clone(&layers.page),
            image: Mutex::default(),
        }
    }

    /// Finds the ink, and frees the colours that only this needs. Returns `None` if it was taken before.
    pub(super) fn take_ink(&self) -> Option<Result<PageInk, BlockViewError>> {
        let image = locked(&self.image).take()?;
        Some(PageInk::of(&image).map_err(BlockViewError::from))
    }

    /// Returns the width and height of the page, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.picture.width(), self.picture.height()]
    }

    /// Returns the whole page.
    pub fn whole(&self) -> PageRegion {
        PageRegion::whole(self.size())
    }

    /// Draws a region, which must lie within the page, as JPEG. The picture has the pixels of the page, or fewer, so that its
    /// longer side has at most `longest` pixels.
    pub fn jpeg(&self, region: PageRegion, longest: usize) -> Vec<u8> {
        jpeg(&page_part(
            &self.picture,
            region,
            region.picture_size(longest),
        ))
    }
}
