//! Rows of a column, with notes two by two.

use super::box_name::NotePart;
use super::columns::BoxColumn;
use super::spot::Spot;

/// Distance from the middle of the column beyond which a small box is on one side, in the usual size.
const BESIDE: f64 = 0.1;
/// Largest difference of height of two notes in a row, in the smaller of their heights.
const SAME_ROW: f64 = 0.5;
/// Number of following boxes that are compared with a note.
const MAX_LOOKED_AT: usize = 8;

/// Boxes of a row: one, or a right and a left note.
struct BoxRow {
    first: usize,
    other: Option<usize>,
}

/// Returns index, row from 1 and part of each box of a column.
pub(super) fn rows(
    spots: &[Spot],
    column: BoxColumn,
    full_size: f64,
) -> Vec<(usize, u32, Option<NotePart>)> {
    let side = |k: usize| side(&spots[k], column.middle, full_size);
    let mut order = column.boxes;
    order.sort_by(|a, b| {
        let (a_spot, b_spot) = (&spots[*a], &spots[*b]);
        let by_height = a_spot.v.total_cmp(&b_spot.v);
        by_height.then(b_spot.u.total_cmp(&a_spot.u)).then(a.cmp(b))
    });
    let mut used = vec![false; order.len()];
    let mut rows: Vec<BoxRow> = Vec::with_capacity(order.len());
    for at in 0..order.len() {
        if used[at] {
            continue;
        }
        let first = order[at];
        let is_partner = |next: &usize| {
            let other = order[*next];
            let smaller = spots[first].height.min(spots[other].height);
            let other_side = side(first).is_some_and(|part| side(other).is_some_and(|o| o != part));
            !used[*next] && other_side && spots[other].v - spots[first].v <= SAME_ROW * smaller
        };
        let end = order.len().min(at + 1 + MAX_LOOKED_AT);
        let other = (at + 1..end).find(is_partner);
        if let Some(other) = other {
            used[other] = true;
        }
        rows.push(BoxRow {
            first,
            other: other.map(|k| order[k]),
        });
    }
    let is_pair = |k: usize| rows.get(k).is_some_and(|row| row.other.is_some());
    let mut named = Vec::with_capacity(order.len());
    for (k, row) in rows.iter().enumerate() {
        let has_letter = is_pair(k) || is_pair(k + 1) || (k > 0 && is_pair(k - 1));
        for index in std::iter::once(row.first).chain(row.other) {
            named.push((index, k as u32 + 1, side(index).filter(|_| has_letter)));
        }
    }
    named
}

/// Returns the side of the middle on which a small box is.
fn side(spot: &Spot, middle: f64, full_size: f64) -> Option<NotePart> {
    let beside = spot.u - middle;
    if !spot.is_small(full_size) || beside.abs() <= BESIDE * full_size {
        None
    } else if beside > 0.0 {
        Some(NotePart::Right)
    } else {
        Some(NotePart::Left)
    }
}
