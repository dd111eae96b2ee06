//! A print and its ink, which fit and normalize both ask for and which is read once.

use std::sync::OnceLock;

use super::binarize::{BinarizeError, InkMask, hypotheses};
use crate::raster::PrintImage;

/// A print as the stages see it: the whole picture as decoded, and its ink once somebody has asked.
#[derive(Debug, Clone)]
pub struct Print {
    picture: PrintImage,
    hypotheses: OnceLock<Result<Vec<InkMask>, BinarizeError>>,
}

impl Print {
    /// The picture as decoded.
    pub const fn picture(&self) -> &PrintImage {
        &self.picture
    }

    /// The ink under every polarity that the picture leaves possible, the likelier first; at least one.
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
