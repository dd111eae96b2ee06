//! The part of a height map that shows the carved face, without holder, turntable and walls.

use std::f64::consts::FRAC_PI_2;

use super::height_map::{HEIGHT_STEP_MM, HeightMap, NO_HEIGHT};
use mocban_core::domain::cancel::poll;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Pixels of the height map per side of a cell of the mask: 0.6 mm.
pub(super) const FACE_CELL: usize = 4;
/// Height of the layers in which heights are counted, mm.
const LAYER_MM: f64 = 1.0;
/// A scan with more layers shows no block.
const MAX_LAYERS: usize = 1 << 16;
/// Layers with more than this fraction of the heights may be the face.
const MIN_LAYER_SHARE: f64 = 0.04;
/// Heights that belong to the face, relative to the middle of its layer, mm: carved ground, bow and twist.
const BELOW_MM: f32 = 9.0;
const ABOVE_MM: f32 = 3.0;
/// Pieces of the face with at least this fraction of its area belong to it if only a crack of this width, mm, separates
/// them.
const MIN_PIECE_SHARE: f64 = 0.01;
const MAX_CRACK_MM: f64 = 6.0;
/// Cracks that may lie one behind the other.
const CRACKS: usize = 3;
/// Parts narrower than this are removed, mm: clamps, rims of a turntable.
const MIN_WIDTH_MM: f64 = 3.6;

/// The face is the highest part with at least this fraction of the area of the largest one. Clamps of a holder may be
/// higher than the face, and a turntable below it may be larger.
const MIN_PART_SHARE: f64 = 0.25;

/// Finds the face: cells of 4 x 4 pixels of the height map that belong to it. Returns `None` if there is no layer or no
/// part of it is wide enough.
pub(super) fn find_face(map: &HeightMap) -> Option<Mask> {
    let mut parts: Vec<(usize, Mask)> = Vec::new();
    for layer in layers(map) {
        let part = widest_part(map, layer);
        parts.extend(part.map(|part| (part.count(), part)));
    }
    let largest = parts.iter().map(|(area, _)| *area).max()?;
    let is_large = |area: usize| area as f64 >= MIN_PART_SHARE * largest as f64;
    let (_, face) = parts.into_iter().find(|(area, _)| is_large(*area))?;
    Some(face)
}

/// Returns the largest part of the heights around a layer, without narrow parts.
fn widest_part(map: &HeightMap, layer: f32) -> Option<Mask> {
    let (low, high) = (layer - BELOW_MM, layer + ABOVE_MM);
    let cells = cells_with(map, |height| height > low && height < high);
    let reach = (MIN_WIDTH_MM / (FACE_CELL as f64 * HEIGHT_STEP_MM) / 2.0).round() as usize;
    let parts = ConnectedComponents::label(&opened(&cells, reach));
    let mut face = parts.largest()?;
    let area = (MIN_PIECE_SHARE * face.count() as f64) as usize;
    let gap = (MAX_CRACK_MM / (FACE_CELL as f64 * HEIGHT_STEP_MM)).round() as usize;
    // Each step may reach pieces behind another crack.
    for _ in 0..CRACKS {
        face = parts.meeting(&spread(&face, gap, false), area);
    }
    Some(face)
}

/// Returns the middles of layers with enough heights, from above, at least [`BELOW_MM`] apart.
fn layers(map: &HeightMap) -> Vec<f32> {
    let heights = || map.heights.data().iter().filter(|h| **h != NO_HEIGHT);
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for height in heights() {
        low = low.min(*height);
        high = high.max(*height);
    }
    if low > high {
        return Vec::new();
    }
    let layer = |height: f32| (f64::from(height - low) / LAYER_MM) as usize;
    if layer(high) >= MAX_LAYERS {
        return Vec::new();
    }
    let mut counts = vec![0_usize; layer(high) + 1];
    for height in heights() {
        counts[layer(*height)] += 1;
    }
    let all: usize = counts.iter().sum();
    let mut found: Vec<f32> = Vec::new();
    for (at, count) in counts.iter().enumerate().rev() {
        let middle = low + ((at as f64 + 0.5) * LAYER_MM) as f32;
        let is_apart = found.last().is_none_or(|last| last - middle >= BELOW_MM);
        if *count as f64 > MIN_LAYER_SHARE * all as f64 && is_apart {
            found.push(middle);
        }
    }
    found
}

/// Returns the cells of a map that contains only a face, in which at least half of the pixels have a height.
pub(super) fn cells_of_face(map: &HeightMap) -> Mask {
    cells_with(map, |height| height != NO_HEIGHT)
}

