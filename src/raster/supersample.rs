//! Where the pixels of another frame look in a grid, and what is there: a look mixes the four pixels around it.

use std::ops::Range;

use super::Grid;
use crate::domain::Affine2;

/// Most looks along one side of an output pixel; beyond this a shrinking map begins to alias.
const MAX_LOOKS: usize = 8;
/// A look mixes the pixels around it, so looks this far apart in the source miss nothing between them.
const APART_PX: f64 = 1.5;

/// Where an output pixel looks in the source.
pub(super) struct Looks {
    from_to: Affine2,
    per_side: usize,
    /// Where the looks lie along a side, output pixels from the middle; the first `per_side` of them count.
    offsets: [f64; MAX_LOOKS],
    /// How far the outermost looks lie from the middle one, source pixels along x and y.
    spread: [f64; 2],
}

impl Looks {
    pub(super) fn new(from_to: &Affine2) -> Self {
        let per_side = ((from_to.scale() / APART_PX).ceil() as usize).clamp(1, MAX_LOOKS);
        let outermost = 0.5 - 0.5 / per_side as f64;
        Self {
            from_to: *from_to,
            per_side,
            offsets: std::array::from_fn(|i| (i as f64 + 0.5) / per_side as f64 - 0.5),
            spread: from_to
                .0
                .map(|row| outermost * (row[0].abs() + row[1].abs())),
        }
    }

    /// Calls `look` with where they fall for an output pixel, row by row, source pixels.
    #[inline(always)]
    fn each(&self, x: usize, y: usize, mut look: impl FnMut([f64; 2])) {
        let offsets = &self.offsets[..self.per_side];
        for down in offsets {
            for across in offsets {
                look(self.from_to.apply([x as f64 + across, y as f64 + down]));
            }
        }
    }

    /// How much of the looks of an output pixel falls on what reaches each of some levels.
    #[inline(always)]
    pub(super) fn covered<T: Copy + Default + Into<f64>, const LEVELS: usize>(
        &self,
        x: usize,
        y: usize,
        values: &Grid<T>,
        least: &[f64; LEVELS],
        look: impl Fn(&Grid<T>, [f64; 2]) -> ([T; 4], [f64; 2]),
    ) -> [f64; LEVELS] {
        let mut covered = [0.0; LEVELS];
        self.each(x, y, |place| {
            let (near, within) = look(values, place);
            let weights = weights(within);
            for i in 0..4 {
                let value: f64 = near[i].into();
                for k in 0..LEVELS {
                    covered[k] += if value >= least[k] { weights[i] } else { 0.0 };
                }
            }
        });
        covered
    }

    pub(super) fn count(&self) -> usize {
        self.per_side * self.per_side
    }

    /// Mean of what the looks find; `None` when half of them or more find nothing.
    pub(super) fn mean(
        &self,
        x: usize,
        y: usize,
        value: impl Fn([f64; 2]) -> Option<f64>,
    ) -> Option<f64> {
        let (mut sum, mut found) = (0.0, 0_usize);
        self.each(x, y, |place| {
            if let Some(v) = value(place) {
                sum += v;
                found += 1;
            }
        });
        let count = self.count();
        (2 * found > count || (count == 1 && found == 1)).then(|| sum / found as f64)
    }

    /// Mean level where all pixels around the looks are within the grid and hold data.
    pub(super) fn mean_inside(&self, x: usize, y: usize, levels: &Grid<u16>) -> f64 {
        let mut sum = 0.0;
        self.each(x, y, |place| {
            let (near, [fx, fy]) = look_inside(levels, place);
            let [a, b, c, d] = near.map(f64::from);
            let (above, below) = (a + (b - a) * fx, c + (d - c) * fx);
            sum += above + (below - above) * fy;
        });
        sum / self.count() as f64
    }

    /// Source pixels that the looks of a box of output pixels may touch: first and last column and row, rather more than
    /// less.
    pub(super) fn reach(&self, columns: &Range<usize>, rows: &Range<usize>) -> [[i64; 2]; 2] {
        const SLACK: f64 = 1e-6;
        let ends = |range: &Range<usize>| [range.start as f64, range.end as f64 - 1.0];
        let ([left, right], [top, bottom]) = (ends(columns), ends(rows));
        let middle = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        let middle = self.from_to.apply(middle);
        let [across, down] = [(right - left) / 2.0, (bottom - top) / 2.0];
        [0, 1].map(|k| {
            let [a, b, _] = self.from_to.0[k].map(f64::abs);
            let reach = a * across + b * down + self.spread[k] + SLACK;
            [floor(middle[k] - reach), floor(middle[k] + reach) + 1]
        })
    }
}

/// The whole number below; a plain cast and a comparison, where `f64::floor` would be a call.
pub(super) fn floor(value: f64) -> i64 {
    let cut = value as i64;
    cut - i64::from(cut as f64 > value)
}

/// The four pixels around a place, and where between them it lies; outside the grid there is the least of values.
#[inline(always)]
pub(super) fn look<T: Copy + Default>(values: &Grid<T>, [x, y]: [f64; 2]) -> ([T; 4], [f64; 2]) {
    let (x0, y0) = (floor(x), floor(y));
    let near = neighbours(values, x0, y0, T::default());
    (near, [x - x0 as f64, y - y0 as f64])
}

/// The same where all four pixels are within the grid.
#[inline(always)]
pub(super) fn look_inside<T: Copy>(values: &Grid<T>, [x, y]: [f64; 2]) -> ([T; 4], [f64; 2]) {
    // Not below zero, so a cast rounds down.
    let (column, row) = (x as i32, y as i32);
    let width = values.width();
    let from = row as usize * width + column as usize;
    let near = &values.data()[from..from + width + 2];
    let near = [near[0], near[1], near[width], near[width + 1]];
    (near, [x - f64::from(column), y - f64::from(row)])
}

/// How much a pixel, the next in its row and the two below have to say at a place between them.
#[inline(always)]
pub(super) fn weights([fx, fy]: [f64; 2]) -> [f64; 4] {
    let (left, above) = (1.0 - fx, 1.0 - fy);
    [left * above, fx * above, left * fy, fx * fy]
}

/// A pixel and those to its right and below, row after row; `outside` where there are none.
#[inline(always)]
pub(super) fn neighbours<T: Copy>(grid: &Grid<T>, x: i64, y: i64, outside: T) -> [T; 4] {
    let width = grid.width();
    let inside = |i: i64, side: usize| i >= 0 && i + 1 < side as i64;
    if inside(x, width) && inside(y, grid.height()) {
        let from = &grid.data()[y as usize * width + x as usize..][..width + 2];
        [from[0], from[1], from[width], from[width + 1]]
    } else {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| grid.get(x + dx, y + dy).unwrap_or(outside))
    }
}
