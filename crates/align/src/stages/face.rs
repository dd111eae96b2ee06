//! The part of a height map that shows the carved face.
//!
//! Scans often show the side walls or the foot of the block around the face, up to many times deeper than the carving.
//! Otsu's threshold then splits the heights into face and sides, and not into stroke tops and carved ground. Therefore
//! the heights are split again inside the convex hull of the upper class, where there are no sides.

use std::ops::Range;

use super::binarize;

/// Cells along each side of the map. Points of the upper class count by cell, so single outliers do not.
const CELLS: usize = 32;
/// Least fraction of the upper class in a cell of the hull.
const LEAST_SHARE: f64 = 0.2;
/// The upper class is the face, and not the tops, if it fills at least this fraction of the inner cells of its hull,
/// and if these cells hold at least `FACE_AREA` of the map's heights. Dense strokes fill up to about 0.8.
const FACE_DENSITY: f64 = 0.95;
const FACE_AREA: f64 = 0.3;
/// Number of cells by which the hull of tops is enlarged, so that it contains ground around a single stroke.
const ENLARGED_BY: usize = 2;
/// Number of times that the heights are split. The first splits may find the face, and the last one the tops.
const ROUNDS: usize = 4;
/// Thresholds that find the face are computed from every `SPLIT_STEP`-th height. Maps have thousands of heights.
const SPLIT_STEP: usize = 4;

/// A height and the cell in which it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PositionedHeight {
    pub(super) height: f32,
    column: u8,
    row: u8,
}

impl PositionedHeight {
    /// Returns a height at a position, given as fractions of the map's width and height, 0..=1.
    pub(super) fn new(position: [f32; 2], height: f32) -> Self {
        let cell = position.map(|at| ((at * CELLS as f32) as u8).min(CELLS as u8 - 1));
        let [column, row] = cell;
        Self {
            height,
            column,
            row,
        }
    }
}

/// Cells of a height map that show the carved face: a range of columns for each row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Face([Range<usize>; CELLS]);

impl Face {
    /// Finds the face in a map of heights.
    pub(super) fn of(samples: &[PositionedHeight]) -> Self {
        let mut face = Self([const { 0..CELLS }; CELLS]);
        let mut inside = samples.to_vec();
        for _ in 0..ROUNDS {
            let some = inside.iter().step_by(SPLIT_STEP);
            let mut heights: Vec<f32> = some.map(|sample| sample.height).collect();
            let Some(split) = binarize::split(&mut heights) else {
                break;
            };
            let next = face.intersection(&Self::around(&inside, split.threshold));
            if next == face {
                break;
            }
            face = next;
            inside.retain(|sample| face.contains(*sample));
        }
        face
    }

    /// Returns the heights of the samples on the face.
    pub(super) fn heights(&self, samples: &[PositionedHeight]) -> Vec<f32> {
        let inside = samples.iter().filter(|sample| self.contains(**sample));
        inside.map(|sample| sample.height).collect()
    }

    fn contains(&self, sample: PositionedHeight) -> bool {
        self.0[usize::from(sample.row)].contains(&usize::from(sample.column))
    }

    /// Returns the convex hull of the cells in which enough heights lie above a threshold. The hull of a face is
    /// reduced, and the hull of tops is enlarged.
    fn around(samples: &[PositionedHeight], threshold: f64) -> Self {
        let mut cells = [[[0_u32; 2]; CELLS]; CELLS];
        for sample in samples {
            let [all, high] = &mut cells[usize::from(sample.row)][usize::from(sample.column)];
            *all += 1;
            *high += u32::from(f64::from(sample.height) > threshold);
        }
        let ends = cells.map(|row| {
            let is_high = |[all, high]: &[u32; 2]| f64::from(*high) > LEAST_SHARE * f64::from(*all);
            Some(row.iter().position(is_high)?..row.iter().rposition(is_high)? + 1)
        });
        let hull = Self::hull(&ends);
        let inner = hull.reduced();
        let (mut all_inside, mut high_inside) = (0, 0);
        for (row, columns) in cells.iter().zip(&inner.0) {
            for [all, high] in &row[columns.clone()] {
                all_inside += all;
                high_inside += high;
            }
        }
        let high = f64::from(high_inside);
        let is_face =
            high > FACE_DENSITY * f64::from(all_inside) && high > FACE_AREA * samples.len() as f64;
        if is_face {
            inner
        } else {
            (0..ENLARGED_BY).fold(hull, |hull, _| hull.enlarged())
        }
    }

    /// Returns the convex hull of cells, a range of columns for some of the rows. Returns all cells if there are none.
    fn hull(ends: &[Option<Range<usize>>; CELLS]) -> Self {
        let rows = || {
            (0..)
                .zip(ends)
                .filter_map(|(y, row)| Some((y, row.as_ref()?)))
        };
        let left = left_bounds(rows().map(|(y, row)| [row.start as i64, y]));
        // The right boundary is the left boundary of the reflected cells.
        let right = left_bounds(rows().map(|(y, row)| [-(row.end as i64), y]));
        let Some((top, _)) = rows().next() else {
            return Self([const { 0..CELLS }; CELLS]);
        };
        let mut hull = Self([const { 0..0 }; CELLS]);
        let of_rows = hull.0.iter_mut().skip(top as usize);
        for (row, (left, right)) in of_rows.zip(left.into_iter().zip(right)) {
            *row = left as usize..-right as usize;
        }
        hull
    }

