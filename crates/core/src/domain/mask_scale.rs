//! The size of the masks of a print relative to the print.

use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use super::Affine2;

/// How the masks of a print are scaled. Small prints are enlarged before their ink is found, because their strokes are
/// narrower than a pixel; large prints are reduced, because fewer pixels show the same strokes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MaskScale {
    /// The masks have the size of the print.
    Same,
    /// The masks are this many times larger than the print, on each side.
    Enlarged(NonZeroU32),
    /// The masks are smaller than the print.
    Reduced(MaskReduction),
}

/// How the masks of a large print are reduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskReduction {
    /// How many times the masks are smaller than the print, on each side. Their last column and row may show fewer
    /// pixels of the print than the others.
    pub times: NonZeroU32,
    /// Width and height of the print in pixels.
    pub print_px: [u32; 2],
}

impl MaskScale {
    /// Returns the scale of masks that are `times` times as large as the print.
    pub fn enlarged(times: u32) -> Self {
        NonZeroU32::new(times)
            .filter(|times| times.get() > 1)
            .map_or(Self::Same, Self::Enlarged)
    }

    /// Returns how many times the masks are larger than the print, if they are.
    pub const fn enlargement(self) -> Option<NonZeroU32> {
        match self {
            Self::Enlarged(times) => Some(times),
            Self::Same | Self::Reduced(_) => None,
        }
    }

    /// Returns how the masks are reduced, if they are.
    pub const fn reduction(self) -> Option<MaskReduction> {
        match self {
            Self::Reduced(reduction) => Some(reduction),
            Self::Same | Self::Enlarged(_) => None,
        }
    }

    /// Returns the map from pixels of the print to pixels of the masks. Pixel centres have whole coordinates.
    ///
    /// ```
    /// use mocban_core::domain::MaskScale;
    ///
    /// // A pixel becomes a square of 3 by 3 pixels, whose middle one has its centre.
    /// assert_eq!(MaskScale::enlarged(3).masks_from_print().apply([1.0, 0.0]), [4.0, 1.0]);
    /// ```
    pub fn masks_from_print(self) -> Affine2 {
        match self {
            Self::Same => Affine2::IDENTITY,
            Self::Enlarged(times) => larger_from_smaller(times),
            Self::Reduced(reduction) => smaller_from_larger(reduction.times),
        }
    }

    /// Returns the map from pixels of the masks to pixels of the print.
    pub fn print_from_masks(self) -> Affine2 {
        match self {
            Self::Same => Affine2::IDENTITY,
            Self::Enlarged(times) => smaller_from_larger(times),
            Self::Reduced(reduction) => larger_from_smaller(reduction.times),
        }
    }

    /// Returns width and height of the print with masks of this size.
    pub fn print_size(self, masks: [usize; 2]) -> [usize; 2] {
        match self {
            Self::Same => masks,
            Self::Enlarged(times) => masks.map(|side| side / times.get() as usize),
            Self::Reduced(reduction) => reduction.print_px.map(|side| side as usize),
        }
    }

    /// Returns width and height of the masks of a print, or `None` if they are too large.
    pub fn mask_size(self, print: [usize; 2]) -> Option<[usize; 2]> {
        let side = |side: usize| match self {
            Self::Same => Some(side),
            Self::Enlarged(times) => side.checked_mul(times.get() as usize),
            Self::Reduced(reduction) => Some(side.div_ceil(reduction.times.get() as usize)),
        };
        Some([side(print[0])?, side(print[1])?])
    }
}

fn larger_from_smaller(times: NonZeroU32) -> Affine2 {
    Affine2::resize(f64::from(times.get()))
}

fn smaller_from_larger(times: NonZeroU32) -> Affine2 {
    let times = f64::from(times.get());
    Affine2::scale_shift(1.0 / times, [(1.0 - times) / (2.0 * times); 2])
}

#[cfg(test)]
mod tests {
    use super::{MaskReduction, MaskScale};
    use std::num::NonZeroU32;

    #[test]
    fn maps_and_sizes_of_both_directions_belong_together() {
        let times = NonZeroU32::new(4).expect("not zero");
        let print = [4001, 3998];
        let reduction = MaskReduction {
            times,
            print_px: [4001, 3998],
        };
        for (scale, masks) in [
            (MaskScale::enlarged(1), print),
            (MaskScale::enlarged(3), [12_003, 11_994]),
            (MaskScale::Reduced(reduction), [1001, 1000]),
        ] {
            assert_eq!(scale.mask_size(print), Some(masks));
            assert_eq!(scale.print_size(masks), print);
            let there = scale.masks_from_print().apply([10.0, 7.5]);
            let back = scale.print_from_masks().apply(there);
            assert!((back[0] - 10.0).abs() < 1e-9 && (back[1] - 7.5).abs() < 1e-9);
        }
        // The first of the reduced pixels shows the pixels 0 to 3.
        let first = MaskScale::Reduced(reduction).print_from_masks();
        assert_eq!(first.apply([0.0, 1.0]), [1.5, 5.5]);
        let most = MaskScale::enlarged(u32::MAX).mask_size([usize::MAX, 1]);
        assert_eq!(most, None);
    }
}
