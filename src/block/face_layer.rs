//! The part of a height map that shows the carved face, without holder, turntable and walls.

use super::height_map::{HEIGHT_STEP_MM, HeightMap, NO_HEIGHT};
use crate::raster::components::ConnectedComponents;
use crate::raster::{Grid, Mask};

/// Cells of the mask per side in pixels of the height map: 0.6 mm.
const CELL: usize = 4;
/// Height of the layers in which heights are counted, mm.
const LAYER_MM: f64 = 1.0;
/// The face contains the highest layer with more than this share of the heights.
const MIN_LAYER_SHARE: f64 = 0.04;
/// Heights that belong to the face, relative to the middle of its layer, mm: carved ground, bow and twist.
const BELOW_MM: f32 = 9.0;
const ABOVE_MM: f32 = 3.0;
/// Parts narrower than this are removed, mm: clamps, rims of a turntable.
const MIN_WIDTH_MM: f64 = 3.6;

/// Finds the face: cells of 4 x 4 pixels of the height map that belong to it. Returns `None` if there is no layer or no
/// part of it is wide enough.
pub(super) fn find_face(map: &HeightMap) -> Option<Mask> {
    let layer = highest_layer(map)?;
    let (low, high) = (layer - BELOW_MM, layer + ABOVE_MM);
    let heights = &map.heights;
    let (columns, rows) = (heights.width() / CELL, heights.height() / CELL);
    let in_layer = |x: usize, y: usize| {
        let inside = |at: &&f32| **at > low && **at < high;
        let count = |dy: usize| {
            let row = &heights.row(y * CELL + dy)[x * CELL..][..CELL];
            row.iter().filter(inside).count()
        };
        2 * (0..CELL).map(count).sum::<usize>() >= CELL * CELL
    };
    let cells = Grid::from_fn(columns, rows, in_layer);
    let reach = (MIN_WIDTH_MM / (CELL as f64 * HEIGHT_STEP_MM) / 2.0).round() as usize;
    let opened = opened(&cells, reach);
    let mask = Mask::from_fn(columns, rows, |x, y| opened.at(x, y));
    let parts = ConnectedComponents::label(&mask);
    parts.largest()
}

/// Returns the middle of the highest layer with enough heights.
fn highest_layer(map: &HeightMap) -> Option<f32> {
    let heights = || map.heights.data().iter().filter(|h| **h != NO_HEIGHT);
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for height in heights() {
        low = low.min(*height);
        high = high.max(*height);
    }
    if low > high {
        return None;
    }
    let layer = |height: f32| (f64::from(height - low) / LAYER_MM) as usize;
    let mut counts = vec![0_usize; layer(high) + 1];
    for height in heights() {
        counts[layer(*height)] += 1;
    }
    let all: usize = counts.iter().sum();
    let enough = |count: &usize| *count as f64 > MIN_LAYER_SHARE * all as f64;
    let best = counts.iter().rposition(enough)?;
    Some(low + ((best as f64 + 0.5) * LAYER_MM) as f32)
}

/// Erodes and dilates cells by `reach` in all directions.
fn opened(cells: &Grid<bool>, reach: usize) -> Grid<bool> {
    let eroded = spread(&cells.map(|set| !set), reach, true).map(|set| !set);
    spread(&eroded, reach, false)
}

/// Returns the cells within `reach` columns and rows of a set cell. `outside` is the value beyond the border.
fn spread(cells: &Grid<bool>, reach: usize, outside: bool) -> Grid<bool> {
    let along_rows = |cells: &Grid<bool>| {
        let mut result = Grid::new(cells.width(), cells.height(), false);
        for y in 0..cells.height() {
            let row = cells.row(y);
            // Distance to the last set cell on the left, then on the right.
            let start = if outside { 0 } else { reach };
            let mut since = start;
            for x in 0..row.len() {
                since = if row[x] { 0 } else { since + 1 };
                result.set(x, y, since <= reach);
            }
            since = start;
            for x in (0..row.len()).rev() {
                since = if row[x] { 0 } else { since + 1 };
                if since <= reach {
                    result.set(x, y, true);
                }
            }
        }
        result
    };
    along_rows(&along_rows(cells).transposed()).transposed()
}
