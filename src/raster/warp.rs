//! Bringing grids into another frame. Each output pixel looks back through the inverse map, so nothing has holes.
//!
//! When the map shrinks, a pixel averages several looks spread over its square; outside the source there is nothing.

use std::ops::Range;

use super::extremes::Extremes;
use super::{DepthMap, Grid, Mask};
use crate::domain::Affine2;
use crate::wide::widely;

/// Most looks along one side of an output pixel; beyond this a shrinking map begins to alias.
const MAX_LOOKS: usize = 8;
/// A look mixes the pixels around it, so looks this far apart in the source miss nothing between them.
const APART_PX: f64 = 1.5;
/// So much of a pixel must be covered: half of it, whatever the order in which the parts were added.
const HALF: f64 = 0.5 - 1e-9;
/// Side of the squares of output pixels that are first asked for together whether what they see is all alike; where it
/// is not, their quarters are asked, down to the smallest.
const LARGEST_PX: usize = 32;
const SMALLEST_PX: usize = 2;
/// Side of the squares of output pixels that are asked together whether all that they see holds data.
const TOGETHER_PX: usize = 4;

/// A mask in another frame: a pixel is set when at least half of its square is covered.
///
/// `to_from` maps source pixels to output pixels. A map without inverse gives an empty mask.
pub fn warp_mask(mask: &Mask, to_from: &Affine2, width: usize, height: usize) -> Mask {
    let set = mask.map(|set| u8::from(*set));
    let mut warped = warp_strokes(&set, &[1], to_from, width, height);
    warped.swap_remove(0)
}

/// The masks of what reaches each of some levels, in another frame, as [`warp_mask`] brings them there: what they have
/// in common is looked at once.
pub(super) fn warp_strokes<T: Copy + Ord + Default + Into<f64>>(
    values: &Grid<T>,
    levels: &[T],
    to_from: &Affine2,
    width: usize,
    height: usize,
) -> Vec<Mask> {
    let masks = vec![Mask::new(width, height, false); levels.len()];
    let Some(from_to) = to_from.inverse().filter(|_| !levels.is_empty()) else {
        return masks;
    };
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_by_key(|k| levels[*k]);
    let sorted: Vec<T> = order.iter().map(|k| levels[*k]).collect();
    let mut warp = Warp {
        looks: Looks::new(&from_to),
        extremes: Extremes::of(values),
        values,
        levels: &sorted,
        masks,
        open: Vec::new(),
    };
    for y in (0..height).step_by(LARGEST_PX) {
        for x in (0..width).step_by(LARGEST_PX) {
            warp.square(x, y, LARGEST_PX, 0..levels.len());
        }
        warp.close();
    }
    let mut masks: Vec<(usize, Mask)> = order.into_iter().zip(warp.masks).collect();
    masks.sort_unstable_by_key(|(k, _)| *k);
    masks.into_iter().map(|(_, mask)| mask).collect()
}

/// Masks on their way into another frame.
struct Warp<'a, T> {
    looks: Looks,
    extremes: Extremes<T>,
    values: &'a Grid<T>,
    /// The lowest first.
    levels: &'a [T],
    masks: Vec<Mask>,
    /// The smallest squares that are not settled yet.
    open: Vec<Open>,
}

/// A square of output pixels, and the levels of which it is not known yet.
struct Open {
    columns: Range<usize>,
    rows: Range<usize>,
    levels: Range<usize>,
    /// Whether all that it sees lies within the grid.
    is_inside: bool,
}

/// Levels that are looked at side by side.
const LANES: usize = 4;

impl<T: Copy + Ord + Default + Into<f64>> Warp<'_, T> {
    /// Settles a square of output pixels for those levels of which it is not known yet.
    fn square(&mut self, x: usize, y: usize, side: usize, open: Range<usize>) {
        let (width, height) = (self.masks[0].width(), self.masks[0].height());
        let (columns, rows) = (x..(x + side).min(width), y..(y + side).min(height));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let reach = self.looks.reach(&columns, &rows);
        let [low, high] = self.extremes.within(reach, T::default());
        let levels = &self.levels[open.clone()];
        // All reach the levels up to the lowest of what is seen, none those above the highest.
        let all = open.start + levels.partition_point(|level| *level <= low);
        let some = open.start + levels.partition_point(|level| *level <= high);
        for mask in &mut self.masks[open.start..all] {
            for row in rows.clone() {
                mask.data_mut()[row * width..][columns.clone()].fill(true);
            }
        }
        if all == some {
            return;
        }
        if side > SMALLEST_PX {
            let half = side / 2;
            for (x, y) in [(x, y), (x + half, y), (x, y + half), (x + half, y + half)] {
                self.square(x, y, half, all..some);
            }
            return;
        }
        let inside = |[first, last]: [i64; 2], side: usize| first >= 0 && last < side as i64;
        let is_inside =
            inside(reach[0], self.values.width()) && inside(reach[1], self.values.height());
        self.open.push(Open {
            columns,
            rows,
            levels: all..some,
            is_inside,
        });
    }

    /// Settles what is open, pixel by pixel and look by look.
    fn close(&mut self) {
        let Self {
            looks,
            values,
            levels,
            masks,
            open,
            ..
        } = self;
        let half = HALF * looks.count() as f64;
        widely(
            #[inline(always)]
            || {
                for square in open.drain(..) {
                    let mut first = square.levels.start;
                    while first < square.levels.end {
                        let end = (first + LANES).min(square.levels.end);
                        let mut least = [f64::INFINITY; LANES];
                        for k in first..end {
                            least[k - first] = levels[k].into();
                        }
                        for y in square.rows.clone() {
                            for x in square.columns.clone() {
                                let covered = if square.is_inside {
                                    looks.covered(x, y, values, &least, look_inside)
                                } else {
                                    looks.covered(x, y, values, &least, look)
                                };
                                for k in first..end {
                                    masks[k].set(x, y, covered[k - first] >= half);
                                }
                            }
                        }
                        first = end;
                    }
                }
            },
        );
    }
}

