//! Overlap of two levels at a pose, computed on the pixels that are valid in both.

use super::PyramidLevel;
use super::pyramid::BilinearCell;
use mocban_core::domain::Affine2;
use mocban_core::raster::Grid;
use mocban_core::simd::dispatch;

/// A moving level at a pose, with its valid mask. `moving_from_fixed` maps between working pixels.
pub(super) struct PlacedLevel<'a> {
    pub(super) moving: &'a PyramidLevel,
    pub(super) valid: &'a Grid<f32>,
    pub(super) moving_from_fixed: Affine2,
}

impl PlacedLevel<'_> {
    /// Returns where a pixel of the fixed level lies in the moving level, or `None` if that place is not valid.
    #[inline(always)]
    pub(super) fn cell(&self, x: usize, y: usize) -> Option<BilinearCell> {
        let there = self.moving_from_fixed.apply([x as f64, y as f64]);
        let size = [self.valid.width(), self.valid.height()];
        BilinearCell::at(size, there).filter(|cell| cell.value(self.valid) >= 0.5)
    }

    /// Calls a function for each pixel of the fixed level that is valid in both levels, with the pixel's column, its row,
    /// and its position in the moving level.
    #[inline(always)]
    pub(super) fn each_common_pixel(
        &self,
        fixed_valid: &Grid<f32>,
        mut visit: impl FnMut(usize, usize, BilinearCell),
    ) {
        for y in 0..fixed_valid.height() {
            for (x, valid) in fixed_valid.row(y).iter().enumerate() {
                if *valid != 0.0
                    && let Some(cell) = self.cell(x, y)
                {
                    visit(x, y, cell);
                }
            }
        }
    }
}

/// How much of each level's strokes the other level covers, 0..=1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PoseOverlap {
    /// Fraction of the stroke tops (the amount of the moving level) that the ink covers.
    pub(crate) moving_covered: f64,
    /// Fraction of the ink (the amount of the fixed level) that lies on stroke tops.
    pub(crate) fixed_covered: f64,
}

impl PoseOverlap {
    /// Computes both fractions over the pixels that are valid in both levels. The fraction of a level without strokes
    /// is 0.
    pub(super) fn new(
        fixed: &PyramidLevel,
        fixed_valid: &Grid<f32>,
        placed: &PlacedLevel<'_>,
    ) -> Self {
        let (mut both, mut ink, mut relief) = (0.0, 0.0, 0.0);
        let relief_amount = &placed.moving.amount;
        dispatch!(placed.each_common_pixel(
            fixed_valid,
            #[inline(always)]
            |x, y, cell| {
                let (a, b) = (fixed.amount.at(x, y), cell.value(relief_amount));
                both += f64::from(a.min(b));
                ink += f64::from(a);
                relief += f64::from(b);
            },
        ));
        let share = |of: f64| if of > 0.0 { both / of } else { 0.0 };
        Self {
            moving_covered: share(relief),
            fixed_covered: share(ink),
        }
    }
}
