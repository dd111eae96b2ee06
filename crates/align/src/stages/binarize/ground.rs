//! Finds the dark ground beside a torn sheet, which is neither ink nor sheet.

use super::background::extreme;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::otsu;
use mocban_core::raster::{Grid, Mask, resample};

/// Longest side of the grid of cells on which the ground is sought.
const CELLS: f64 = 72.0;
/// Half the least width of the ground, as a fraction of the longest side. Strokes and rules are narrower.
const HALF_WIDTH: f64 = 0.065;
/// Least fraction of the print that the ground covers, and least fraction that it leaves.
const LEAST_GROUND: f64 = 0.1;
const LEAST_LEFT: f64 = 0.2;
/// Least fraction of what the ground leaves that is light: the sheet.
const LEAST_SHEET: f64 = 0.5;
/// Half the least width of a light area without strokes, as a fraction of the longest side, and the least fraction of the
/// rest of the print that such areas cover. A rubbing has light strokes and no such area.
const SHEET_HALF_WIDTH: f64 = 0.05;
const LEAST_OPEN_SHEET: f64 = 0.08;
/// Distance from the ground, in cells, at which pixels are a mixture of ground and sheet.
const MIXED_CELLS: usize = 1;

/// Returns the pixels of the dark ground, or `None` if the print shows none: a wide dark area at the border, beside an
/// area that is mostly light.
pub(super) fn dark_ground(grey: &Grid<f32>, known: &Mask) -> Option<Mask> {
    let (width, height) = (grey.width(), grey.height());
    let scale = (CELLS / width.max(height) as f64).min(1.0);
    let sides = [width, height].map(|side| ((side as f64 * scale).ceil() as usize).max(2));
    let shift = [width, height].map(|side| -scale * (side - 1) as f64 / 2.0);
    let shift = [0, 1].map(|k| shift[k] + (sides[k] - 1) as f64 / 2.0);
    let weight = known.to_weights();
    let present = grey.zip_map(&weight, |grey, weight| grey * weight);
    let [sums, weights] = [&present, &weight].map(|of| resample(of, scale, shift, sides));
    let cells = sums.zip_map(
        &weights,
        |sum, weight| {
            if weight > 0.5 { sum / weight } else { f32::NAN }
        },
    );
    let mut values: Vec<f32> = cells
        .data()
        .iter()
        .copied()
        .filter(|v| !v.is_nan())
        .collect();
    let all = values.len() as f64;
    let threshold = otsu::split(&mut values)?.threshold as f32;
    let reach = |share: f64| ((share * sides[0].max(sides[1]) as f64).round() as usize).max(1);
    let opened = |is_set: &dyn Fn(f32) -> bool, reach: usize| {
        // Cells without data and beyond the print are not set: a stroke that is cut at the border is no ground.
        let padded = Grid::from_fn(sides[0] + 2 * reach, sides[1] + 2 * reach, |x, y| {
            let cell = cells.get(x as i64 - reach as i64, y as i64 - reach as i64);
            f32::from(u8::from(cell.is_some_and(is_set)))
        });
        let opened = extreme(&extreme(&padded, reach, f32::min), reach, f32::max);
        Mask::from_fn(sides[0], sides[1], |x, y| {
            opened.at(x + reach, y + reach) > 0.5
        })
    };
    let dark = opened(&|value| value < threshold, reach(HALF_WIDTH));
    // With a frame of one cell, which is beyond the print.
    let is_inside = |x, y| (1..=sides[0]).contains(&x) && (1..=sides[1]).contains(&y);
    let beyond = Mask::from_fn(sides[0] + 2, sides[1] + 2, |x, y| {
        !is_inside(x, y) || cells.at(x - 1, y - 1).is_nan()
    });
    let framed = Mask::from_fn(sides[0] + 2, sides[1] + 2, |x, y| {
        is_inside(x, y) && dark.at(x - 1, y - 1)
    });
    let ground = ConnectedComponents::label(&framed).touching(&beyond, 1);
    let ground = Mask::from_fn(sides[0], sides[1], |x, y| ground.at(x + 1, y + 1));
    let ground_share = ground.count() as f64 / all;
    if !(LEAST_GROUND..=1.0 - LEAST_LEFT).contains(&ground_share) {
        return None;
    }
    let light = cells.map(|value| *value >= threshold);
    let left = all * (1.0 - ground_share);
    let open = opened(&|value| value >= threshold, reach(SHEET_HALF_WIDTH));
    if (light.count() as f64) < LEAST_SHEET * left
        || (open.count() as f64) < LEAST_OPEN_SHEET * left
    {
        return None;
    }
    let near = extreme(&ground.to_weights(), MIXED_CELLS, f32::max);
    Some(Mask::from_fn(width, height, |x, y| {
        let cell = |at: usize, k: usize| {
            let place = scale * at as f64 + shift[k];
            (place.round().max(0.0) as usize).min(sides[k] - 1)
        };
        near.at(cell(x, 0), cell(y, 1)) > 0.5
    }))
}

#[cfg(test)]
mod tests {
    use super::dark_ground;
    use crate::stages::binarize::test_strokes::{SIDE, is_stroke};
    use mocban_core::raster::{Grid, Mask};

    fn ground(grey: impl Fn(usize, usize) -> f32) -> Option<Mask> {
        dark_ground(
            &Grid::from_fn(SIDE, SIDE, grey),
            &Mask::new(SIDE, SIDE, true),
        )
    }

    #[test]
    fn a_dark_area_beyond_a_torn_edge_is_ground() {
        let is_torn = |x: usize, y: usize| x + 2 * y > 260;
        let found = ground(|x, y| {
            if is_torn(x, y) {
                0.12
            } else if is_stroke(x, y) {
                0.15
            } else {
                0.8
            }
        });
        let found = found.expect("the ground");
        let torn = Mask::from_fn(SIDE, SIDE, is_torn);
        let wrong = found.zip_map(&torn, |found, torn| found != torn).count();
        assert!(20 * wrong < SIDE * SIDE, "{wrong}");
    }

    #[test]
    fn strokes_frames_and_rubbings_are_no_ground() {
        let print = |x, y| if is_stroke(x, y) || x < 8 { 0.15 } else { 0.8 };
        assert!(ground(print).is_none());
        assert!(ground(|x, y| 0.95 - print(x, y)).is_none());
        let cut = |x, y| {
            if is_stroke(x, y) || x >= 136 {
                0.15
            } else {
                0.8
            }
        };
        assert!(ground(cut).is_none());
    }
}
