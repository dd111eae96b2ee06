//! A print and its binarizations, which fit and normalize share.

use std::sync::OnceLock;

use super::binarize::{BinarizeError, InkMask, hypotheses, hypotheses_within, require_strokes};
use mocban_core::domain::PrintOutline;
use mocban_core::raster::{PrintImage, enlarge, enlarged_from_original};

/// A print whose shorter side has fewer pixels is enlarged before its ink is found: strokes of one or two pixels have no
/// shape of their own.
const LEAST_SIDE_PX: usize = 64;
/// Most times that a print is enlarged.
const MOST_TIMES: usize = 8;
/// Largest number of pixels of an enlarged print.
const MOST_PX: usize = 1 << 20;

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

    /// Returns how many times the masks of [`Self::hypotheses`] are larger than the print, on each side: 1 unless the
    /// print is small.
    pub(super) fn enlargement(&self) -> u32 {
        let [width, height] = [self.picture.rgb.width(), self.picture.rgb.height()];
        let wanted = LEAST_SIDE_PX.div_ceil(width.min(height).max(1));
        let fitting = (MOST_PX / (width * height).max(1)).isqrt();
        wanted.min(MOST_TIMES).min(fitting).max(1) as u32
    }

    /// Returns all possible interpretations as ink and background, the likeliest first. There is at least one. Their
    /// masks are [`Self::enlargement`] times as large as the print.
    pub(super) fn hypotheses(&self) -> Result<&[InkMask], BinarizeError> {
        let read = self.hypotheses.get_or_init(|| self.find_ink());
        read.as_deref().map_err(|error| *error)
    }

    fn find_ink(&self) -> Result<Vec<InkMask>, BinarizeError> {
        let times = self.enlargement();
        let enlarged = (times > 1).then(|| PrintImage {
            rgb: enlarge(&self.picture.rgb, times),
            turned: self.picture.turned,
            ignored_profile: None,
        });
        let picture = enlarged.as_ref().unwrap_or(&self.picture);
        let inks = match &self.outline {
            Some(outline) => {
                hypotheses_within(picture, &outline.mapped(&enlarged_from_original(times)))
            }
            None => hypotheses(picture),
        }?;
        if times > 1 {
            require_strokes(&inks, times)?;
        }
        Ok(inks)
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

#[cfg(test)]
mod tests {
    use super::Print;
    use mocban_core::raster::{Grid, Mask, PrintImage, reduce_mask};

    fn print(width: usize, height: usize, is_ink: impl Fn(usize, usize) -> bool) -> Print {
        let grey = |x, y| if is_ink(x, y) { 9_000 } else { 50_000 };
        PrintImage::from(Grid::from_fn(width, height, |x, y| [grey(x, y); 3])).into()
    }

    #[test]
    fn only_small_prints_are_enlarged_and_never_beyond_a_limit() {
        let times = |width, height| print(width, height, |_, _| false).enlargement();
        assert_eq!(times(64, 80), 1);
        assert_eq!(times(63, 80), 2);
        assert_eq!(times(12, 11), 6);
        assert_eq!(times(1, 1), 8);
        assert_eq!(times(300_000, 3), 1);
    }

    #[test]
    fn a_character_of_a_few_pixels_is_refused_by_what_is_seen() {
        let dot = print(20, 20, |x, y| (8..13).contains(&x) && (7..11).contains(&y));
        let text = dot.hypotheses().expect_err("too coarse").to_string();
        assert!(
            text.starts_with("print shows the character with 5 px"),
            "{text}"
        );
    }

    #[test]
    fn ink_of_a_small_print_lies_where_the_print_shows_it() {
        let is_ink = |x: usize, y: usize| {
            (3..15).contains(&x) && (8..10).contains(&y)
                || (8..10).contains(&x) && (2..16).contains(&y)
        };
        let small = print(18, 18, is_ink);
        let inks = small.hypotheses().expect("ink");
        let mask = &inks[0].mask;
        assert_eq!([mask.width(), mask.height()], [72, 72]);
        assert_eq!(reduce_mask(mask, 4), Mask::from_fn(18, 18, is_ink));
    }
}
