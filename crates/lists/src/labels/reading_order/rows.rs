//! Rows of a column, with notes two by two.

use super::box_extent::BoxExtent;
use mocban_core::domain::NotePart;

/// Distance from the middle between notes beyond which a small box is on one side, in the usual size.
const BESIDE: f64 = 0.17;
/// Largest difference of height of two notes in a row, in the smaller of their heights.
const SAME_ROW: f64 = 0.5;
/// Smallest distance of two notes in a row, in their mean size.
const APART: f64 = 0.5;
/// Number of following boxes that are compared with a note.
const MAX_LOOKED_AT: usize = 8;

/// Boxes of a row: one, or two notes.
struct BoxRow {
    first: usize,
    other: Option<usize>,
    /// Middle between the two notes, or of the nearest row with two in the same run of small boxes.
    middle: Option<f64>,
}

/// Returns index, row from 1 and part of each box of a column.
pub(super) fn rows(
    extents: &[BoxExtent],
    column: Vec<usize>,
    full_size: f64,
) -> Vec<(usize, u32, Option<NotePart>)> {
    let mut order = column;
    order.sort_by(|a, b| {
        let (a_extent, b_extent) = (&extents[*a], &extents[*b]);
        let by_height = a_extent.v.total_cmp(&b_extent.v);
        by_height
            .then(b_extent.u.total_cmp(&a_extent.u))
            .then(a.cmp(b))
    });
    let mut rows = paired(extents, &order, full_size);
    let is_small = |row: &BoxRow| extents[row.first].is_small(full_size);
    for k in 1..rows.len() {
        if rows[k].middle.is_none() && is_small(&rows[k]) {
            rows[k].middle = rows[k - 1].middle;
        }
    }
    for k in (1..rows.len()).rev() {
        if rows[k - 1].middle.is_none() && is_small(&rows[k - 1]) {
            rows[k - 1].middle = rows[k].middle;
        }
    }
    let mut named = Vec::with_capacity(order.len());
    for (k, row) in rows.iter().enumerate() {
        let number = k as u32 + 1;
        if let Some(other) = row.other {
            let is_right = extents[row.first].u > extents[other].u;
            named.push((row.first, number, Some(part(is_right))));
            named.push((other, number, Some(part(!is_right))));
        } else {
            let beside = row
                .middle
                .map_or(0.0, |middle| extents[row.first].u - middle);
            let has_part = beside.abs() > BESIDE * full_size;
            named.push((row.first, number, has_part.then_some(part(beside > 0.0))));
        }
    }
    named
}

const fn part(is_right: bool) -> NotePart {
    if is_right {
        NotePart::Right
    } else {
        NotePart::Left
    }
}

/// Returns the rows of boxes in the order of their heights.
fn paired(extents: &[BoxExtent], order: &[usize], full_size: f64) -> Vec<BoxRow> {
    let mut used = vec![false; order.len()];
    let mut rows: Vec<BoxRow> = Vec::with_capacity(order.len());
    for (at, first) in order.iter().copied().enumerate() {
        if used[at] {
            continue;
        }
        let end = order.len().min(at + 1 + MAX_LOOKED_AT);
        let is_other = |next: &usize| {
            !used[*next] && are_side_by_side(&extents[first], &extents[order[*next]], full_size)
        };
        let next = (at + 1..end).find(is_other);
        if let Some(next) = next {
            used[next] = true;
        }
        let other = next.map(|next| order[next]);
        rows.push(BoxRow {
            first,
            other,
            middle: other.map(|other| f64::midpoint(extents[first].u, extents[other].u)),
        });
    }
    rows
}

/// Returns whether two boxes of a column are notes in a row.
fn are_side_by_side(upper: &BoxExtent, lower: &BoxExtent, full_size: f64) -> bool {
    let height = upper.height.min(lower.height);
    let size = f64::midpoint(upper.size, lower.size);
    let apart = (upper.u - lower.u).abs();
    upper.is_small(full_size)
        && lower.is_small(full_size)
        && lower.v - upper.v <= SAME_ROW * height
        && apart > 0.0
        && apart >= APART * size
}