    /// Returns the cells whose eight neighbours are on the face.
    fn reduced(&self) -> Self {
        self.with_neighbours(|[above, row, below]| {
            let from = above.start.max(row.start).max(below.start) + 1;
            from..above
                .end
                .min(row.end)
                .min(below.end)
                .saturating_sub(1)
                .max(from)
        })
    }

    /// Adds the neighbours of all cells.
    fn enlarged(&self) -> Self {
        self.with_neighbours(|rows| {
            let rows = || rows.iter().filter(|row| !row.is_empty());
            let from = rows().map(|row| row.start).min().unwrap_or(0);
            let to = rows().map(|row| row.end + 1).max().unwrap_or(0);
            from.saturating_sub(1)..to.min(CELLS)
        })
    }

    /// Computes each row from the row above, the row itself and the row below. Rows outside the map are empty.
    fn with_neighbours(&self, row: impl Fn([&Range<usize>; 3]) -> Range<usize>) -> Self {
        let at = |y: usize| self.0.get(y).unwrap_or(&(0..0));
        Self(std::array::from_fn(|y| {
            row([at(y.wrapping_sub(1)), at(y), at(y + 1)])
        }))
    }

    fn intersection(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|y| {
            let [one, other] = [&self.0[y], &other.0[y]];
            let from = one.start.max(other.start);
            from..one.end.min(other.end).max(from)
        }))
    }
}

/// Returns the smallest whole x inside the convex hull of points, for each y from the first to the last point. `points`
/// yields `[x, y]` with increasing y.
fn left_bounds(points: impl Iterator<Item = [i64; 2]>) -> Vec<i64> {
    // Corners of the hull's left boundary.
    let mut corners: Vec<[i64; 2]> = Vec::new();
    for [x, y] in points {
        while let [.., [x0, y0], [x1, y1]] = corners[..] {
            let is_left_of_chord = (x1 - x0) * (y - y0) < (x - x0) * (y1 - y0);
            if is_left_of_chord {
                break;
            }
            corners.pop();
        }
        corners.push([x, y]);
    }
    let mut bounds: Vec<i64> = corners.first().map(|[x, _]| *x).into_iter().collect();
    for side in corners.windows(2) {
        let [[x0, y0], [x1, y1]] = [side[0], side[1]];
        let height = y1 - y0;
        // Rounds up.
        bounds.extend((1..=height).map(|down| x0 - ((x0 - x1) * down).div_euclid(height)));
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::{Face, PositionedHeight};
    use crate::stages::binarize;

    const SIDE: usize = 96;

    /// Returns the heights of a block of the given half width, with bars 1 high on ground at 0. Its side walls fall by
    /// 0.5 a pixel.
    fn block(half_width: f64) -> Vec<PositionedHeight> {
        let mut samples = Vec::new();
        for y in 0..SIDE {
            for x in 0..SIDE {
                let [u, v] = [x, y].map(|at| at as f64 - 47.5);
                // The block is turned by about 27 degrees.
                let [along, across] = [0.894 * u + 0.447 * v, 0.894 * v - 0.447 * u];
                let outside = along.abs().max(across.abs()) - half_width;
                let is_bar = along.abs() < half_width - 4.0
                    && across.abs() < half_width - 4.0
                    && (across + 100.0).rem_euclid(12.0) < 4.0;
                let height = if outside > 0.0 {
                    -0.5 * outside
                } else {
                    f64::from(u8::from(is_bar))
                };
                let position = [x, y].map(|at| at as f32 / SIDE as f32);
                samples.push(PositionedHeight::new(position, height as f32));
            }
        }
        samples
    }

    #[test]
    fn heights_of_the_face_split_into_tops_and_ground() {
        for half_width in [24.0, 32.0, 60.0] {
            let samples = block(half_width);
            let mut heights = Face::of(&samples).heights(&samples);
            let split = binarize::split(&mut heights).expect("two classes");
            assert_eq!([split.low, split.high], [0.0, 1.0], "{half_width}");
        }
    }

    #[test]
    fn thin_deep_walls_do_not_hide_a_shallow_carving() {
        let mut samples = block(40.0);
        samples.retain(|sample| sample.height > -1.0);
        for sample in samples.iter_mut().filter(|sample| sample.height < 0.0) {
            sample.height *= 100.0;
        }
        let mut heights = Face::of(&samples).heights(&samples);
        let split = binarize::split(&mut heights).expect("two classes");
        assert_eq!([split.low, split.high], [0.0, 1.0]);
    }

    #[test]
    fn a_single_stroke_keeps_ground_around_it() {
        let mut samples = block(200.0);
        for sample in &mut samples {
            sample.height = f32::from(u8::from((15..17).contains(&sample.row)));
        }
        let heights = Face::of(&samples).heights(&samples);
        let ground = heights.iter().filter(|height| **height == 0.0).count();
        assert!(ground * 4 > heights.len(), "{ground} of {}", heights.len());
    }

    #[test]
    fn heights_that_are_all_equal_are_the_face() {
        let mut samples = block(200.0);
        for sample in &mut samples {
            sample.height = 1.0;
        }
        assert_eq!(Face::of(&samples).heights(&samples).len(), samples.len());
    }
}
