//! Names of boxes by their place: columns from the right, rows from the top.

mod box_extent;
mod columns;
mod rows;
mod straighten;
#[cfg(test)]
mod tests;

use self::box_extent::{BoxExtent, full_size};
use self::columns::columns;
use self::rows::rows;
use self::straighten::straighten;
use mocban_core::domain::BoxName;

/// Returns the names of boxes, in the order of the boxes. All names differ. Takes left, top, right and bottom of each
/// box in any unit, y down; the result does not depend on the unit, and hardly on the order of the boxes.
///
/// - **Rotation and bends.** The page is turned back first by at most 6 degrees, and its columns are straightened if they
///   lean differently to both sides or are bent, by at most one character at top and bottom: as far as the centres
///   of the boxes form the sharpest columns. Fewer than six boxes are not turned, fewer than 40 not straightened. Only
///   boxes of full size are looked at if they are at least 40 and at least 30 % of all.
/// - **Columns.** Boxes of full size whose centres follow one another sideways by less than 0.4 of the usual size are
///   one column. Columns are counted from the right, so a column without boxes has no number.
/// - **Rows.** Boxes are counted within each column, from the top. Columns need not begin or end at the same height, and
///   equal numbers in two columns need not be at the same height: after a missing character, the rows of its column
///   are one less.
/// - **Notes.** A box with less than 0.7 of the usual size is small. A small box belongs to the nearest column, or to a
///   column between columns if these leave room for it. Two small boxes of a column are one row if their heights differ
///   by at most half of the smaller one's height and they are at least half of their size apart: the right one is part
///   a, the left one part b. Another small box of the same run of small boxes has the letter of its side if it is
///   beside the middle of the nearest such pair, and no letter otherwise.
/// - **Usual size.** The larger of width and height, as the median of the boxes that have at least 0.6 of a large size:
///   that of the largest box after 4 % of the boxes, at least one, which may be frames or titles. If fewer boxes are
///   characters of full size, but stand in at least three columns, their median is taken; if not, notes count as full
///   size and as columns of their own.
///
/// Coordinates that are not finite count as 0.
///
/// ```
/// use mocban_lists::labels::reading_order;
///
/// let boxes = [[0.0, 0.0, 9.0, 9.0], [12.0, 0.0, 21.0, 9.0], [12.0, 11.0, 21.0, 20.0]];
/// let names: Vec<String> = reading_order(&boxes).iter().map(ToString::to_string).collect();
/// assert_eq!(names, ["c02-r01", "c01-r01", "c01-r02"]);
/// ```
pub fn reading_order(bounds: &[[f64; 4]]) -> Vec<BoxName> {
    let mut extents: Vec<BoxExtent> = bounds.iter().map(|bounds| BoxExtent::of(*bounds)).collect();
    let size = full_size(&extents);
    straighten(&mut extents, size);
    let unnamed = BoxName {
        column: 0,
        row: 0,
        part: None,
    };
    let mut names = vec![unnamed; extents.len()];
    for (k, column) in columns(&extents, size).into_iter().enumerate() {
        for (index, row, part) in rows(&extents, column.boxes, size) {
            names[index] = BoxName {
                column: k as u32 + 1,
                row,
                part,
            };
        }
    }
    names
}
