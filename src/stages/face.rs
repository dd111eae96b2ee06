//! The part of a height map that shows the carved face.
//!
//! Scans often show the side walls or the foot of the block around the face, up to many times deeper than the carving.
//! Otsu's threshold then splits the heights into face and sides, and not into stroke tops and carved ground. Therefore
//! the heights are split again inside the convex hull of the upper class, where there are no sides.

use std::ops::Range;

use super::binarize;

/// Cells along each side of the map. Points of the upper class count by cell, so single outliers do not.
const CELLS: usize = 32;
/// Least share of the upper class in a cell of the hull.
const LEAST_SHARE: f64 = 0.2;
/// The upper class is the face, and not the tops, if it fills at least this share of the inner cells of its hull, and
/// if these cells hold at least `FACE_AREA` of the map's heights. Dense strokes fill up to about 0.8.
const FACE_DENSITY: f64 = 0.95;
const FACE_AREA: f64 = 0.3;
/// Number of cells by which the hull of tops is enlarged, so that it contains ground around a single stroke.
const ENLARGED_BY: usize = 2;
/// Number of times that the heights are split. The first splits may find the face, and the last one the tops.
const ROUNDS: usize = 4;

/// A height at a position. `x` and `y` are shares of the map's width and height, 0..=1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PositionedHeight {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) height: f32,
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
            let mut heights: Vec<f32> = inside.iter().map(|sample| sample.height).collect();
            let Some(split) = binarize::split(&mut heights) else {
                break;
            };
            let next = face.intersection(&Self::around(&inside, split.threshold));
            if next == face {
                break;
            }
            face = next;
            inside.retain(|sample| face.contains(sample));
        }
        face
    }

    /// Returns the heights of the samples on the face.
    pub(super) fn heights(&self, samples: &[PositionedHeight]) -> Vec<f32> {
        let inside = samples.iter().filter(|sample| self.contains(sample));
        inside.map(|sample| sample.height).collect()
    }

    fn contains(&self, sample: &PositionedHeight) -> bool {
        let [column, row] = cell_of(sample);
        self.0[row].contains(&column)
    }

    /// Returns the convex hull of the cells in which enough heights lie above a threshold. The hull of a face is
    /// reduced, and the hull of tops is enlarged.
    fn around(samples: &[PositionedHeight], threshold: f64) -> Self {
        let mut cells = [[[0_u32; 2]; CELLS]; CELLS];
        for sample in samples {
            let [column, row] = cell_of(sample);
            let [all, high] = &mut cells[row][column];
            *all += 1;
            *high += u32::from(f64::from(sample.height) > threshold);
        }
        let mut points = Vec::new();
        for (y, row) in cells.iter().enumerate() {
            let is_high = |[all, high]: &[u32; 2]| f64::from(*high) > LEAST_SHARE * f64::from(*all);
            let ends = [row.iter().position(is_high), row.iter().rposition(is_high)];
            points.extend(ends.into_iter().flatten().map(|x| [x as f64, y as f64]));
        }
        let hull = Self::hull(&points);
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

    /// Returns the convex hull of cells. Returns all cells if there are no points.
    fn hull(points: &[[f64; 2]]) -> Self {
        let (Some([_, top]), Some([_, bottom])) = (points.first(), points.last()) else {
            return Self([const { 0..CELLS }; CELLS]);
        };
        Self(std::array::from_fn(|y| {
            let y = y as f64;
            if y < *top || y > *bottom {
                return 0..0;
            }
            let [left, right] = across(points, y);
            left.ceil() as usize..right.floor() as usize + 1
        }))
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

/// Returns the cell of a sample, as column and row.
fn cell_of(sample: &PositionedHeight) -> [usize; 2] {
    [sample.x, sample.y].map(|at| ((at * CELLS as f32) as usize).min(CELLS - 1))
}

/// Returns the leftmost and the rightmost x of the convex hull of points at the height `y`. The hull must reach `y`.
///
/// Every point on the hull's boundary lies on a segment between two of the points, so all segments that cross `y` are
/// compared. There are at most 64 points.
fn across(points: &[[f64; 2]], y: f64) -> [f64; 2] {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for [x0, y0] in points {
        for [x1, y1] in points.iter().filter(|[_, y1]| *y0 <= y && y <= *y1) {
            let share = if y1 > y0 { (y - y0) / (y1 - y0) } else { 0.0 };
            let x = x0 + share * (x1 - x0);
            range = [range[0].min(x), range[1].max(x)];
        }
    }
    range
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
                samples.push(PositionedHeight {
                    x: x as f32 / SIDE as f32,
                    y: y as f32 / SIDE as f32,
                    height: height as f32,
                });
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
            sample.height = f32::from(u8::from((0.45..0.55).contains(&sample.y)));
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
