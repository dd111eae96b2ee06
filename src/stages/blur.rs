//! Gaussian smoothing of values, by three box means (the classic approximation), zero beyond the rim.

use crate::raster::Grid;
use crate::simd::dispatch;

/// Less is not smoothed, pixels.
const LEAST_SIGMA: f64 = 0.5;

/// Values smoothed with a gaussian of `sigma` pixels; unchanged when `sigma` is below half a pixel.
///
/// Beyond the rim values are taken to be zero, so divide by the smoothed weight where that matters.
pub(super) fn gaussian_blur(values: &Grid<f32>, sigma: f64) -> Grid<f32> {
    if sigma < LEAST_SIGMA {
        return values.clone();
    }
    gaussian_blur_transposed(values.transposed(), sigma)
}

/// The same of values whose rows and columns were changed for each other, which they are changed back.
pub(super) fn gaussian_blur_transposed(turned: Grid<f32>, sigma: f64) -> Grid<f32> {
    if sigma < LEAST_SIGMA {
        return turned.transposed();
    }
    // Three boxes of half-width r have the variance r (r + 1) of one gaussian: three whole half-widths whose mean is
    // as close to that as it can be.
    let half = ((1.0 + 4.0 * sigma * sigma).sqrt() - 1.0) / 2.0;
    let whole = |pass: u32| (half * f64::from(pass)).round() as usize;
    let radii = [0, 1, 2].map(|pass| whole(pass + 1) - whole(pass));
    // Columns are summed side by side.
    down(down(turned, radii).transposed(), radii)
}

/// Box means down the columns, one after the other.
fn down(mut values: Grid<f32>, radii: [usize; 3]) -> Grid<f32> {
    let mut means = Grid::new(values.width(), values.height(), 0.0);
    for radius in radii.into_iter().filter(|radius| *radius > 0) {
        box_columns(&values, radius, &mut means);
        std::mem::swap(&mut values, &mut means);
    }
    values
}

/// Columns that are summed side by side: many at a time, so that no sum waits for the last, and few at a time for the
/// rest.
const MANY: usize = 32;
const FEW: usize = 8;

fn box_columns(values: &Grid<f32>, radius: usize, means: &mut Grid<f32>) {
    let width = values.width();
    let (values, means) = (values.data(), means.data_mut());
    dispatch(
        #[inline(always)]
        || {
            let mut left = 0;
            while left + MANY <= width {
                columns::<MANY>(values, width, left, radius, means);
                left += MANY;
            }
            // The last few may be summed twice.
            while left < width && width >= FEW {
                let from = left.min(width - FEW);
                columns::<FEW>(values, width, from, radius, means);
                left = from + FEW;
            }
            for left in left..width {
                columns::<1>(values, width, left, radius, means);
            }
        },
    );
}

/// Means down `N` columns from `left` on.
#[inline(always)]
fn columns<const N: usize>(
    values: &[f32],
    width: usize,
    left: usize,
    radius: usize,
    means: &mut [f32],
) {
    let height = values.len() / width;
    let row = |y: usize| values[y * width + left..].first_chunk::<N>();
    let nothing = [0.0_f32; N];
    let scale = 1.0 / (2 * radius + 1) as f32;
    let mut sums = nothing;
    for y in 0..radius.min(height) {
        let comes = row(y).unwrap_or(&nothing);
        for k in 0..N {
            sums[k] += comes[k];
        }
    }
    for y in 0..height {
        let last = y + radius;
        let comes = if last < height { row(last) } else { None }.unwrap_or(&nothing);
        let goes = if y > radius {
            row(y - radius - 1)
        } else {
            None
        }
        .unwrap_or(&nothing);
        let Some(means) = means[y * width + left..].first_chunk_mut::<N>() else {
            return;
        };
        for k in 0..N {
            sums[k] += comes[k] - goes[k];
            means[k] = sums[k] * scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{down, gaussian_blur};
    use crate::raster::Grid;

    proptest! {
        #[test]
        fn means_are_those_of_one_by_one(
            [width, height] in [1_usize..90, 1_usize..24],
            radius in 1_usize..30,
        ) {
            let grid = Grid::from_fn(width, height, |x, y| ((x * 7 + y * 13) % 17) as f32);
            let means = down(grid.clone(), [0, radius, 0]);
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
    fn keeps_the_sum_and_has_the_variance() {
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
