//! How much of each picture the other explains, where both are known.

use super::Layer;
use super::layer::sample;
use crate::domain::Affine2;

/// Shares of two pictures that lie on each other at a pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::stages) struct Overlap {
    /// Share of the moving picture's amount that meets the fixed one's: of the tops, what has printed.
    pub(in crate::stages) moving_met: f64,
    /// Share of the fixed picture's amount that meets the moving one's: of the ink, what has tops under it.
    pub(in crate::stages) fixed_met: f64,
}

impl Overlap {
    /// Of two layers, given where the fixed one's pixels lie in the moving one; zeros where they do not meet.
    pub(super) fn of(fixed: &Layer, moving: &Layer, moving_from_fixed: &Affine2) -> Self {
        let (mut both, mut ink, mut wood) = (0.0, 0.0, 0.0);
        for y in 0..fixed.amount.height() {
            for x in 0..fixed.amount.width() {
                if fixed.weight.at(x, y) == 0.0 {
                    continue;
                }
                let there = moving_from_fixed.apply([x as f64, y as f64]);
                if sample(&moving.weight, there) < 0.5 {
                    continue;
                }
                let (a, b) = (fixed.amount.at(x, y), sample(&moving.amount, there));
                both += f64::from(a.min(b));
                ink += f64::from(a);
                wood += f64::from(b);
            }
        }
        let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 0.0 };
        Self {
            moving_met: share(both, wood),
            fixed_met: share(both, ink),
        }
    }
}
