//! Pixels that two levels have in common at a pose, and the shares of their amounts that overlap there.

use super::PyramidLevel;
use super::pyramid::BilinearCell;
use crate::domain::Affine2;
use crate::raster::Grid;

/// A moving level with its valid mask and the map from fixed to moving working pixels.
pub(super) struct PlacedLevel<'a> {
    pub(super) moving: &'a PyramidLevel,
    pub(super) valid: &'a Grid<f32>,
    pub(super) moving_from_fixed: Affine2,
}

impl PlacedLevel<'_> {
    /// Returns the position in the moving level of a pixel of the fixed one; `None` where it is not valid.
    pub(super) fn cell(&self, x: usize, y: usize) -> Option<BilinearCell> {
        let there = self.moving_from_fixed.apply([x as f64, y as f64]);
        let size = [self.valid.width(), self.valid.height()];
        BilinearCell::at(size, there).filter(|cell| cell.value(self.valid) >= 0.5)
    }

    /// Returns column, row and position in the moving level of each pixel of the fixed level that is valid in both.
    pub(super) fn common_pixels(
        &self,
        fixed_valid: &Grid<f32>,
    ) -> impl Iterator<Item = (usize, usize, BilinearCell)> {
        let rows = 0..fixed_valid.height();
        let pixels = rows.flat_map(|y| (0..fixed_valid.width()).map(move |x| (x, y)));
        pixels
            .filter(|(x, y)| fixed_valid.at(*x, *y) != 0.0)
            .filter_map(|(x, y)| Some((x, y, self.cell(x, y)?)))
    }
}

/// How much of each level's amount is covered by the other, 0..=1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PoseOverlap {
    /// Share of the moving amount covered by the fixed one: the share of the stroke tops that has printed.
    pub(crate) moving_covered: f64,
    /// Share of the fixed amount covered by the moving one: the share of the ink with stroke tops under it.
    pub(crate) fixed_covered: f64,
}

impl PoseOverlap {
    /// Computes the shares on the pixels that are valid in both levels; zeros if there are none.
    pub(super) fn new(
        fixed: &PyramidLevel,
        fixed_valid: &Grid<f32>,
        placed: &PlacedLevel<'_>,
    ) -> Self {
        let (mut both, mut ink, mut relief) = (0.0, 0.0, 0.0);
        for (x, y, cell) in placed.common_pixels(fixed_valid) {
            let (a, b) = (fixed.amount.at(x, y), cell.value(&placed.moving.amount));
            both += f64::from(a.min(b));
            ink += f64::from(a);
            relief += f64::from(b);
        }
        let share = |of: f64| if of > 0.0 { both / of } else { 0.0 };
        Self {
            moving_covered: share(relief),
            fixed_covered: share(ink),
        }
    }
}
