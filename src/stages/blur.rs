//! Gaussian smoothing of values, by three box means (the classic approximation), zero beyond the rim.

use crate::raster::Grid;

/// Values smoothed with a gaussian of `sigma` pixels; unchanged when `sigma` is below half a pixel.
///
/// Beyond the rim values are taken to be zero, so divide by the smoothed weight where that matters.
pub(super) fn blur(values: &Grid<f32>, sigma: f64) -> Grid<f32> {
    // Three boxes of half-width r have the variance r (r + 1) of one gaussian.
    let half = ((1.0 + 4.0 * sigma * sigma).sqrt() - 1.0) / 2.0;
    let mut out = values.clone();
    if sigma < 0.5 {
        return out;
    }
    for pass in 0..3 {
        // Three whole half-widths whose mean is as close to `half` as it can be.
        let radius =
            ((half * f64::from(pass + 1)).round() - (half * f64::from(pass)).round()) as usize;
        if radius > 0 {
            box_rows(&mut out, radius);
            box_columns(&mut out, radius);
        }
    }
    out
}

fn box_rows(values: &mut Grid<f32>, radius: usize) {
    let width = values.width();
    for y in 0..values.height() {
        let row = &mut values.data_mut()[y * width..(y + 1) * width];
        let copy = row.to_vec();
        running_mean(&copy, radius, |x, mean| row[x] = mean);
    }
}

fn box_columns(values: &mut Grid<f32>, radius: usize) {
    let (width, height) = (values.width(), values.height());
    let mut sums = vec![0.0_f32; width];
    let copy = values.clone();
    let scale = 1.0 / (2 * radius + 1) as f32;
    for y in 0..height + radius {
        if y < height {
            add(&mut sums, copy.row(y), 1.0);
        }
        if y > 2 * radius {
            add(&mut sums, copy.row(y - 2 * radius - 1), -1.0);
        }
        if y >= radius {
            let row = &mut values.data_mut()[(y - radius) * width..(y - radius + 1) * width];
            for (out, sum) in row.iter_mut().zip(&sums) {
                *out = sum * scale;
            }
        }
    }
}

fn add(sums: &mut [f32], row: &[f32], sign: f32) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += sign * value;
    }
}

fn running_mean(values: &[f32], radius: usize, mut set: impl FnMut(usize, f32)) {
    let scale = 1.0 / (2 * radius + 1) as f32;
    let mut sum = 0.0;
    for x in 0..values.len() + radius {
        if x < values.len() {
            sum += values[x];
        }
        if x > 2 * radius {
            sum -= values[x - 2 * radius - 1];
        }
        if x >= radius {
            set(x - radius, sum * scale);
        }
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
