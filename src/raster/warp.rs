//! Bringing grids into another frame. Each output pixel looks back through the inverse map, so nothing has holes.
//!
//! When the map shrinks, a pixel averages several looks spread over its square; outside the source there is nothing.

use std::ops::Range;

use super::minmax_pyramid::Extremes;
use super::supersample::{Looks, floor, look, look_inside, neighbours};
use super::{DepthMap, Grid, Mask};
use crate::domain::Affine2;
use crate::simd::dispatch;

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

    /// Settles what is open.
    fn close(&mut self) {
        let (looks, values, levels) = (&self.looks, self.values, self.levels);
        let masks = &mut self.masks;
        let open = self.open.drain(..);
        dispatch(
            #[inline(always)]
            || {
                for square in open {
                    square.settle(looks, values, levels, masks);
                }
            },
        );
    }
}

impl Open {
    /// Settles each pixel look by look, a few levels at a time.
    #[inline(always)]
    fn settle<T: Copy + Default + Into<f64>>(
        self,
        looks: &Looks,
        values: &Grid<T>,
        levels: &[T],
        masks: &mut [Mask],
    ) {
        let half = HALF * looks.count() as f64;
        let levels = levels[self.levels.clone()].chunks(LANES);
        let masks = masks[self.levels].chunks_mut(LANES);
        for (levels, masks) in levels.zip(masks) {
            let mut least = [f64::INFINITY; LANES];
            for (least, level) in least.iter_mut().zip(levels) {
                *least = (*level).into();
            }
            for y in self.rows.clone() {
                for x in self.columns.clone() {
                    let covered = if self.is_inside {
                        looks.covered(x, y, values, &least, look_inside)
                    } else {
                        looks.covered(x, y, values, &least, look)
                    };
                    for (mask, covered) in masks.iter_mut().zip(covered) {
                        mask.set(x, y, covered >= half);
                    }
                }
            }
        }
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

#[cfg(test)]
mod tests {
    use super::{HALF, Looks, look, warp_mask, warp_strokes};
    use crate::domain::Affine2;
    use crate::raster::supersample::weights;
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
