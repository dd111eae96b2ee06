//! Columns before the coordinates of points without a title: the numbers of points, or a row and a column of each.

use super::layout::PointLayout;
use crate::domain::cancel::polled;
use crate::mesh::MeshError;

/// Fewest points that show that a column holds their numbers.
pub(super) const NUMBERED_POINTS: usize = 10;
/// Lines whose further columns are compared.
const COMPARED_LINES: usize = 1000;

/// Returns whether the first column, read as x, has the numbers of points: whole numbers that no two points share, and which
/// increase, or are as dense as numbers in another order, or stand before coordinates with fractions. No scan has such an x.
pub(super) fn are_numbers(points: &[[f64; 3]]) -> bool {
    if points.len() < NUMBERED_POINTS || !is_whole(points, 0) {
        return false;
    }
    if polled(points.windows(2)).all(|pair| pair[0][0] < pair[1][0]) {
        return true;
    }
    let mut numbers: Vec<f64> = polled(points).map(|point| point[0]).collect();
    numbers.sort_unstable_by(f64::total_cmp);
    let are_distinct = polled(numbers.windows(2)).all(|pair| pair[0] < pair[1]);
    let range = numbers[numbers.len() - 1] - numbers[0];
    let is_dense = range < 2.0 * numbers.len() as f64;
    are_distinct && (is_dense || [1, 2].into_iter().all(|axis| !is_whole(points, axis)))
}

/// Returns whether all coordinates along an axis are whole.
pub(super) fn is_whole(points: &[[f64; 3]], axis: usize) -> bool {
    polled(points).all(|point| point[axis].fract() == 0.0)
}

/// Refuses points that may have a row and a column before their coordinates: the first two columns are whole, and the three
/// after them are not and have no normal.
///
/// # Errors
/// Returns an error that names the first point.
pub(super) fn check_grid(
    bytes: &[u8],
    layout: &PointLayout,
    points: &[[f64; 3]],
) -> Result<(), MeshError> {
    let Some(gridded) = layout.gridded() else {
        return Ok(());
    };
    if points.len() < NUMBERED_POINTS || !is_whole(points, 0) || !is_whole(points, 1) {
        return Ok(());
    }
    let found = first_positions(bytes, &gridded);
    if found.len() < NUMBERED_POINTS || (0..3).any(|axis| is_whole(&found, axis)) {
        return Ok(());
    }
    if has_normals(bytes, layout) {
        return Ok(());
    }
    let reason = "its first two numbers may be a row and a column, or x and y; name the columns in a line before the points, such \
                  as `row col x y z`";
    Err(MeshError::Line {
        line: layout.first_point,
        reason: reason.into(),
    })
}

/// Returns whether normals follow the positions.
pub(super) fn has_normals(bytes: &[u8], layout: &PointLayout) -> bool {
    let is_unit = |[x, y, z]: &[f64; 3]| (x * x + y * y + z * z - 1.0).abs() < 0.02;
    let normals = layout.of_normals();
    let normals = normals.map(|layout| first_positions(bytes, &layout));
    normals.is_some_and(|normals| !normals.is_empty() && normals.iter().all(is_unit))
}

fn first_positions(bytes: &[u8], layout: &PointLayout) -> Vec<[f64; 3]> {
    let rows = layout.rows(bytes).take(COMPARED_LINES);
    rows.filter_map(|(_, row)| layout.position(row).ok())
        .collect()
}