/// Heights in another frame as levels of the same scale; 0 where less than half of a pixel's square holds data.
///
/// `to_from` maps depth-map pixels to output pixels.
pub fn warp_depth(depth: &DepthMap, to_from: &Affine2, width: usize, height: usize) -> Grid<u16> {
    let Some(from_to) = to_from.inverse() else {
        return Grid::new(width, height, 0);
    };
    let levels = &depth.levels;
    let (looks, extremes) = (Looks::new(&from_to), Extremes::of(levels));
    let rounded = |level: f64| level.round().clamp(1.0, 65535.0) as u16;
    let mut out = Grid::new(width, height, 0);
    for top in (0..height).step_by(TOGETHER_PX) {
        for left in (0..width).step_by(TOGETHER_PX) {
            let columns = left..(left + TOGETHER_PX).min(width);
            let rows = top..(top + TOGETHER_PX).min(height);
            let [low, high] = extremes.within(looks.reach(&columns, &rows), 0);
            if high == 0 {
                continue;
            }
            for y in rows {
                for x in columns.clone() {
                    let mean = if low > 0 {
                        Some(looks.mean_inside(x, y, levels))
                    } else {
                        looks.mean(x, y, |p| level_at(levels, p))
                    };
                    out.set(x, y, mean.map_or(0, rounded));
                }
            }
        }
    }
    out
}

/// Where an output pixel looks in the source.
struct Looks {
    from_to: Affine2,
    per_side: usize,
    /// Where the looks lie along a side, output pixels from the middle; the first `per_side` of them count.
    offsets: [f64; MAX_LOOKS],
    /// How far the outermost looks lie from the middle one, source pixels along x and y.
    spread: [f64; 2],
}

