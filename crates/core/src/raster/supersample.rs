//! Supersampling: computes an output pixel from several positions in the source by bilinear interpolation.

use std::ops::Range;

use super::Grid;
use crate::domain::Affine2;

/// Largest number of samples along a side of an output pixel. If a map needs more, its result is aliased.
const MAX_SAMPLES_PER_SIDE: usize = 8;
/// Largest spacing of the samples, in source pixels. Each sample interpolates the four source pixels around it, so no
/// pixel between two samples is missed.
const SAMPLE_SPACING_PX: f64 = 1.5;

/// The sample positions of output pixels in the source.
pub(super) struct Supersampler {
    from_to: Affine2,
    per_side: usize,
    /// Offsets of samples from the pixel's centre along an axis, in output pixels. Only the first `per_side` count.
    offsets: [f64; MAX_SAMPLES_PER_SIDE],
    /// Largest offsets of a sample from the pixel's centre along x and y, in source pixels.
    spread: [f64; 2],
}

impl Supersampler {
    pub(super) fn new(from_to: &Affine2) -> Self {
        let per_side =
            ((from_to.scale() / SAMPLE_SPACING_PX).ceil() as usize).clamp(1, MAX_SAMPLES_PER_SIDE);
        let outermost = 0.5 - 0.5 / per_side as f64;
        Self {
            from_to: *from_to,
            per_side,
            offsets: std::array::from_fn(|i| (i as f64 + 0.5) / per_side as f64 - 0.5),
            spread: from_to
                .0
                .map(|row| outermost * (row[0].abs() + row[1].abs())),
        }
    }

    /// Calls `visit` with the source position of each sample of an output pixel, row by row.
    #[inline(always)]
    pub(super) fn for_each_sample(&self, x: usize, y: usize, mut visit: impl FnMut([f64; 2])) {
        let offsets = &self.offsets[..self.per_side];
        for down in offsets {
            for across in offsets {
                visit(self.from_to.apply([x as f64 + across, y as f64 + down]));
            }
        }
    }

    /// Returns the coverage of an output pixel for each level in `least`, up to `sample_count`. Each sample adds the
    /// bilinear weights of those of its four source pixels whose value is at least the level.
    #[inline(always)]
    pub(super) fn coverage<T: Copy + Default + Into<f64>, const LEVELS: usize>(
        &self,
        x: usize,
        y: usize,
        values: &Grid<T>,
        least: &[f64; LEVELS],
        cell: impl Fn(&Grid<T>, [f64; 2]) -> ([T; 4], [f64; 2]),
    ) -> [f64; LEVELS] {
        let mut covered = [0.0; LEVELS];
        self.for_each_sample(
            x,
            y,
            #[inline(always)]
            |place| {
                let (near, within) = cell(values, place);
                let weights = bilinear_weights(within);
                for i in 0..4 {
                    let value: f64 = near[i].into();
                    for k in 0..LEVELS {
                        covered[k] += if value >= least[k] { weights[i] } else { 0.0 };
                    }
                }
            },
        );
        covered
    }

    pub(super) fn sample_count(&self) -> usize {
        self.per_side * self.per_side
    }

    /// Returns the mean of `value` over the samples of an output pixel, ignoring samples without a value. Returns
    /// `None` if half of the samples or more have no value.
    #[inline(always)]
    pub(super) fn mean(
        &self,
        x: usize,
        y: usize,
        value: impl Fn([f64; 2]) -> Option<f64>,
    ) -> Option<f64> {
        let (mut sum, mut found) = (0.0, 0_usize);
        self.for_each_sample(
            x,
            y,
            #[inline(always)]
            |place| {
                if let Some(v) = value(place) {
                    sum += v;
                    found += 1;
                }
            },
        );
        let count = self.sample_count();
        (2 * found > count || (count == 1 && found == 1)).then(|| sum / found as f64)
    }

    /// Returns the mean level of an output pixel. All source pixels around its samples must exist and have data.
    #[inline(always)]
    pub(super) fn mean_inside(&self, x: usize, y: usize, levels: &Grid<u16>) -> f64 {
        let mut sum = 0.0;
        self.for_each_sample(
            x,
            y,
            #[inline(always)]
            |place| {
                let (near, within) = bilinear_cell_inside(levels, place);
                sum += interpolate(near.map(f64::from), within);
            },
        );
        sum / self.sample_count() as f64
    }

