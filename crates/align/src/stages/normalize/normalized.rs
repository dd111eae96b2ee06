//! Result of the normalize stage, and the map from an image to the canvas on which masks are compared.

use super::params::{NormalizeError, NormalizeParams};
use crate::stages::binarize::InkMask;
use crate::stages::pose::SoftMask;
use crate::stages::print::pixel_sigma;
use mocban_core::domain::{Affine2, InkHypothesis, MaskScale, NormalizeOutcome, ReliefHeights};
use mocban_core::raster::{Grid, Mask, mask_of_print};

/// Masks of one interpretation of the print, in the print image's frame. They are larger than a small print and smaller
/// than a large one, see [`MaskScale`].
#[derive(Debug, Clone, PartialEq)]
pub struct PrintMasks {
    /// Pixels that are ink.
    pub ink: Mask,
    /// Pixels as dark as ink, in pieces that are too small to count as ink. They are often traces of dry ink.
    pub specks: Mask,
    /// Pixels that are ink or background. All other pixels are the white around the print.
    pub known: Mask,
    /// The size of the masks relative to the print.
    pub scale: MaskScale,
}

impl PrintMasks {
    const INK: u8 = 255;
    const BACKGROUND: u8 = 0;
    const UNKNOWN: u8 = 128;
    const SPECK: u8 = 64;

    /// Encodes ink, specks, background and unknown pixels as one image. Specks lie on known pixels only.
    pub fn to_grey(&self) -> Grid<u8> {
        let Self {
            ink, specks, known, ..
        } = self;
        Grid::from_fn(ink.width(), ink.height(), |x, y| {
            match (ink.at(x, y), known.at(x, y), specks.at(x, y)) {
                (true, _, _) => Self::INK,
                (false, true, true) => Self::SPECK,
                (false, true, false) => Self::BACKGROUND,
                (false, false, _) => Self::UNKNOWN,
            }
        })
    }

    /// Decodes a stored mask: 255 is ink, 64 is a speck, 0 is background and 128 is unknown. `scale` is that of
    /// [`NormalizeOutcome::mask_scale`].
    pub fn from_grey(grey: &Grid<u8>, scale: MaskScale) -> Self {
        Self {
            ink: grey.map(|grey| *grey == Self::INK),
            specks: grey.map(|grey| *grey == Self::SPECK),
            known: grey.map(|grey| *grey != Self::UNKNOWN),
            scale,
        }
    }

    /// Returns the pixels of the print that are ink.
    pub fn ink_of_print(&self) -> Mask {
        mask_of_print(&self.ink, self.scale)
    }

    /// Returns width and height of the print.
    pub(crate) fn print_size(&self) -> [usize; 2] {
        self.scale.print_size([self.ink.width(), self.ink.height()])
    }

    /// Returns the map from pixels of the masks to pixels of the print.
    pub(crate) fn print_from_masks(&self) -> Affine2 {
        self.scale.print_from_masks()
    }

    /// Returns the map from pixels of the print to pixels of the masks.
    pub(crate) fn masks_from_print(&self) -> Affine2 {
        self.scale.masks_from_print()
    }

    /// Returns how much a scan is smoothed to be compared with a small print, see [`pixel_sigma`].
    pub(crate) fn pixel_sigma(&self) -> f64 {
        pixel_sigma(self.scale, self.known.bounding_box())
    }

    /// Returns the ink mask as a soft mask of zeros and ones.
    pub(crate) fn soft_ink(&self) -> SoftMask {
        SoftMask {
            amount: self.ink.to_weights(),
            known: self.known.clone(),
        }
    }
}

/// Result of the normalize stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalized {
    /// The numbers.
    pub outcome: NormalizeOutcome,
    /// The masks of each interpretation of the print, in the order of `outcome.inks`. There is at least one.
    pub prints: Vec<PrintMasks>,
}

impl Normalized {
    /// Returns the result with the masks of one interpretation replaced.
    pub(crate) fn with_masks(&self, ink: usize, masks: PrintMasks) -> Self {
        let mut replaced = self.clone();
        replaced.prints[ink] = masks;
        replaced
    }

    /// Collects the interpretations of a print, each with its map to the canvas. `scale` is that of the masks.
    ///
    /// # Errors
    /// Returns an error if no interpretation has ink.
    pub(crate) fn new(
        inks: &[InkMask],
        scale: MaskScale,
        relief: Option<ReliefHeights>,
        params: &NormalizeParams,
    ) -> Result<Self, NormalizeError> {
        let masks_from_print = scale.masks_from_print();
        let interpretation = |ink: &InkMask| {
            let hypothesis = InkHypothesis {
                threshold_print: ink.threshold * 65_535.0,
                light_on_dark: ink.light_on_dark,
                canvas_from_print: box_wrap(&ink.mask, params)?.after(&masks_from_print),
            };
            let masks = PrintMasks {
                ink: ink.mask.clone(),
                specks: ink.specks.clone(),
                known: ink.soft.known.clone(),
                scale,
            };
            // As a resumed run reads them: ink is known, and specks are neither ink nor unknown.
            Some((hypothesis, PrintMasks::from_grey(&masks.to_grey(), scale)))
        };
        let (hypotheses, prints): (Vec<_>, Vec<_>) = inks.iter().filter_map(interpretation).unzip();
        if prints.is_empty() {
            return Err(NormalizeError::NoStrokes);
        }
        Ok(Self {
            outcome: NormalizeOutcome {
                canvas_px: params.canvas_px,
                inks: hypotheses,
                relief,
                thresholds: Vec::new(),
                print_orientation: None,
                ignored_profile: None,
                print_enlargement: scale.enlargement(),
                print_reduction: scale.reduction(),
            },
            prints,
        })
    }
}

/// Returns the paper's wrap W(I) (III-C), which maps image pixels to canvas pixels. The wrap scales the longest side of
/// the mask's bounding box to `character_px`, and moves the mask's centroid to the middle of the canvas. Returns `None`
/// if the mask is empty.
pub(crate) fn box_wrap(mask: &Mask, params: &NormalizeParams) -> Option<Affine2> {
    let bounds = mask.bounding_box()?;
    let [x, y] = mask.centroid()?;
    let scale = f64::from(params.character_px) / bounds.longest_side() as f64;
    let middle = f64::from(params.canvas_px - 1) / 2.0;
    Some(Affine2::scale_shift(
        scale,
        [middle - scale * x, middle - scale * y],
    ))
}

#[cfg(test)]
mod tests {
    use super::PrintMasks;
    use mocban_core::domain::MaskScale;
    use mocban_core::raster::Mask;

    #[test]
    fn ink_counts_even_where_the_print_is_unknown() {
        let masks = PrintMasks {
            ink: Mask::from_fn(4, 1, |x, _| x == 0),
            specks: Mask::from_fn(4, 1, |x, _| x == 3),
            known: Mask::from_fn(4, 1, |x, _| x == 1 || x == 3),
            scale: MaskScale::Same,
        };
        let grey = masks.to_grey();
        // Ink, background, unknown, speck; the values are documented at `artifact_role::print_mask`.
        assert_eq!(grey.data(), [255, 0, 128, 64]);
        let back = PrintMasks::from_grey(&grey, MaskScale::Same);
        assert_eq!((back.ink, back.specks), (masks.ink, masks.specks));
    }
}
