//! Two poses judged on the same ground.
//!
//! What only one of them lays on known paper would decide between poses that are else alike, so it does not count.

use super::PyramidLevel;
use super::pyramid::Between;
use crate::domain::Affine2;
use crate::raster::Grid;

/// A moving picture with where the fixed one's pixels lie in it.
pub(super) struct Side<'a> {
    pub(super) moving: &'a PyramidLevel,
    pub(super) ground: &'a Grid<f32>,
    pub(super) moving_from_fixed: Affine2,
}

/// The scores of two poses over the ground of all pictures: correlation times the share of the moving picture's amount that
/// meets the fixed one's, 0..=1.
pub(super) fn duel(fixed: &PyramidLevel, paper: &Grid<f32>, sides: &[Side<'_>; 2]) -> [f64; 2] {
    let mut sums = [Sums::default(); 2];
    for y in 0..paper.height() {
        for x in 0..paper.width() {
            if paper.at(x, y) == 0.0 {
                continue;
            }
            let place = [x as f64, y as f64];
            let there = [0, 1].map(|k: usize| sides[k].moving_from_fixed.apply(place));
            let there = [0, 1].map(|k: usize| {
                let ground = sides[k].ground;
                Between::of([ground.width(), ground.height()], there[k])
                    .filter(|at| at.value(ground) >= 0.5)
            });
            let [Some(one), Some(two)] = there else {
                continue;
            };
            let ink = [fixed.value.at(x, y), fixed.amount.at(x, y)];
            for ((at, side), sums) in [one, two].iter().zip(sides).zip(&mut sums) {
                let PyramidLevel { value, amount, .. } = side.moving;
                sums.add(ink, [value, amount].map(|of| at.value(of)));
            }
        }
    }
    sums.map(|sums| sums.score())
}

/// Sums over the pixels of two pictures.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    /// Of the values, their squares and their products.
    values: [f64; 2],
    squares: [f64; 2],
    products: f64,
    /// Of the moving amount, and of what of it meets the fixed one's.
    amount: f64,
    met: f64,
}

impl Sums {
    /// Takes in value and amount of the fixed and the moving picture.
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
    use super::super::border_mask::own_ground;
    use super::{Side, duel};
    use crate::domain::Affine2;
    use crate::stages::pose::PyramidLevel;
    use crate::stages::pose::border_mask::tests::{SIDE, layer};

    fn scores(print: &PyramidLevel, relief: &PyramidLevel) -> [f64; 2] {
        let last = (relief.amount.width() - 1) as f64;
        let as_read = Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let mirrored = Affine2([[-1.0, 0.0, last], [0.0, 1.0, 0.0]]);
        let (paper, ground) = (own_ground(print), own_ground(relief));
        let side = |moving_from_fixed| Side {
            moving: relief,
            ground: &ground,
            moving_from_fixed,
        };
        duel(print, &paper, &[side(as_read), side(mirrored)])
    }

    /// A beam that is heavier at its right end, on a stem.
    const CHARACTER: [[usize; 4]; 3] = [[14, 20, 50, 26], [42, 12, 50, 26], [29, 20, 35, 50]];

    #[test]
    fn a_small_difference_within_the_character_tells_the_mirror() {
        let [as_read, mirrored] = scores(&layer(&CHARACTER), &layer(&CHARACTER));
        assert!(as_read > 0.99, "{as_read}");
        assert!(mirrored < 0.95 * as_read, "{mirrored} of {as_read}");
    }

    #[test]
    fn a_wall_that_falls_on_a_frame_line_only_in_the_mirror_decides_nothing() {
        let with = |bar| layer(&[&CHARACTER[..], &[bar]].concat());
        let (left, right) = ([0, 0, 4, SIDE], [SIDE - 4, 0, SIDE, SIDE]);
        let bare = scores(&layer(&CHARACTER), &layer(&CHARACTER));
        let walled = scores(&with(right), &with(left));
        for (k, score) in walled.into_iter().enumerate() {
            assert!((score - bare[k]).abs() < 0.06, "{walled:?} {bare:?}");
        }
    }
}