    /// Returns the source pixels that the samples of a box of output pixels may read: the first and last column, and
    /// the first and last row. They may lie outside the grid.
    pub(super) fn source_bounds(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) -> [[i64; 2]; 2] {
        const SLACK: f64 = 1e-6;
        // No grid reaches as far, and sums of such numbers do not overflow.
        const FAR: f64 = (1_u64 << 52) as f64;
        let floor = |value: f64| floor(value.clamp(-FAR, FAR));
        let ends = |range: &Range<usize>| [range.start as f64, range.end as f64 - 1.0];
        let ([left, right], [top, bottom]) = (ends(columns), ends(rows));
        let middle = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        let middle = self.from_to.apply(middle);
        let [across, down] = [(right - left) / 2.0, (bottom - top) / 2.0];
        [0, 1].map(|k| {
            let [a, b, _] = self.from_to.0[k].map(f64::abs);
            let reach = a * across + b * down + self.spread[k] + SLACK;
            [floor(middle[k] - reach), floor(middle[k] + reach) + 1]
        })
    }
}

/// Rounds down by a cast and a comparison, because `f64::floor` would be a function call. Values below the range of the
/// integers wrap around to the largest one, which is also outside of every grid.
fn floor(value: f64) -> i64 {
    let cut = value as i64;
    cut.wrapping_sub(i64::from(cut as f64 > value))
}

/// Returns the values of the four pixels around a position, and the position's offset from the upper left one, 0..1.
/// Pixels outside the grid have the default value.
#[inline(always)]
pub(super) fn bilinear_cell<T: Copy + Default>(
    values: &Grid<T>,
    [x, y]: [f64; 2],
) -> ([T; 4], [f64; 2]) {
    let (x0, y0) = (floor(x), floor(y));
    let width = values.width();
    let is_inside = |i: i64, side: usize| i >= 0 && i < side as i64 - 1;
    let near = if is_inside(x0, width) && is_inside(y0, values.height()) {
        let from = &values.data()[y0 as usize * width + x0 as usize..][..width + 2];
        [from[0], from[1], from[width], from[width + 1]]
    } else {
        // The largest integer wraps around to the smallest one: both are outside.
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
            let (x, y) = (x0.wrapping_add(dx), y0.wrapping_add(dy));
            values.get(x, y).unwrap_or_default()
        })
    };
    (near, [x - x0 as f64, y - y0 as f64])
}

/// Returns the same as [`bilinear_cell`] for a position whose four pixels are within the grid.
#[inline(always)]
pub(super) fn bilinear_cell_inside<T: Copy>(
    values: &Grid<T>,
    [x, y]: [f64; 2],
) -> ([T; 4], [f64; 2]) {
    // The position is not negative, so a cast rounds down.
    let (column, row) = (x as i32, y as i32);
    let width = values.width();
    let from = row as usize * width + column as usize;
    let near = &values.data()[from..from + width + 2];
    let near = [near[0], near[1], near[width], near[width + 1]];
    (near, [x - f64::from(column), y - f64::from(row)])
}

/// Interpolates between a pixel, its right neighbour, and the two below.
#[inline(always)]
pub(super) fn interpolate([a, b, c, d]: [f64; 4], [fx, fy]: [f64; 2]) -> f64 {
    let (above, below) = (a + (b - a) * fx, c + (d - c) * fx);
    above + (below - above) * fy
}

/// Returns the bilinear weights of a pixel, its right neighbour, and the two pixels below them.
#[inline(always)]
pub(super) fn bilinear_weights([fx, fy]: [f64; 2]) -> [f64; 4] {
    let (left, above) = (1.0 - fx, 1.0 - fy);
    [left * above, fx * above, left * fy, fx * fy]
}

#[cfg(test)]
mod tests {
    use super::{Supersampler, bilinear_cell};
    use crate::domain::Affine2;
    use crate::raster::Grid;

    const EXTREMES: [f64; 6] = [
        1e300,
        -1e300,
        i64::MAX as f64,
        i64::MIN as f64,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];

    #[test]
    fn positions_far_away_have_no_pixels_around_them() {
        let grid = Grid::new(3, 2, 7_u8);
        for far in EXTREMES {
            for place in [[far, 0.5], [0.5, far], [far, far]] {
                assert_eq!(bilinear_cell(&grid, place).0, [0; 4], "{place:?}");
            }
        }
        // Not a number counts as 0, and the offset is not a number either.
        let (_, within) = bilinear_cell(&grid, [f64::NAN, 0.5]);
        assert!(within[0].is_nan());
    }

    #[test]
    fn bounds_of_extreme_maps_hold_every_grid_that_their_samples_may_meet() {
        for far in EXTREMES {
            let shifted = Supersampler::new(&Affine2([[1.0, 0.0, far], [0.0, 1.0, 0.0]]));
            let [[first, last], [top, bottom]] = shifted.source_bounds(&(0..4), &(0..4));
            assert!(last < 0 || first > 1 << 40, "{far}: {first}..={last}");
            assert!(top <= 0 && bottom >= 3, "{far}: {top}..={bottom}");
        }
        let scaled = Supersampler::new(&Affine2([[1e300, 0.0, -1e300], [0.0, 1.0, 0.0]]));
        let [[first, last], _] = scaled.source_bounds(&(0..4), &(0..4));
        assert!(first < -(1 << 40) && last > 1 << 40, "{first}..={last}");
    }
}
