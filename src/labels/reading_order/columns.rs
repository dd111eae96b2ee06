//! Columns of boxes on a page that is turned upright.

use super::spot::Spot;

/// Gap between centres that separates two columns, in the usual size.
const COLUMN_GAP: f64 = 0.4;
/// Pitch of columns if there is only one, in the usual size.
const USUAL_PITCH: f64 = 1.3;
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
pub(super) fn columns(spots: &[Spot], full_size: f64) -> Vec<BoxColumn> {
    let all = 0..spots.len();
    let (small, full): (Vec<usize>, Vec<usize>) = all.partition(|k| spots[*k].is_small(full_size));
    let mut columns: Vec<BoxColumn> = groups(full, COLUMN_GAP * full_size, |k| spots[k].u)
        .into_iter()
        .map(|boxes| BoxColumn {
            middle: median(boxes.iter().map(|k| spots[*k].u).collect()),
            boxes,
        })
        .collect();
    let pitch = pitch(&columns).unwrap_or(USUAL_PITCH * full_size);
    let mut between: Vec<(usize, f64)> = Vec::new();
    for k in small {
        let u = spots[k].u;
        let distance = |column: &&mut BoxColumn| (column.middle - u).abs();
        let nearest = columns
            .iter_mut()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        match nearest {
            Some(column) if distance(&column) <= REACH * pitch => column.boxes.push(k),
            // The column of notes alone is a whole number of pitches away.
            Some(column) => {
                let steps = ((u - column.middle) / pitch).round();
                between.push((k, column.middle + steps * pitch));
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

/// Groups items whose places follow one another by at most `gap`.
fn groups(mut items: Vec<usize>, gap: f64, place: impl Fn(usize) -> f64) -> Vec<Vec<usize>> {
    items.sort_by(|a, b| place(*a).total_cmp(&place(*b)).then(a.cmp(b)));
    let together = |a: &usize, b: &usize| place(*b) - place(*a) <= gap;
    items.chunk_by(together).map(<[usize]>::to_vec).collect()
}

/// Returns the median distance of neighbouring columns, which are sorted from the left.
fn pitch(columns: &[BoxColumn]) -> Option<f64> {
    let distances = columns
        .windows(2)
        .map(|pair| pair[1].middle - pair[0].middle);
    let distances: Vec<f64> = distances.collect();
    (!distances.is_empty()).then(|| median(distances))
}

/// Returns the upper median of values, of which there is at least one.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
