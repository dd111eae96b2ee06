//! A print and its binarizations, which fit and normalize share.

use std::sync::OnceLock;

use super::binarize::{BinarizeError, InkMask, hypotheses, hypotheses_within};
use mocban_core::domain::PrintOutline;
use mocban_core::raster::PrintImage;

/// A decoded image of a print, and its binarizations, which are computed on first use.
#[derive(Debug, Clone)]
pub struct Print {
    picture: PrintImage,
    /// The part that shows the character; `None` for the whole print.
    outline: Option<PrintOutline>,
    hypotheses: OnceLock<Result<Vec<InkMask>, BinarizeError>>,
}

impl Print {
    /// Returns the image as decoded.
    pub const fn image(&self) -> &PrintImage {
        &self.picture
    }

    /// Restricts the print to the part that `fit` found. If it found none, returns the print unchanged.
    #[must_use]
    pub fn within(self, outline: Option<&PrintOutline>) -> Self {
        match outline {
            Some(outline) => Self {
                outline: Some(outline.clone()),
                ..Self::from(self.picture)
            },
            None => self,
        }
    }

    /// Returns all possible interpretations as ink and background, the likeliest first. There is at least one.
    pub(super) fn hypotheses(&self) -> Result<&[InkMask], BinarizeError> {
        let read = self.hypotheses.get_or_init(|| match &self.outline {
            Some(outline) => hypotheses_within(&self.picture, outline),
            None => hypotheses(&self.picture),
        });
        read.as_deref().map_err(|error| *error)
    }
}

impl From<PrintImage> for Print {
    fn from(picture: PrintImage) -> Self {
        Self {
            picture,
            outline: None,
            hypotheses: OnceLock::new(),
        }
    }
}