impl Looks {
    fn new(from_to: &Affine2) -> Self {
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
    fn covered<T: Copy + Default + Into<f64>>(
        &self,
        x: usize,
        y: usize,
        values: &Grid<T>,
        least: &[f64; LANES],
        look: impl Fn(&Grid<T>, [f64; 2]) -> ([T; 4], [f64; 2]),
    ) -> [f64; LANES] {
        let mut covered = [0.0; LANES];
        self.each(x, y, |place| {
            let (near, within) = look(values, place);
            let weights = weights(within);
            for i in 0..4 {
                let value: f64 = near[i].into();
                for k in 0..LANES {
                    covered[k] += if value >= least[k] { weights[i] } else { 0.0 };
                }
            }
        });
        covered
    }

    fn count(&self) -> usize {
        self.per_side * self.per_side
    }

    /// Mean of what the looks find; `None` when half of them or more find nothing.
    fn mean(&self, x: usize, y: usize, value: impl Fn([f64; 2]) -> Option<f64>) -> Option<f64> {
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
    fn mean_inside(&self, x: usize, y: usize, levels: &Grid<u16>) -> f64 {
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
    fn reach(&self, columns: &Range<usize>, rows: &Range<usize>) -> [[i64; 2]; 2] {
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
fn floor(value: f64) -> i64 {
    let cut = value as i64;
    cut - i64::from(cut as f64 > value)
}

/// The four pixels around a place, and where between them it lies; outside the grid there is the least of values.
#[inline(always)]
fn look<T: Copy + Default>(values: &Grid<T>, [x, y]: [f64; 2]) -> ([T; 4], [f64; 2]) {
    let (x0, y0) = (floor(x), floor(y));
    let near = neighbours(values, x0, y0, T::default());
    (near, [x - x0 as f64, y - y0 as f64])
}

/// The same where all four pixels are within the grid.
#[inline(always)]
fn look_inside<T: Copy>(values: &Grid<T>, [x, y]: [f64; 2]) -> ([T; 4], [f64; 2]) {
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
fn weights([fx, fy]: [f64; 2]) -> [f64; 4] {
    let (left, above) = (1.0 - fx, 1.0 - fy);
    [left * above, fx * above, left * fy, fx * fy]
}

/// Bilinear level among the neighbours that hold data; `None` when they weigh less than half.
fn level_at(levels: &Grid<u16>, [x, y]: [f64; 2]) -> Option<f64> {
    let (x0, y0) = (floor(x), floor(y));
    let (fx, fy) = (x - x0 as f64, y - y0 as f64);
    let near = neighbours(levels, x0, y0, 0).map(f64::from);
    if near == [0.0; 4] {
        return None;
    }
    let above = near[0] + (near[1] - near[0]) * fx;
    let below = near[2] + (near[3] - near[2]) * fx;
    let level = above + (below - above) * fy;
    if near.iter().all(|level| *level > 0.0) {
        return Some(level);
    }
    let held = near.map(|level| if level > 0.0 { 1.0 } else { 0.0 });
    let above = held[0] + (held[1] - held[0]) * fx;
    let below = held[2] + (held[3] - held[2]) * fx;
    let weight = above + (below - above) * fy;
    (weight >= 0.5).then(|| level / weight)
}

/// A pixel and those to its right and below, row after row; `outside` where there are none.
#[inline(always)]
fn neighbours<T: Copy>(grid: &Grid<T>, x: i64, y: i64, outside: T) -> [T; 4] {
    let width = grid.width();
    let inside = |i: i64, side: usize| i >= 0 && i + 1 < side as i64;
    if inside(x, width) && inside(y, grid.height()) {
        let from = &grid.data()[y as usize * width + x as usize..][..width + 2];
        [from[0], from[1], from[width], from[width + 1]]
    } else {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| grid.get(x + dx, y + dy).unwrap_or(outside))
    }
}

#[cfg(test)]
mod tests {
    use super::{HALF, Looks, look, warp_mask, warp_strokes, weights};
    use crate::domain::Affine2;
    use crate::raster::{Grid, Mask};

    fn blob() -> Mask {
        Mask::from_fn(40, 30, |x, y| {
            (8..25).contains(&x) && (5..19).contains(&y) && x + y > 20
        })
    }

    #[test]
    fn identity_changes_nothing() {
        let mask = blob();
        assert_eq!(warp_mask(&mask, &Affine2::IDENTITY, 40, 30), mask);
    }

    #[test]
    fn four_quarter_turns_lead_back() {
        let mask = blob();
        let turn = |m: &Mask| {
            let quarter = Affine2([[0.0, -1.0, (m.height() - 1) as f64], [1.0, 0.0, 0.0]]);
            warp_mask(m, &quarter, m.height(), m.width())
        };
        assert_ne!(turn(&mask), mask);
        assert_eq!(turn(&turn(&turn(&turn(&mask)))), mask);
    }

    #[test]
    fn there_and_back_keeps_the_inside() {
        let mask = blob();
        let there = Affine2::similarity(2.0, 0.5, [20.0, 10.0]);
        let back = there.inverse().expect("a similarity has an inverse");
        let again = warp_mask(&warp_mask(&mask, &there, 120, 120), &back, 40, 30);
        let differ = again
            .data()
            .iter()
            .zip(mask.data())
            .filter(|(a, b)| a != b)
            .count();
        assert!(differ <= 12, "{differ} pixels differ");
    }

    #[test]
    fn what_is_alike_all_over_equals_look_by_look() {
        let levels = Grid::from_fn(90, 70, |x, y| {
            ((x / 9 + y / 14) % 4 * 1000 + x * y % 31) as u16
        });
        let chosen = [2010, 1, 1030, 3000, 1];
        for (scale, angle) in [(0.3, 0.4), (0.8, 2.0), (1.7, -1.0)] {
            let map = Affine2::similarity(scale, angle, [20.0, 9.0]);
            let looks = Looks::new(&map.inverse().expect("a similarity has an inverse"));
            let warped = warp_strokes(&levels, &chosen, &map, 50, 60);
            for (level, warped) in chosen.into_iter().zip(warped) {
                let mask = levels.map(|l| *l >= level);
                let plain = Mask::from_fn(50, 60, |x, y| {
                    let set = |p| {
                        let (near, within) = look(&mask, p);
                        let pairs = near.into_iter().zip(weights(within));
                        Some(
                            pairs
                                .map(|(set, weight)| if set { weight } else { 0.0 })
                                .sum(),
                        )
                    };
                    looks.mean(x, y, set) >= Some(HALF)
                });
                assert_eq!(warped, plain);
                assert_eq!(warp_mask(&mask, &map, 50, 60), plain);
            }
        }
    }
}
