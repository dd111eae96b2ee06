//! A print and its binarizations, which fit and normalize share.

use std::num::NonZeroU32;
use std::sync::OnceLock;

use super::binarize::{
    BinarizeError, InkMask, hypotheses, hypotheses_within, keep_shares, require_strokes,
};
use mocban_core::domain::{MaskReduction, MaskScale, PrintOutline};
use mocban_core::raster::{PixelBox, PrintImage, enlarge, reduce};

/// A print whose shorter side has fewer pixels is enlarged before its ink is found: strokes of one or two pixels have no
/// shape of their own.
const LEAST_SIDE_PX: usize = 64;
/// Most times that a print is enlarged.
const MOST_TIMES: usize = 8;
/// Largest number of pixels of an enlarged print.
const MOST_PX: usize = 1 << 20;
/// A print is reduced a whole number of times to at least this many pixels. They show the strokes of a character as well
/// as more pixels do, and the time that all stages take is in proportion to their number.
const ENOUGH_PX: usize = 700 * 700;
/// Pixels that the shorter side of a reduced print has at least.
const REDUCED_SIDE_PX: usize = 500;

/// Sigma of the Gaussian that smooths about as much as the pixels of an image, in pixels.
const PIXEL_SIGMA: f64 = 0.29;

/// Returns the sigma of the Gaussian that smooths about as much as the pixels of an enlarged print, as a fraction of the
/// longest side of `known`, the box of the known pixels of its masks. A scan is smoothed like the print, because a
/// sharper one agrees less with it. Returns 0 for other prints, whose pixels are smaller than strokes.
pub(super) fn pixel_sigma(scale: MaskScale, known: Option<PixelBox>) -> f64 {
    let (Some(times), Some(known)) = (scale.enlargement(), known) else {
        return 0.0;
    };
    PIXEL_SIGMA * f64::from(times.get()) / known.longest_side() as f64
}

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

    /// Returns the size of the masks of [`Self::hypotheses`] relative to the print.
    pub(super) fn mask_scale(&self) -> MaskScale {
        let [width, height] = [self.picture.rgb.width(), self.picture.rgb.height()];
        let [shorter, pixels] = [width.min(height).max(1), (width * height).max(1)];
        let times = (pixels / ENOUGH_PX).isqrt().min(shorter / REDUCED_SIDE_PX);
        if times > 1 {
            // A side of more pixels would not fit into memory.
            let px = |side| u32::try_from(side).unwrap_or(u32::MAX);
            let times = NonZeroU32::new(px(times)).unwrap_or(NonZeroU32::MIN);
            return MaskScale::Reduced(MaskReduction {
                times,
                print_px: [px(width), px(height)],
            });
        }
        let wanted = LEAST_SIDE_PX.div_ceil(shorter);
        let fitting = (MOST_PX / pixels).isqrt();
        MaskScale::enlarged(wanted.min(MOST_TIMES).min(fitting) as u32)
    }

    /// Returns all possible interpretations as ink and background, the likeliest first. There is at least one. Their
    /// masks have the size of [`Self::mask_scale`].
    pub(super) fn hypotheses(&self) -> Result<&[InkMask], BinarizeError> {
        let read = self.hypotheses.get_or_init(|| self.find_ink());
        read.as_deref().map_err(|error| *error)
    }

    fn find_ink(&self) -> Result<Vec<InkMask>, BinarizeError> {
        let scale = self.mask_scale();
        let rgb = match scale {
            MaskScale::Same => None,
            MaskScale::Enlarged(times) => Some(enlarge(&self.picture.rgb, times.get())),
            MaskScale::Reduced(reduction) => Some(reduce(&self.picture.rgb, reduction.times.get())),
        };
        let resized = rgb.map(PrintImage::from);
        let picture = resized.as_ref().unwrap_or(&self.picture);
        let mut inks = match &self.outline {
            Some(outline) => hypotheses_within(picture, &outline.mapped(&scale.masks_from_print())),
            None => hypotheses(picture),
        }?;
        if let MaskScale::Enlarged(times) = scale {
            require_strokes(&inks, times.get())?;
            for ink in &mut inks {
                keep_shares(ink, times.get() as usize);
            }
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
    use super::{Print, pixel_sigma};
    use mocban_core::domain::MaskScale;
    use mocban_core::raster::{Grid, Mask, PrintImage, mask_of_print, reduce};

    fn print(width: usize, height: usize, is_ink: impl Fn(usize, usize) -> bool) -> Print {
        let grey = |x, y| if is_ink(x, y) { 9_000 } else { 50_000 };
        PrintImage::from(Grid::from_fn(width, height, |x, y| [grey(x, y); 3])).into()
    }

    #[test]
    fn only_small_and_large_prints_are_resized_and_never_beyond_a_limit() {
        let scale = |width, height| print(width, height, |_, _| false).mask_scale();
        assert_eq!(scale(64, 80), MaskScale::Same);
        assert_eq!(scale(63, 80), MaskScale::enlarged(2));
        assert_eq!(scale(12, 11), MaskScale::enlarged(6));
        assert_eq!(scale(1, 1), MaskScale::enlarged(8));
        assert_eq!(scale(300_000, 3), MaskScale::Same);
        assert_eq!(scale(1399, 1399), MaskScale::Same);
        assert_eq!(scale(8000, 900), MaskScale::Same);
        let masks = |width, height| {
            let scale = scale(width, height);
            assert!(matches!(scale, MaskScale::Reduced(_)), "{scale:?}");
            scale.mask_size([width, height])
        };
        assert_eq!(masks(1400, 1400), Some([700, 700]));
        assert_eq!(masks(2999, 3001), Some([750, 751]));
        assert_eq!(masks(8000, 1000), Some([4000, 500]));
    }

    #[test]
    fn ink_of_a_large_print_lies_where_the_print_shows_it() {
        // A cross with a thin stroke.
        let is_ink = |x: usize, y: usize| {
            (600..1500).contains(&x) && y.abs_diff(900) < 60
                || x.abs_diff(1003) < 9 && (300..1700).contains(&y)
        };
        let large = print(2003, 2101, is_ink);
        let mask = mask_of_print(
            &large.hypotheses().expect("ink")[0].mask,
            large.mask_scale(),
        );
        assert_eq!([mask.width(), mask.height()], [2003, 2101]);
        let wanted = Mask::from_fn(2003, 2101, is_ink);
        let wrong = mask
            .zip_map(&wanted, |found, wanted| found != wanted)
            .count();
        assert!(50 * wrong < wanted.count(), "{wrong} of {}", wanted.count());
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
    fn strokes_narrower_than_a_pixel_keep_their_width() {
        // Pixels of 10 x 10 parts: a wide stroke and a thin one, which lies across two pixels.
        let is_wide = |x: usize| (30..60).contains(&x);
        let is_thin = |x: usize| (96..103).contains(&x);
        let paper = Grid::from_fn(160, 160, |x, y| {
            let is_ink = (is_wide(x) || is_thin(x)) && (20..140).contains(&y);
            [if is_ink { 9_000 } else { 50_000 }; 3]
        });
        let small = Print::from(PrintImage::from(reduce(&paper.into(), 10)));
        let mask = &small.hypotheses().expect("ink")[0].mask;
        let parts_per_px = 160.0 / mask.width() as f64;
        let width = |from: usize, to: usize| {
            let row = mask.row(mask.height() / 2).iter().enumerate();
            let inside = row.filter(|(x, ink)| {
                let part = (*x as f64 + 0.5) * parts_per_px;
                **ink && (from as f64..to as f64).contains(&part)
            });
            inside.count() as f64 * parts_per_px
        };
        let [wide, thin] = [width(10, 80), width(80, 120)];
        assert!(
            (wide - 30.0).abs() < 4.0 && (thin - 7.0).abs() < 2.0,
            "{wide} {thin}"
        );
    }

    #[test]
    fn only_small_prints_smooth_a_scan() {
        let sigma = |width| {
            let print = print(width, width, |x, y| x.abs_diff(y) < 3);
            let known = print.hypotheses().expect("ink")[0]
                .soft
                .known
                .bounding_box();
            pixel_sigma(print.mask_scale(), known)
        };
        assert_eq!(sigma(64), 0.0);
        assert!((sigma(20) - 0.29 / 20.0).abs() < 1e-9);
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
        assert_eq!(
            mask_of_print(mask, small.mask_scale()),
            Mask::from_fn(18, 18, is_ink)
        );
    }
}
