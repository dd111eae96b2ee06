//! How much of each picture the other explains, where both are known.

use super::PyramidLevel;
use super::pyramid::Between;
use crate::domain::Affine2;
use crate::raster::Grid;

/// Shares of two pictures that lie on each other at a pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::stages) struct PoseOverlap {
    /// Share of the moving picture's amount that meets the fixed one's: of the tops, what has printed.
    pub(in crate::stages) moving_covered: f64,
    /// Share of the fixed picture's amount that meets the moving one's: of the ink, what has tops under it.
    pub(in crate::stages) fixed_covered: f64,
}

impl PoseOverlap {
    /// Of the fixed and the moving layer on the grounds on which they can be judged, given where the fixed one's pixels
    /// lie in the moving one; zeros where they do not meet.
    pub(super) fn of(
        [fixed, moving]: [&PyramidLevel; 2],
        [paper, ground]: [&Grid<f32>; 2],
        moving_from_fixed: &Affine2,
    ) -> Self {
        let (mut both, mut ink, mut wood) = (0.0, 0.0, 0.0);
        let size = [ground.width(), ground.height()];
        for y in 0..fixed.amount.height() {
            let row = paper.row(y).iter().zip(fixed.amount.row(y)).enumerate();
            for (x, (_, a)) in row.filter(|(_, (paper, _))| **paper != 0.0) {
                let there = moving_from_fixed.apply([x as f64, y as f64]);
                let there = Between::of(size, there).filter(|at| at.value(ground) >= 0.5);
                let Some(there) = there else {
                    continue;
                };
                let (a, b) = (*a, there.value(&moving.amount));
                both += f64::from(a.min(b));
                ink += f64::from(a);
                wood += f64::from(b);
            }
        }
        let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
        Self {
            moving_covered: share(both, wood),
            fixed_covered: share(both, ink),
        }
    }
}
