//! Columns of boxes on a page that is turned upright.

use super::box_extent::BoxExtent;

/// Gap between centres that separates two columns, in the usual size.
const COLUMN_GAP: f64 = 0.4;
/// Pitch of columns if there is only one, in the usual size.
const USUAL_PITCH: f64 = 1.3;
/// Smallest pitch of columns, in the usual size.
const MIN_PITCH: f64 = 0.9;
/// Largest misfit of notes to a part of the distance of columns, in their misfit to the distance.
const BETTER_FIT: f64 = 0.6;
/// Distance from a column within which small boxes belong to it, in the pitch.
const REACH: f64 = 0.5;

/// A column of boxes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BoxColumn {
    /// Middle of the column, to the right.
    pub(super) middle: f64,
    /// Indices of its boxes.
    pub(super) boxes: Vec<usize>,
}

/// Returns the columns from right to left. Each box is in one column.
pub(super) fn columns(extents: &[BoxExtent], full_size: f64) -> Vec<BoxColumn> {
    let all = 0..extents.len();
    let (small, full): (Vec<usize>, Vec<usize>) =
        all.partition(|k| extents[*k].is_small(full_size));
    let mut columns: Vec<BoxColumn> = groups(full, COLUMN_GAP * full_size, |k| extents[k].u)
        .into_iter()
        .map(|boxes| BoxColumn {
            middle: median(boxes.iter().map(|k| extents[*k].u).collect()),
            boxes,
        })
        .collect();
    let notes: Vec<f64> = small.iter().map(|k| extents[*k].u).collect();
    let pitch = pitch(&columns, &notes, full_size).unwrap_or(USUAL_PITCH * full_size);
    let mut between: Vec<(usize, f64)> = Vec::new();
    for k in small {
        let u = extents[k].u;
        match nearest(&columns, u) {
            Some(column) if (columns[column].middle - u).abs() <= REACH * pitch => {
                columns[column].boxes.push(k);
            }
            // The column of notes alone is a whole number of pitches away.
            Some(column) => {
                let middle = columns[column].middle;
                between.push((k, middle + ((u - middle) / pitch).round() * pitch));
            }
            // No box is full if all sizes are zero.
            None => between.push((k, u)),
        }
    }
    let place = |k: usize| between[k].1;
    for group in groups((0..between.len()).collect(), REACH * pitch, place) {
        columns.push(BoxColumn {
            middle: median(group.iter().map(|k| place(*k)).collect()),
            boxes: group.iter().map(|k| between[*k].0).collect(),
        });
    }
    columns.sort_by(|a, b| b.middle.total_cmp(&a.middle).then(a.boxes.cmp(&b.boxes)));
    columns
}

/// Returns the index of the column whose middle is nearest. Takes columns from left to right.
fn nearest(columns: &[BoxColumn], u: f64) -> Option<usize> {
    let right = columns.partition_point(|column| column.middle < u);
    let near = right.saturating_sub(1)..columns.len().min(right + 1);
    let distance = |k: usize| (columns[k].middle - u).abs();
    near.min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
}

/// Groups items whose places follow one another by at most `gap`.
fn groups(mut items: Vec<usize>, gap: f64, place: impl Fn(usize) -> f64) -> Vec<Vec<usize>> {
    items.sort_by(|a, b| place(*a).total_cmp(&place(*b)).then(a.cmp(b)));
    let together = |a: &usize, b: &usize| place(*b) - place(*a) <= gap;
    items.chunk_by(together).map(<[usize]>::to_vec).collect()
}

/// Returns the pitch of the page from columns of full boxes, which are sorted from the left: their median distance, or a
/// half or third of it if columns of notes are between them. Notes are a quarter of the pitch beside the middle of their
/// column.
fn pitch(columns: &[BoxColumn], notes: &[f64], full_size: f64) -> Option<f64> {
    let distances = columns
        .windows(2)
        .map(|pair| pair[1].middle - pair[0].middle);
    let distances: Vec<f64> = distances.collect();
    if distances.is_empty() {
        return None;
    }
    let longest = median(distances);
    // Mean distance of the notes from their places, in the pitch.
    let misfit = |pitch: &f64| {
        let one = |u: &f64| {
            let beside = nearest(columns, *u).map_or(0.0, |k| (u - columns[k].middle) / pitch);
            ((beside - beside.round()).abs() - 0.25).abs()
        };
        notes.iter().map(one).sum::<f64>() / notes.len().max(1) as f64
    };
    let parts = [longest / 2.0, longest / 3.0].into_iter();
    let possible = parts.filter(|pitch| *pitch >= MIN_PITCH * full_size);
    let best = possible.min_by(|a, b| misfit(a).total_cmp(&misfit(b)));
    let is_better = |pitch: &f64| misfit(pitch) < BETTER_FIT * misfit(&longest);
    Some(best.filter(is_better).unwrap_or(longest))
}

/// Returns the upper median of values, of which there is at least one.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
