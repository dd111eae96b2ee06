//! Gaussian smoothing of values, by three box means (the classic approximation), zero beyond the rim.

use crate::raster::Grid;
use crate::wide::widely;

/// Values smoothed with a gaussian of `sigma` pixels; unchanged when `sigma` is below half a pixel.
///
/// Beyond the rim values are taken to be zero, so divide by the smoothed weight where that matters.
pub(super) fn blur(values: &Grid<f32>, sigma: f64) -> Grid<f32> {
    if sigma < 0.5 {
        return values.clone();
    }
    // Three boxes of half-width r have the variance r (r + 1) of one gaussian: three whole half-widths whose mean is
    // as close to that as it can be.
    let half = ((1.0 + 4.0 * sigma * sigma).sqrt() - 1.0) / 2.0;
    let whole = |pass: u32| (half * f64::from(pass)).round() as usize;
    let radii = [0, 1, 2].map(|pass| whole(pass + 1) - whole(pass));
    // Columns are summed side by side, so rows are turned into columns for their turn.
    down(down(values.clone(), radii).transposed(), radii).transposed()
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

fn box_columns(values: &Grid<f32>, radius: usize, means: &mut Grid<f32>) {
    let (width, height) = (values.width(), values.height());
    let mut sums = vec![0.0_f32; width];
    let scale = 1.0 / (2 * radius + 1) as f32;
    widely(
        #[inline(always)]
        || {
            for y in 0..height + radius {
                if y < height {
                    add(&mut sums, values.row(y), 1.0);
                }
                if y > 2 * radius {
                    add(&mut sums, values.row(y - 2 * radius - 1), -1.0);
                }
                if y >= radius {
                    let row = &mut means.data_mut()[(y - radius) * width..][..width];
                    for (out, sum) in row.iter_mut().zip(&sums) {
                        *out = sum * scale;
                    }
                }
            }
        },
    );
}

#[inline(always)]
fn add(sums: &mut [f32], row: &[f32], sign: f32) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += sign * value;
    }
}

#[cfg(test)]
mod tests {
    use super::blur;
    use crate::raster::Grid;

    #[test]
    fn keeps_the_sum_and_has_the_variance() {
        let mut dot = Grid::new(61, 61, 0.0_f32);
        dot.set(30, 30, 1.0);
        for sigma in [1.0, 2.0, 4.0] {
            let soft = blur(&dot, sigma);
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