/// Returns the cells in which at least half of the heights satisfy a condition.
fn cells_with(map: &HeightMap, condition: impl Fn(f32) -> bool) -> Mask {
    let heights = &map.heights;
    let (columns, rows) = (heights.width() / FACE_CELL, heights.height() / FACE_CELL);
    Grid::from_fn(columns, rows, |x, y| {
        let count = |dy: usize| {
            let row = &heights.row(y * FACE_CELL + dy)[x * FACE_CELL..][..FACE_CELL];
            row.iter().filter(|height| condition(**height)).count()
        };
        2 * (0..FACE_CELL).map(count).sum::<usize>() >= FACE_CELL * FACE_CELL
    })
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
            poll();
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

/// Steps of the search for the smallest rectangle, in a quarter turn.
const ANGLE_STEPS: usize = 360;

/// Returns the angle by which the smallest rectangle around the face is rotated, from u to v, in radians; within an eighth
/// of a turn. Blocks are rectangular, but a scan shows them in any rotation.
pub(super) fn face_angle(face: &Mask) -> f64 {
    let ends: Vec<[f64; 2]> = (face.row_ends())
        .map(|end| end.map(|at| at as f64))
        .collect();
    let area = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let extent = |along: [f64; 2]| {
            let values = ends.iter().map(|[x, y]| x * along[0] + y * along[1]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            high - low + 1.0
        };
        extent([cos, sin]) * extent([-sin, cos])
    };
    let angle = |step: usize| (step as f64 / ANGLE_STEPS as f64 - 0.5) * FRAC_PI_2;
    (0..ANGLE_STEPS)
        .map(|step| {
            poll();
            (angle(step), area(angle(step)))
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0.0, |(angle, _)| angle)
}

#[cfg(test)]
mod tests {
    use super::super::test_world::frame;
    use super::{FACE_CELL, face_angle, find_face};
    use crate::block::HeightMap;
    use mocban_core::raster::Grid;

    /// A face of 600 x 400 pixels, rotated by an angle, in 1,000 x 800 pixels.
    fn map(angle: f64, other: impl Fn(f64, f64) -> f32) -> HeightMap {
        let (sin, cos) = angle.sin_cos();
        let heights = Grid::from_fn(1_000, 800, |x, y| {
            let (dx, dy) = (x as f64 - 500.0, y as f64 - 400.0);
            let (u, v) = (cos * dx + sin * dy, cos * dy - sin * dx);
            if u.abs() < 300.0 && v.abs() < 200.0 {
                if x % 9 < 4 { 0.0 } else { -2.0 }
            } else {
                other(dx, dy)
            }
        });
        HeightMap {
            frame: frame(),
            origin_mm: [0.0; 2],
            heights,
        }
    }

    /// Returns the number of cells of the face.
    fn area(map: &HeightMap) -> usize {
        find_face(map).unwrap().count()
    }

    const FACE: usize = 600 * 400 / (FACE_CELL * FACE_CELL);

    #[test]
    fn a_large_turntable_below_the_face_is_left_out() {
        let turntable = |dx: f64, dy: f64| {
            if dx.hypot(dy) < 390.0 {
                -20.0
            } else {
                f32::NEG_INFINITY
            }
        };
        let found = area(&map(0.0, turntable));
        assert!(found.abs_diff(FACE) < FACE / 50, "{found} {FACE}");
    }

    #[test]
    fn clamps_above_the_face_are_left_out() {
        let clamps = |dx: f64, dy: f64| {
            if dx.abs() > 300.0 && dx.abs() < 370.0 && dy.abs() < 100.0 {
                15.0
            } else {
                f32::NEG_INFINITY
            }
        };
        let found = area(&map(0.0, clamps));
        assert!(found.abs_diff(FACE) < FACE / 50, "{found} {FACE}");
    }

    #[test]
    fn the_angle_of_the_outline_is_found() {
        for angle in [-0.6, -0.1, 0.0, 0.35] {
            let face = find_face(&map(angle, |_, _| f32::NEG_INFINITY)).unwrap();
            let found = face_angle(&face);
            assert!((found - angle).abs() < 0.01, "{found} {angle}");
        }
    }

    #[test]
    fn pieces_beyond_a_crack_belong_to_the_face() {
        let mut cracked = map(0.0, |_, _| f32::NEG_INFINITY);
        for y in 0..800 {
            for x in 280..300 {
                cracked.heights.set(x, y, -30.0);
            }
        }
        let found = area(&cracked);
        let crack = 20 * 400 / (FACE_CELL * FACE_CELL);
        assert!(found.abs_diff(FACE - crack) < FACE / 50, "{found} {FACE}");
    }

    #[test]
    fn heights_as_far_apart_as_no_block_have_no_face() {
        for far in [1e6, 1e30, f32::MAX] {
            assert!(find_face(&map(0.0, |_, _| far)).is_none());
        }
    }

    #[test]
    fn a_map_without_heights_has_no_face() {
        let empty = HeightMap {
            heights: Grid::new(50, 50, f32::NEG_INFINITY),
            ..map(0.0, |_, _| 0.0)
        };
        assert!(find_face(&empty).is_none());
    }
}
