//! The ground on which a picture can be judged: what it knows, without what runs into its border.
//!
//! Walls, frame lines and neighbours do, and go on beyond it. Which of them happens to lie on which tells nothing of the
//! character, yet would decide where a symmetric one reads as well turned or in the mirror.

use super::Layer;
use crate::raster::{Grid, Mask};
use crate::stages::components::Components;

/// Amounts above this are strokes.
const STROKE: f32 = 0.3;
/// Strokes that come so near to what is unknown may go on beyond it, pixels.
const BORDER_PX: i64 = 2;
/// Their soft rim goes with them, pixels.
const RIM_PX: usize = 3;
/// Where more than this share of the strokes runs into the border, the character does or hangs on what does; then
/// this share of the size along the border is left out instead.
const MOST_STRAYS: f64 = 0.5;
const BAND: f64 = 0.1;

/// 1 where a layer is known and free of what runs into its border, 0 elsewhere.
pub(super) fn own_ground(layer: &Layer) -> Grid<f32> {
    let strokes = layer.amount.map(|amount| *amount > STROKE);
    let unknown = layer.weight.map(|weight| *weight == 0.0);
    let strays = Components::of(&strokes).near(&unknown, BORDER_PX);
    if strays.count() as f64 > MOST_STRAYS * strokes.count() as f64 {
        without_band(&layer.weight)
    } else {
        without_strays(&layer.weight, &strays)
    }
}

fn without_strays(weight: &Grid<f32>, strays: &Mask) -> Grid<f32> {
    let mut ground = weight.clone();
    let (width, height) = (weight.width(), weight.height());
    let around = |at: usize, size: usize| at.saturating_sub(RIM_PX)..(at + RIM_PX + 1).min(size);
    for y in 0..height {
        for x in (0..width).filter(|x| strays.at(*x, y)) {
            for row in around(y, height) {
                let columns = around(x, width);
                ground.data_mut()[row * width..][columns].fill(0.0);
            }
        }
    }
    ground
}

fn without_band(weight: &Grid<f32>) -> Grid<f32> {
    let reach = (BAND * weight.width().max(weight.height()) as f64).round() as i64;
    let around = [(reach, 0), (-reach, 0), (0, reach), (0, -reach)];
    Grid::from_fn(weight.width(), weight.height(), |x, y| {
        let (i, j) = (x as i64, y as i64);
        let is_known = |(dx, dy): &(i64, i64)| weight.get(i + dx, j + dy).is_some_and(|w| w > 0.0);
        if around.iter().all(is_known) {
            weight.at(x, y)
        } else {
            0.0
        }
    })
}
