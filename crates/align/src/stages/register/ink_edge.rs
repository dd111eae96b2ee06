//! Distances to the edge of the ink, from which the spread of the ink is estimated and corrected.

use mocban_core::raster::{Grid, Mask};
use mocban_core::simd::{dispatch, min_f32};

/// Largest distance that is measured, in pixels. Larger distances are set to this.
pub(super) const REACH: usize = 8;
/// `mean_near` averages only distances that differ from its previous estimate by less than this, in pixels.
const NEAR: f32 = 2.0;
/// Number of times that `mean_near` improves its estimate.
const ROUNDS: usize = 3;

/// Signed distance of each pixel to the edge of the ink, in pixels: positive on ink, negative on the background.
pub(super) struct InkEdge(Grid<f32>);

impl InkEdge {
    /// Measures the distances.
    pub(super) fn of(ink: &Mask) -> Self {
        let [outside, inside] = [distances(&ink.map(|ink| !ink)), distances(ink)];
        // The edge lies halfway between two pixels.
        Self(outside.zip_map(&inside, |outside, inside| {
            if inside > 0.0 {
                inside - 0.5
            } else {
                0.5 - outside
            }
        }))
    }

    /// Returns the distance at an index of the grid's data.
    pub(super) fn at(&self, index: usize) -> f32 {
        self.0.data()[index]
    }

    /// Returns the distance of each pixel.
    pub(super) const fn grid(&self) -> &Grid<f32> {
        &self.0
    }

    /// Returns all distances.
    pub(super) fn distances(&self) -> &[f32] {
        self.0.data()
    }

    /// Returns the ink whose edge is moved inward by `spread` pixels, or outward if `spread` is negative.
    pub(super) fn corrected(&self, spread: f64) -> Mask {
        self.0.map(|distance| f64::from(*distance) > spread)
    }

    /// Returns a robust mean, which starts at the median and ignores outliers. Returns 0 if there are no distances.
    pub(super) fn mean_near(distances: &mut [f32]) -> f64 {
        if distances.is_empty() {
            return 0.0;
        }
        let half = distances.len() / 2;
        let mut mean = f64::from(*distances.select_nth_unstable_by(half, f32::total_cmp).1);
        for _ in 0..ROUNDS {
            let is_near = |d: &&f32| (f64::from(**d) - mean).abs() < f64::from(NEAR);
            let (sum, count) = distances
                .iter()
                .filter(is_near)
                .fold((0.0, 0_u32), |(sum, count), d| {
                    (sum + f64::from(*d), count + 1)
                });
            if count > 0 {
                mean = sum / f64::from(count);
            }
        }
        mean
    }
}

/// Returns the distance from each set pixel to the nearest unset pixel, at most [`REACH`] pixels. The distance of an
/// unset pixel is 0. Pixels outside the mask count as set.
fn distances(mask: &Mask) -> Grid<f32> {
    let (width, height) = (mask.width(), mask.height());
    let most = REACH as f32;
    // Distances along columns first: from above, then from below.
    let mut columns = mask.map(|set| if *set { most } else { 0.0 });
    let data = columns.data_mut();
    let mut step = |from: usize, to: usize| {
        let (from, to) = (from * width, to * width);
        for x in 0..width {
            data[to + x] = min_f32(data[to + x], data[from + x] + 1.0);
        }
    };
    (1..height).for_each(|y| step(y - 1, y));
    (1..height).rev().for_each(|y| step(y, y - 1));
    // A pixel more than `REACH` columns away cannot lie within `REACH`.
    let mut padded = vec![most * most; width + 2 * REACH];
    let mut nearest = vec![0.0; width];
    let mut all = Vec::with_capacity(width * height);
    for y in 0..height {
        for (square, distance) in padded[REACH..].iter_mut().zip(columns.row(y)) {
            *square = distance * distance;
        }
        dispatch!(nearest_in_row(&padded, &mut nearest));
        all.extend(nearest.iter().map(|square: &f32| square.sqrt()));
    }
    Grid::from_vec(width, height, all).expect("one distance per pixel")
}

/// Computes the squared distances of the pixels of a row, from the squared distances along the columns.
#[inline(always)]
fn nearest_in_row(padded: &[f32], nearest: &mut [f32]) {
    let width = nearest.len();
    nearest.fill((REACH * REACH) as f32);
    for shift in 0..=2 * REACH {
        let across = (shift.abs_diff(REACH) * shift.abs_diff(REACH)) as f32;
        for (nearest, square) in nearest.iter_mut().zip(&padded[shift..shift + width]) {
            *nearest = min_f32(*nearest, square + across);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{InkEdge, REACH, distances};
    use mocban_core::raster::Mask;

    #[test]
    fn distances_equal_those_of_a_search_over_all_pixels() {
        let mask = Mask::from_fn(30, 23, |x, y| (x * 7 + y * y * 3) % 11 > 1 && x + y > 9);
        let found = distances(&mask);
        for (at, distance) in found.data().iter().enumerate() {
            let [x, y] = [at % 30, at / 30];
            let to = |k: usize| ((k % 30).abs_diff(x) as f32).hypot((k / 30).abs_diff(y) as f32);
            let nearest = (0..30 * 23)
                .filter(|k| !mask.data()[*k])
                .map(to)
                .fold(REACH as f32, f32::min);
            assert!((distance - nearest).abs() < 1e-5, "{distance} at {x}, {y}");
        }
    }

    #[test]
    fn corrected_ink_is_narrower_by_the_spread_on_each_side() {
        let edge = InkEdge::of(&Mask::from_fn(20, 4, |x, _| (5..15).contains(&x)));
        let width = |spread| edge.corrected(spread).count() / 4;
        assert_eq!([-2.0, 0.0, 2.0].map(width), [14, 10, 6]);
    }

    #[test]
    fn mean_of_distances_ignores_the_few_that_are_far_away() {
        let mut values: Vec<f32> = [1.0, 1.5, 2.0].repeat(10);
        values.extend([-8.0; 9]);
        assert!((InkEdge::mean_near(&mut values) - 1.5).abs() < 1e-6);
        assert_eq!(InkEdge::mean_near(&mut []), 0.0);
    }
}
