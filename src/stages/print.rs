//! A print and its binarizations, which fit and normalize share.

use std::sync::OnceLock;

use super::binarize::{BinarizeError, InkMask, hypotheses};
use crate::raster::PrintImage;

/// A decoded image of a print, and its binarizations, which are computed on first use.
#[derive(Debug, Clone)]
pub struct Print {
    picture: PrintImage,
    hypotheses: OnceLock<Result<Vec<InkMask>, BinarizeError>>,
}

impl Print {
    /// Returns the image as decoded.
    pub const fn image(&self) -> &PrintImage {
        &self.picture
    }

    /// Returns all possible interpretations as ink and background, the likeliest first. There is at least one.
    pub(super) fn hypotheses(&self) -> Result<&[InkMask], BinarizeError> {
        let read = self.hypotheses.get_or_init(|| hypotheses(&self.picture));
        read.as_deref().map_err(|error| *error)
    }
}

impl From<PrintImage> for Print {
    fn from(picture: PrintImage) -> Self {
        Self {
            picture,
            hypotheses: OnceLock::new(),
        }
    }
}
