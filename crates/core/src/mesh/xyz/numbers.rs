//! Columns before the coordinates of points without a title: the numbers of points and scans, or a row and a column of each
//! point.

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

/// Refuses points that may have a row and a column, and perhaps the number of a scan or point, before their coordinates: the
/// first columns are whole, and the three after them are not and have no normal.
///
/// # Errors
/// Returns an error that names the first point.
pub(super) fn check_grid(
    bytes: &[u8],
    layout: &PointLayout,
    points: &[[f64; 3]],
) -> Result<(), MeshError> {
    if layout.behind(2).is_none()
        || points.len() < NUMBERED_POINTS
        || !is_whole(points, 0)
        || !is_whole(points, 1)
    {
        return Ok(());
    }
    let has_three = is_whole(points, 2);
    if has_three && !(counts(points, 1) || counts(points, 2)) {
        return Ok(());
    }
    let Some(gridded) = layout.behind(if has_three { 3 } else { 2 }) else {
        return Ok(());
    };
    let found = first_positions(bytes, &gridded);
    if found.len() < NUMBERED_POINTS || (0..3).any(|axis| is_whole(&found, axis)) {
        return Ok(());
    }
    let is_colour = |position: &[f64; 3]| position.iter().all(|value| (0.0..=1.0).contains(value));
    if has_normals(bytes, layout) || (has_three && found.iter().all(is_colour)) {
        return Ok(());
    }
    let is_numbered = layout.columns()[0] > 0;
    let reason = if has_three || is_numbered {
        "its first three numbers may be those of a scan or point, a row and a column; name the columns in a line before the \
         points, such as `scan row col x y z`"
    } else {
        "its first two numbers may be a row and a column, or x and y; name the columns in a line before the points, such as \
         `row col x y z`"
    };
    Err(MeshError::Line {
        line: layout.first_point,
        reason: reason.into(),
    })
}

/// Returns whether a coordinate mostly changes by one from point to point, as the row or the column does.
fn counts(points: &[[f64; 3]], axis: usize) -> bool {
    let pairs = polled(points.windows(2));
    let steps = pairs.filter(|pair| (pair[1][axis] - pair[0][axis]).abs() == 1.0);
    2 * steps.count() >= points.len()
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
