//! Estimates the brightness of the background by a grey-scale closing. The closing removes narrow dark areas, which are
//! ink, and keeps wide dark areas, which are stains.

use mocban_core::raster::blur::gaussian_blur;
use mocban_core::raster::{Grid, Mask, resample};

/// Number of cells along the longest side: the background changes slowly.
const CELLS: f64 = 96.0;
/// Usual half width of the closing, as a fraction of the longest side.
pub(super) const NARROW: f64 = 0.12;
/// Half width of the closing if the print may be stained, as a fraction of the longest side. Dark areas wider than
/// twice this are then stains.
pub(super) const STROKE: f64 = 0.05;
/// Least fraction of a cell that must be known for it to count.
const LEAST_KNOWN: f32 = 0.3;
/// Value of a cell without data: `f32::max` and `f32::min` ignore it.
const EMPTY: f32 = f32::NAN;

/// Returns the brightness of the background at each pixel, 0..=1: the grey, closed by a square and then smoothed.
/// `narrow` is half the side of the square, as a fraction of the longest side of the known area.
pub(super) fn level(grey: &Grid<f32>, known: &Mask, narrow: f64) -> Grid<f32> {
    let Some(bounds) = known.bounding_box() else {
        return grey.clone();
    };
    // The grid of cells is centred on the known area, so right-angle rotations and wider margins do not change it.
    let lengths = [bounds.width(), bounds.height()];
    let longest = lengths[0].max(lengths[1]) as f64;
    let scale = (CELLS / longest).min(1.0);
    let sides = lengths.map(|length| (length as f64 * scale).ceil() as usize);
    let middle = [bounds.x0 + bounds.x1, bounds.y0 + bounds.y1].map(|sum| sum as f64 / 2.0);
    let shift = [0, 1].map(|k| (sides[k] - 1) as f64 / 2.0 - scale * middle[k]);
    let weight = known.to_weights();
    let present = grey.zip_map(&weight, |grey, weight| grey * weight);
    let [sums, weights] = [&present, &weight].map(|of| resample(of, scale, shift, sides));
    let mean_of_known = |sum, weight| {
        if weight > LEAST_KNOWN {
            sum / weight
        } else {
            EMPTY
        }
    };
    let cells = sums.zip_map(&weights, mean_of_known);
    let reach = ((narrow * longest * scale).round() as usize).max(1);
    let closed = extreme(&extreme(&cells, reach, f32::max), reach, f32::min);
    let known_values = || closed.data().iter().filter(|value| !value.is_nan());
    let mean = known_values().sum::<f32>() / known_values().count().max(1) as f32;
    let filled = closed.map(|value| if value.is_nan() { 0.0 } else { value - mean });
    let smooth = gaussian_blur(&filled, reach as f64 / 3.0);
    let back = shift.map(|shift| -shift / scale);
    let size = [grey.width(), grey.height()];
    resample(&smooth, 1.0 / scale, back, size).map(|value| value + mean)
}

/// Returns the extreme value in a square around each cell. `pick` ignores cells without data.
pub(super) fn extreme(
    cells: &Grid<f32>,
    reach: usize,
    pick: impl Fn(f32, f32) -> f32,
) -> Grid<f32> {
    // Transposes the result, so that two calls cover both axes.
    let down_columns = |cells: &Grid<f32>| doubled(cells, reach, &pick).transposed();
    down_columns(&down_columns(cells))
}

/// Returns the extreme value within `reach` cells above and below each cell, from windows that double in height. Combines
/// whole rows.
fn doubled(cells: &Grid<f32>, reach: usize, pick: &impl Fn(f32, f32) -> f32) -> Grid<f32> {
    let (width, height, window) = (cells.width(), cells.height(), 2 * reach + 1);
    // Padded by `reach` rows, so that the window that starts at row k is centred on row k.
    let mut spans = vec![EMPTY; reach * width];
    spans.extend_from_slice(cells.data());
    spans.resize((height + 2 * reach) * width, EMPTY);
    let mut span = 1;
    while span < window {
        let step = span.min(window - span);
        for row in 0..height + 2 * reach - step {
            let (upper, lower) = spans.split_at_mut((row + step) * width);
            let upper = &mut upper[row * width..][..width];
            for (value, other) in upper.iter_mut().zip(&lower[..width]) {
                *value = pick(*value, *other);
            }
        }
        span += step;
    }
    spans.truncate(height * width);
    Grid::from_vec(width, height, spans).expect("one value for each cell")
}

#[cfg(test)]
mod tests {
    use super::{NARROW, level};
    use mocban_core::raster::{Grid, Mask};

    #[test]
    fn background_ignores_strokes_and_follows_stains() {
        let grey = Grid::from_fn(200, 200, |x, y| {
            let sheet = if x > 110 && y > 110 { 0.6 } else { 0.9 };
            if x % 40 < 12 { sheet - 0.4 } else { sheet }
        });
        let level = level(&grey, &Mask::new(200, 200, true), NARROW);
        assert!(
            (level.at(60, 50) - 0.9).abs() < 0.03,
            "{}",
            level.at(60, 50)
        );
        assert!(
            (level.at(170, 170) - 0.6).abs() < 0.05,
            "{}",
            level.at(170, 170)
        );
    }
}
