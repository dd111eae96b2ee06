//! Shares of two levels that overlap at a pose.

use super::PyramidLevel;
use super::pyramid::BilinearCell;
use crate::domain::Affine2;
use crate::raster::Grid;

/// How much of each level's amount is covered by the other, 0..=1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::stages) struct PoseOverlap {
    /// Share of the moving amount covered by the fixed one: of the stroke tops, what has printed.
    pub(in crate::stages) moving_covered: f64,
    /// Share of the fixed amount covered by the moving one: of the ink, what has stroke tops under it.
    pub(in crate::stages) fixed_covered: f64,
}

impl PoseOverlap {
    /// Computes the shares on the valid pixels of the fixed and the moving level; zeros if there are none.
    /// `moving_from_fixed` maps working pixels.
    pub(super) fn new(
        [fixed, moving]: [&PyramidLevel; 2],
        [fixed_valid, moving_valid]: [&Grid<f32>; 2],
        moving_from_fixed: &Affine2,
    ) -> Self {
        let (mut both, mut ink, mut relief) = (0.0, 0.0, 0.0);
        let size = [moving_valid.width(), moving_valid.height()];
        for y in 0..fixed.amount.height() {
            let row = fixed_valid
                .row(y)
                .iter()
                .zip(fixed.amount.row(y))
                .enumerate();
            for (x, (_, a)) in row.filter(|(_, (fixed_valid, _))| **fixed_valid != 0.0) {
                let there = moving_from_fixed.apply([x as f64, y as f64]);
                let there =
                    BilinearCell::at(size, there).filter(|at| at.value(moving_valid) >= 0.5);
                let Some(there) = there else {
                    continue;
                };
                let (a, b) = (*a, there.value(&moving.amount));
                both += f64::from(a.min(b));
                ink += f64::from(a);
                relief += f64::from(b);
            }
        }
        let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
        Self {
            moving_covered: share(both, relief),
            fixed_covered: share(both, ink),
        }
    }
}
