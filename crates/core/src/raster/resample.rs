//! Resampling to another size along the axes: a box filter shrinks, and linear interpolation enlarges.

use super::Grid;
use crate::domain::cancel::poll;
use crate::simd::dispatch;

/// Resamples values to a grid of `to` columns and rows. Source pixel x lies at `scale * x + shift` of the result.
///
/// Each output pixel is the mean of the source over a square: the pixel's own square if it is larger than a source
/// pixel, else a square of one source pixel. Outside the source, values count as zero.
///
/// ```
/// use mocban_core::raster::{Grid, resample};
///
/// // Half the size: output pixel 0 covers source pixels 0 and 1, whose centre is at 0.5.
/// let ramp = Grid::from_fn(4, 2, |x, _| x as f32);
/// let half = resample(&ramp, 0.5, [-0.25, -0.25], [2, 1]);
/// assert_eq!(half.data(), [0.5, 2.5]);
/// ```
pub fn resample(values: &Grid<f32>, scale: f64, shift: [f64; 2], to: [usize; 2]) -> Grid<f32> {
    if scale <= 1.0 {
        return resample_transposed(values, scale, shift, to).transposed();
    }
    // Transposes the grid while it is small.
    let from = [values.width(), values.height()];
    let [columns, rows] = BoxFilter::both(from, to, scale, shift);
    rows.mix_rows(&columns.mix_rows(&values.transposed()).transposed())
}

/// Resamples like [`resample`] and returns the transposed grid.
pub fn resample_transposed(
    values: &Grid<f32>,
    scale: f64,
    shift: [f64; 2],
    to: [usize; 2],
) -> Grid<f32> {
    let from = [values.width(), values.height()];
    let [columns, rows] = BoxFilter::both(from, to, scale, shift);
    // Rows are summed by SIMD, so the columns are transposed into rows before they are summed.
    columns.mix_rows(&rows.mix_rows(values).transposed())
}

/// The filter along one axis: the source pixels of each output pixel, and their weights.
struct BoxFilter {
    /// First source pixel of each output pixel, and the end of its range in `weights`.
    each: Vec<(usize, usize)>,
    weights: Vec<f32>,
}

impl BoxFilter {
    /// Creates the filters along x and y.
    fn both(from: [usize; 2], to: [usize; 2], scale: f64, shift: [f64; 2]) -> [Self; 2] {
        [0, 1].map(|k: usize| Self::new(from[k], to[k], scale, shift[k]))
    }

    /// Creates the filter of `to` output pixels over `from` source pixels.
    fn new(from: usize, to: usize, scale: f64, shift: f64) -> Self {
        let length = (1.0 / scale).max(1.0);
        let mut weights = Vec::with_capacity(to * ((length as usize).min(from) + 2));
        let reach = |i| {
            let centre = (i as f64 - shift) / scale;
            let (low, high) = (centre - length / 2.0, centre + length / 2.0);
            let first = (low + 0.5).floor().clamp(0.0, from as f64) as usize;
            let end = ((high + 0.5).ceil().clamp(0.0, from as f64) as usize).max(first);
            weights.extend((first..end).map(|j| {
                let j = j as f64;
                ((high.min(j + 0.5) - low.max(j - 0.5)).max(0.0) / length) as f32
            }));
            (first, weights.len())
        };
        Self {
            each: (0..to).map(reach).collect(),
            weights,
        }
    }

    /// Computes output rows as weighted sums of source rows.
    fn mix_rows(&self, values: &Grid<f32>) -> Grid<f32> {
        let width = values.width();
        let mut out = Grid::new(width, self.each.len(), 0.0_f32);
        let mut rows = out.data_mut().chunks_exact_mut(width.max(1));
        let mut start = 0;
        dispatch!({
            for ((first, end), row) in self.each.iter().zip(&mut rows) {
                poll();
                let weights = &self.weights[start..*end];
                start = *end;
                let (fours, rest) = weights.as_chunks::<4>();
                for (k, weights) in fours.iter().enumerate() {
                    add(row, values, first + 4 * k, *weights);
                }
                let first = first + 4 * fours.len();
                match *rest {
                    [a, b, c] => add(row, values, first, [a, b, c]),
                    [a, b] => add(row, values, first, [a, b]),
                    [a] => add(row, values, first, [a]),
                    _ => {}
                }
            }
        });
        out
    }
}

/// Adds `N` weighted rows to a row, in order.
#[inline(always)]
fn add<const N: usize>(row: &mut [f32], values: &Grid<f32>, first: usize, weights: [f32; N]) {
    let width = row.len();
    let rows = &values.data()[first * width..][..N * width];
    let rows: [&[f32]; N] = std::array::from_fn(|k| &rows[k * width..][..width]);
    for x in 0..width {
        let mut sum = row[x];
        for k in 0..N {
            sum += weights[k] * rows[k][x];
        }
        row[x] = sum;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{resample, resample_transposed};
    use crate::raster::Grid;

    #[test]
    fn shrinking_keeps_the_mean_and_growing_is_linear() {
        let ramp = Grid::from_fn(12, 8, |x, y| (x + 10 * y) as f32);
        let half = resample(&ramp, 0.5, [-0.25, -0.25], [6, 4]);
        assert!((half.at(0, 0) - (0.0 + 1.0 + 10.0 + 11.0) / 4.0).abs() < 1e-5);
        assert!((half.at(5, 3) - (70.0 + 71.0 + 80.0 + 81.0) / 4.0).abs() < 1e-4);
        let turned = resample_transposed(&ramp, 0.5, [-0.25, -0.25], [6, 4]);
        assert_eq!(turned.transposed(), half);
        let double = resample(&ramp, 2.0, [0.5, 0.5], [24, 16]);
        assert!((double.at(6, 4) - (2.75 + 17.5)).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn equals_the_mean_over_each_square(
            [width, height] in [1_usize..30, 1_usize..30],
            [columns, rows] in [1_usize..30, 1_usize..30],
            scale in 0.08..2.5_f64,
            shift in prop::array::uniform2(-4.0..9.0_f64),
        ) {
            let from = Grid::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 17) as f32);
            let found = resample(&from, scale, shift, [columns, rows]);
            let length = (1.0 / scale).max(1.0);
            let share = |i: usize, shift: f64, j: usize| {
                let (centre, j) = ((i as f64 - shift) / scale, j as f64);
                let (low, high) = (centre - length / 2.0, centre + length / 2.0);
                ((high.min(j + 0.5) - low.max(j - 0.5)) / length).max(0.0)
            };
            for y in 0..rows {
                for x in 0..columns {
                    let mut mean = 0.0;
                    for j in 0..height {
                        for i in 0..width {
                            let weight = share(x, shift[0], i) * share(y, shift[1], j);
                            mean += weight * f64::from(from.at(i, j));
                        }
                    }
                    prop_assert!((f64::from(found.at(x, y)) - mean).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn beyond_the_source_there_is_nothing() {
        let ones = Grid::new(4, 4, 1.0_f32);
        let moved = resample(&ones, 1.0, [6.0, 0.5], [8, 4]);
        assert_eq!(moved.at(5, 1), 0.0);
        assert_eq!(moved.at(6, 1), 1.0);
        assert_eq!(moved.at(6, 0), 0.5);
    }
}
