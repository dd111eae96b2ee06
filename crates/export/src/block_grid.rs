//! Points of the scan of a block every 5 mm, with their pixels of the page.

use schemars::JsonSchema;
use serde::Serialize;

use super::block_view::{BlockViewError, RegisteredFace};
use mocban_align::block::{CarvedFace, Support};
use mocban_core::domain::LengthUnit;
use mocban_store::Project;

/// Spacing of the places at which a cell of the grid is searched for scanned surface, mm.
const PROBE_MM: f64 = 1.0;
/// Cells with a smaller share of agreeing places around them are left out. Characters there have a confidence of 0.
const MIN_SUPPORT: f64 = 0.4;
/// Decimals of pixels.
const PIXEL_DECIMALS: i32 = 3;

/// Points of a scan and their pixels of the page, in the same order.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct BlockGrid {
    /// Points at the height of the tops of the strokes, in the frame and unit of the scan.
    mesh: Vec<[f64; 3]>,
    /// Pixels of the page.
    page: Vec<[f64; 2]>,
}

/// A cell of the grid: the places of its corners on the face, mm.
#[derive(Clone, Copy)]
struct GridCell {
    low: [f64; 2],
    high: [f64; 2],
}

impl GridCell {
    /// Returns whether the page agrees around the cell, and something was scanned in it.
    fn is_registered(self, face: &CarvedFace, support: &Support) -> bool {
        let middle = [0, 1].map(|k: usize| f64::midpoint(self.low[k], self.high[k]));
        if support.at(middle) < MIN_SUPPORT {
            return false;
        }
        let count = [0, 1].map(|k: usize| ((self.high[k] - self.low[k]) / PROBE_MM) as usize);
        let mut probes = (0..=count[1]).flat_map(|y| (0..=count[0]).map(move |x| [x, y]));
        probes.any(|at| {
            let place = [0, 1].map(|k: usize| self.low[k] + at[k] as f64 * PROBE_MM);
            face.height_at(place).is_some()
        })
    }
}

/// Returns the nodes of the map of a face to its page: the corners of all cells of 5 mm in which the face was scanned and
/// agrees with the page.
pub(super) fn face_grid(
    registered: &RegisteredFace,
    project: &Project,
) -> Result<BlockGrid, BlockViewError> {
    let (face, map) = (registered.read_face(project)?, registered.map()?);
    let (columns, pixels) = registered.nodes();
    let places = map.node_positions();
    let is_used = used_nodes(&places, columns, |cell| {
        cell.is_registered(&face, &registered.support)
    });
    let decimals = mesh_decimals(registered.unit);
    let mut grid = BlockGrid {
        mesh: Vec::new(),
        page: Vec::new(),
    };
    let nodes = places.iter().zip(pixels).zip(is_used);
    for ((place, pixel), _) in nodes.filter(|(_, is_used)| *is_used) {
        let point = face.top_point(*place);
        grid.mesh.push(point.map(|value| rounded(value, decimals)));
        grid.page
            .push(pixel.map(|value| rounded(value, PIXEL_DECIMALS)));
    }
    Ok(grid)
}

/// Returns for each node whether it is a corner of a cell that is used.
fn used_nodes(
    places: &[[f64; 2]],
    columns: usize,
    is_used: impl Fn(GridCell) -> bool,
) -> Vec<bool> {
    let mut used = vec![false; places.len()];
    let rows = places.len().checked_div(columns).unwrap_or(0);
    for y in 1..rows {
        for x in 1..columns {
            let [first, last] = [(y - 1) * columns + x - 1, y * columns + x];
            let cell = GridCell {
                low: places[first],
                high: places[last],
            };
            if is_used(cell) {
                for corner in [first, first + 1, last - 1, last] {
                    used[corner] = true;
                }
            }
        }
    }
    used
}

/// Returns the decimals of coordinates of the scan: a micrometre or less.
const fn mesh_decimals(unit: LengthUnit) -> i32 {
    match unit {
        LengthUnit::Mm => 3,
        LengthUnit::Cm => 4,
        LengthUnit::In => 5,
        LengthUnit::M => 6,
    }
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    // Without a negative zero.
    (value * scale).round() / scale + 0.0
}

#[cfg(test)]
mod tests {
    use super::{rounded, used_nodes};

    #[test]
    fn corners_of_used_cells_are_used() {
        // Four columns and three rows, 5 mm apart; only the cell between x 5 and 10, y 5 and 10 is used.
        let places: Vec<[f64; 2]> = (0..12_i32)
            .map(|k| [f64::from(k % 4) * 5.0, f64::from(k / 4) * 5.0])
            .collect();
        let used = used_nodes(&places, 4, |cell| {
            assert_eq!(cell.high, cell.low.map(|low| low + 5.0));
            cell.low == [5.0, 5.0]
        });
        let numbers = (0..12).filter(|k| used[*k]).collect::<Vec<_>>();
        assert_eq!(numbers, [5, 6, 9, 10]);
        assert!(used_nodes(&[], 0, |_| true).is_empty());
    }

    #[test]
    fn numbers_are_rounded_and_zero_has_no_sign() {
        assert_eq!(rounded(1.23456, 3), 1.235);
        assert!(rounded(-0.0001, 3).is_sign_positive());
    }
}
