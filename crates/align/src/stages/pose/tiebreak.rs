//! Tie-break between two poses on the pixels that are valid for both.
//!
//! Pixels that are valid for only one of the poses are ignored, because the other pose has no value there to compare.

use super::PyramidLevel;
use super::overlap::PlacedLevel;
use mocban_core::raster::Grid;

/// Scores two poses on the pixels that are valid for both. A score, 0..=1, is the correlation (0 if negative) times the
/// fraction of the moving level's amount that the fixed level covers.
pub(super) fn tiebreak_scores(
    fixed: &PyramidLevel,
    fixed_valid: &Grid<f32>,
    candidates: &[PlacedLevel<'_>; 2],
) -> [f64; 2] {
    let mut sums = [TiebreakSums::default(); 2];
    candidates[0].each_common_pixel(fixed_valid, |x, y, one| {
        let Some(two) = candidates[1].cell(x, y) else {
            return;
        };
        let ink = [fixed.value.at(x, y), fixed.amount.at(x, y)];
        for ((cell, candidate), sums) in [one, two].iter().zip(candidates).zip(&mut sums) {
            let PyramidLevel { value, amount, .. } = candidate.moving;
            sums.add(ink, [value, amount].map(|of| cell.value(of)));
        }
    });
    sums.map(|sums| sums.score())
}

/// Sums over corresponding pixels.
#[derive(Debug, Clone, Copy, Default)]
struct TiebreakSums {
    n: f64,
    /// Sums of the values, of their squares and of their products. The fixed level comes first.
    values: [f64; 2],
    squares: [f64; 2],
    products: f64,
    /// Sum of the moving level's amount.
    amount: f64,
    /// Part of `amount` that the fixed level covers.
    met: f64,
}

impl TiebreakSums {
    /// Adds value and amount of the fixed and the moving level.
    fn add(&mut self, fixed: [f32; 2], moving: [f32; 2]) {
        let values = [fixed[0], moving[0]].map(f64::from);
        self.n += 1.0;
        for (k, value) in values.into_iter().enumerate() {
            self.values[k] += value;
            self.squares[k] += value * value;
        }
        self.products += values[0] * values[1];
        self.amount += f64::from(moving[1]);
        self.met += f64::from(moving[1].min(fixed[1]));
    }

    fn score(&self) -> f64 {
        let [a, b] = self.values;
        let n = self.n.max(1.0);
        let spread = |k: usize| (self.squares[k] - self.values[k].powi(2) / n).max(1e-9);
        let correlation = (self.products - a * b / n) / (spread(0) * spread(1)).sqrt();
        correlation.max(0.0) * self.met / self.amount.max(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::super::border_mask::valid_mask;
    use super::{PlacedLevel, tiebreak_scores};
    use crate::stages::pose::PyramidLevel;
    use crate::stages::pose::border_mask::tests::{SIDE, level};
    use mocban_core::domain::Affine2;

    fn scores(print: &PyramidLevel, relief: &PyramidLevel) -> [f64; 2] {
        let last = (relief.amount.width() - 1) as f64;
        let as_read = Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let mirrored = Affine2([[-1.0, 0.0, last], [0.0, 1.0, 0.0]]);
        let (fixed_valid, moving_valid) = (valid_mask(print), valid_mask(relief));
        let candidate = |moving_from_fixed| PlacedLevel {
            moving: relief,
            valid: &moving_valid,
            moving_from_fixed,
        };
        tiebreak_scores(
            print,
            &fixed_valid,
            &[candidate(as_read), candidate(mirrored)],
        )
    }

    /// A beam that is heavier at its right end, on a stem.
    const CHARACTER: [[usize; 4]; 3] = [[14, 20, 50, 26], [42, 12, 50, 26], [29, 20, 35, 50]];

    #[test]
    fn a_small_asymmetry_of_the_character_decides_against_the_mirrored_pose() {
        let [as_read, mirrored] = scores(&level(&CHARACTER), &level(&CHARACTER));
        assert!(as_read > 0.99, "{as_read}");
        assert!(mirrored < 0.95 * as_read, "{mirrored} of {as_read}");
    }

    #[test]
    fn a_wall_that_overlaps_a_frame_line_only_when_mirrored_has_no_effect() {
        let with = |bar| level(&[&CHARACTER[..], &[bar]].concat());
        let (left, right) = ([0, 0, 4, SIDE], [SIDE - 4, 0, SIDE, SIDE]);
        let bare = scores(&level(&CHARACTER), &level(&CHARACTER));
        let walled = scores(&with(right), &with(left));
        for (k, score) in walled.into_iter().enumerate() {
            assert!((score - bare[k]).abs() < 0.06, "{walled:?} {bare:?}");
        }
    }
}
