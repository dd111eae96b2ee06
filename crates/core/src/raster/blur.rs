//! Gaussian blur by three box filters (Wells 1986, doi:10.1109/TPAMI.1986.4767776).

use super::Grid;
use crate::domain::cancel::poll;
use crate::simd::dispatch;

/// Sigma below which values stay unchanged, in pixels.
const MIN_SIGMA: f64 = 0.5;

/// Blurs values with a Gaussian of `sigma` pixels. Returns the values unchanged if `sigma` is below half a pixel.
///
/// Values beyond the border count as zero. To correct for this, divide by the blurred mask of the valid pixels.
pub fn gaussian_blur(values: &Grid<f32>, sigma: f64) -> Grid<f32> {
    if sigma < MIN_SIGMA {
        return values.clone();
    }
    gaussian_blur_transposed(values.transposed(), sigma)
}

/// Blurs a transposed image like [`gaussian_blur`]. Returns the blurred image untransposed.
pub fn gaussian_blur_transposed(transposed: Grid<f32>, sigma: f64) -> Grid<f32> {
    if sigma < MIN_SIGMA {
        return transposed.transposed();
    }
    // If r (r + 1) = sigma^2, three boxes of radius r have the variance of the Gaussian. The mean of the three whole
    // radii is as close as possible to this r.
    let half = ((1.0 + 4.0 * sigma * sigma).sqrt() - 1.0) / 2.0;
    let rounded = |pass: u32| (half * f64::from(pass)).round() as usize;
    let radii = [0, 1, 2].map(|pass| rounded(pass + 1) - rounded(pass));
    // Columns are summed in parallel lanes.
    let memory = vec![0.0; transposed.data().len()];
    let [rows, memory] = box_blur_columns(transposed, memory, radii);
    let columns = rows.transposed_in(memory.into_vec());
    let [blurred, _] = box_blur_columns(columns, rows.into_vec(), radii);
    blurred
}

/// Applies box filters down the columns, one after another. `memory` holds as many values. Returns the result, and a grid
/// whose memory is free.
fn box_blur_columns(mut values: Grid<f32>, memory: Vec<f32>, radii: [usize; 3]) -> [Grid<f32>; 2] {
    let mut means = Grid::of(values.width(), values.height(), memory);
    for radius in radii.into_iter().filter(|radius| *radius > 0) {
        box_blur_all_columns(&values, radius, &mut means);
        std::mem::swap(&mut values, &mut means);
    }
    [values, means]
}

/// Columns summed in parallel: many where possible, few for the rest.
const WIDE_COLUMNS: usize = 32;
const NARROW_COLUMNS: usize = 8;

fn box_blur_all_columns(values: &Grid<f32>, radius: usize, means: &mut Grid<f32>) {
    let width = values.width();
    let (values, means) = (values.data(), means.data_mut());
    dispatch!({
        let mut left = 0;
        while left + WIDE_COLUMNS <= width {
            poll();
            box_blur_run::<WIDE_COLUMNS>(values, width, left, radius, means);
            left += WIDE_COLUMNS;
        }
        // The last few columns may be computed twice.
        while left < width && width >= NARROW_COLUMNS {
            let from = left.min(width - NARROW_COLUMNS);
            box_blur_run::<NARROW_COLUMNS>(values, width, from, radius, means);
            left = from + NARROW_COLUMNS;
        }
        for left in left..width {
            box_blur_run::<1>(values, width, left, radius, means);
        }
    });
}

/// Computes box means down `N` columns from `left` on.
#[inline(always)]
fn box_blur_run<const N: usize>(
    values: &[f32],
    width: usize,
    left: usize,
    radius: usize,
    means: &mut [f32],
) {
    let height = values.len() / width;
    let row = |y: usize| values[y * width + left..].first_chunk::<N>();
    let zeros = [0.0_f32; N];
    let scale = 1.0 / (2 * radius + 1) as f32;
    let mut sums = zeros;
    for y in 0..radius.min(height) {
        let entering = row(y).unwrap_or(&zeros);
        for k in 0..N {
            sums[k] += entering[k];
        }
    }
    for y in 0..height {
        let last = y + radius;
        let entering = if last < height { row(last) } else { None }.unwrap_or(&zeros);
        let leaving = y.checked_sub(radius + 1).and_then(row).unwrap_or(&zeros);
        let Some(means) = means[y * width + left..].first_chunk_mut::<N>() else {
            return;
        };
        for k in 0..N {
            sums[k] += entering[k] - leaving[k];
            means[k] = sums[k] * scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{box_blur_columns, gaussian_blur};
    use crate::raster::Grid;

    proptest! {
        #[test]
        fn columns_in_lanes_equal_single_columns(
            [width, height] in [1_usize..90, 1_usize..24],
            radius in 1_usize..30,
        ) {
            let grid = Grid::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 17) as f32);
            let memory = vec![0.0; width * height];
            let [means, _] = box_blur_columns(grid.clone(), memory, [0, radius, 0]);
            for y in 0..height {
                for x in 0..width {
                    let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
                    let sum: f32 = rows.map(|row| grid.at(x, row)).sum();
                    let mean = sum / (2 * radius + 1) as f32;
                    prop_assert!((means.at(x, y) - mean).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn blur_keeps_the_sum_and_has_the_requested_variance() {
        let mut dot = Grid::new(61, 61, 0.0_f32);
        dot.set(30, 30, 1.0);
        for sigma in [1.0, 2.0, 4.0] {
            let soft = gaussian_blur(&dot, sigma);
            let (mut sum, mut variance) = (0.0, 0.0);
            for y in 0..61 {
                for x in 0..61 {
                    let v = f64::from(soft.at(x, y));
                    sum += v;
                    variance += v * (x as f64 - 30.0).powi(2);
                }
            }
            assert!((sum - 1.0).abs() < 1e-4);
            assert!(
                (variance.sqrt() - sigma).abs() < 0.35,
                "{} for {sigma}",
                variance.sqrt()
            );
        }
    }
}
