//! Warps masks, and level sets of depth maps, into another frame. Each output pixel is sampled through the inverse map,
//! so there are no holes.
//!
//! If the map shrinks, an output pixel is the mean of several samples. Pixels outside the source are not set. A block
//! of output pixels is filled at once if its source values are all below a level, or all at least that level. Otherwise
//! the block is divided.

use std::ops::Range;

use super::minmax_pyramid::MinMaxPyramid;
use super::supersample::{Supersampler, bilinear_cell, bilinear_cell_inside};
use super::{Grid, Mask};
use crate::domain::Affine2;
use crate::domain::cancel::poll;
use crate::simd::dispatch;

/// Smallest coverage of a pixel that is set: half, less a margin for the rounding errors of the sum.
const HALF_COVERED: f64 = 0.5 - 1e-9;
/// Sides of the largest and the smallest blocks, output pixels.
const MAX_BLOCK_PX: usize = 32;
const MIN_BLOCK_PX: usize = 2;
/// Levels per SIMD vector.
const LANES: usize = 4;

/// Warps a mask into a frame of `width` x `height` pixels. A pixel is set if at least half of its square is covered.
///
/// `to_from` maps source pixels to output pixels. If the map has no inverse, no pixel is set.
///
/// ```
/// use mocban_core::domain::Affine2;
/// use mocban_core::raster::{Mask, warp_mask};
///
/// let square = Mask::from_fn(8, 8, |x, y| (2..6).contains(&x) && (2..6).contains(&y));
/// let shifted = warp_mask(&square, &Affine2::scale_shift(1.0, [1.0, 0.0]), 8, 8);
/// assert_eq!(shifted, Mask::from_fn(8, 8, |x, y| (3..7).contains(&x) && (2..6).contains(&y)));
/// ```
pub fn warp_mask(mask: &Mask, to_from: &Affine2, width: usize, height: usize) -> Mask {
    let set = mask.map(|set| u8::from(*set));
    let mut warped = warp_level_sets(&set, &[1], to_from, width, height);
    warped.swap_remove(0)
}

/// Warps one mask per level, as [`warp_mask`] does. The mask of a level is set where the value is at least that level.
pub(super) fn warp_level_sets<T: Copy + Ord + Default + Into<f64>>(
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
    let mut warp = MaskWarp {
        sampler: Supersampler::new(&from_to),
        value_ranges: MinMaxPyramid::new(values),
        values,
        levels: &sorted,
        masks,
        pending: Vec::new(),
    };
    for y in (0..height).step_by(MAX_BLOCK_PX) {
        poll();
        for x in (0..width).step_by(MAX_BLOCK_PX) {
            warp.fill_block(x, y, MAX_BLOCK_PX, 0..levels.len());
        }
        warp.fill_pending();
    }
    let mut masks: Vec<(usize, Mask)> = order.into_iter().zip(warp.masks).collect();
    masks.sort_unstable_by_key(|(k, _)| *k);
    masks.into_iter().map(|(_, mask)| mask).collect()
}

/// State of a warp of several level sets.
struct MaskWarp<'a, T> {
    sampler: Supersampler,
    value_ranges: MinMaxPyramid<T>,
    values: &'a Grid<T>,
    /// In ascending order.
    levels: &'a [T],
    masks: Vec<Mask>,
    /// The smallest blocks that are not filled yet.
    pending: Vec<PendingBlock>,
}

/// A block of output pixels and the levels that are undecided there.
struct PendingBlock {
    columns: Range<usize>,
    rows: Range<usize>,
    levels: Range<usize>,
    /// Whether all source pixels that it reads are within the grid.
    is_inside: bool,
}

impl<T: Copy + Ord + Default + Into<f64>> MaskWarp<'_, T> {
    /// Fills a block for the undecided levels, or divides it.
    fn fill_block(&mut self, x: usize, y: usize, side: usize, levels_left: Range<usize>) {
        let (width, height) = (self.masks[0].width(), self.masks[0].height());
        let (columns, rows) = (x..(x + side).min(width), y..(y + side).min(height));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let reach = self.sampler.source_bounds(&columns, &rows);
        let [low, high] = self.value_ranges.range_in_box(reach, T::default());
        let levels = &self.levels[levels_left.clone()];
        // The block is covered for levels up to the lowest source value, and empty for levels above the highest one.
        let all = levels_left.start + levels.partition_point(|level| *level <= low);
        let some = levels_left.start + levels.partition_point(|level| *level <= high);
        for mask in &mut self.masks[levels_left.start..all] {
            for row in rows.clone() {
                mask.data_mut()[row * width..][columns.clone()].fill(true);
            }
        }
        if all == some {
            return;
        }
        if side > MIN_BLOCK_PX {
            let half = side / 2;
            for (x, y) in [(x, y), (x + half, y), (x, y + half), (x + half, y + half)] {
                self.fill_block(x, y, half, all..some);
            }
            return;
        }
        let inside = |[first, last]: [i64; 2], side: usize| first >= 0 && last < side as i64;
        let is_inside =
            inside(reach[0], self.values.width()) && inside(reach[1], self.values.height());
        self.pending.push(PendingBlock {
            columns,
            rows,
            levels: all..some,
            is_inside,
        });
    }

    /// Fills the pending blocks.
    fn fill_pending(&mut self) {
        let (sampler, values, levels) = (&self.sampler, self.values, self.levels);
        let masks = &mut self.masks;
        let pending = self.pending.drain(..);
        dispatch!({
            for block in pending {
                block.fill(sampler, values, levels, masks);
            }
        });
    }
}

impl PendingBlock {
    /// Samples each pixel, a few levels at a time.
    #[inline(always)]
    fn fill<T: Copy + Default + Into<f64>>(
        self,
        sampler: &Supersampler,
        values: &Grid<T>,
        levels: &[T],
        masks: &mut [Mask],
    ) {
        let half = HALF_COVERED * sampler.sample_count() as f64;
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
                        sampler.coverage(x, y, values, &least, bilinear_cell_inside)
                    } else {
                        sampler.coverage(x, y, values, &least, bilinear_cell)
                    };
                    for (mask, covered) in masks.iter_mut().zip(covered) {
                        mask.set(x, y, covered >= half);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{HALF_COVERED, Supersampler, bilinear_cell, warp_level_sets, warp_mask};
    use crate::domain::Affine2;
    use crate::raster::supersample::bilinear_weights;
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
    fn four_quarter_turns_are_the_identity() {
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
    fn blocks_filled_at_once_equal_single_samples() {
        let levels = Grid::from_fn(90, 70, |x, y| {
            ((x / 9 + y / 14) % 4 * 1000 + x * y % 31) as u16
        });
        let chosen = [2010, 1, 1030, 3000, 1];
        for (scale, angle) in [(0.3, 0.4), (0.8, 2.0), (1.7, -1.0)] {
            let map = Affine2::similarity(scale, angle, [20.0, 9.0]);
            let sampler = Supersampler::new(&map.inverse().expect("a similarity has an inverse"));
            let warped = warp_level_sets(&levels, &chosen, &map, 50, 60);
            for (level, warped) in chosen.into_iter().zip(warped) {
                let mask = levels.map(|l| *l >= level);
                let plain = Mask::from_fn(50, 60, |x, y| {
                    let set = |p| {
                        let (near, within) = bilinear_cell(&mask, p);
                        let pairs = near.into_iter().zip(bilinear_weights(within));
                        Some(
                            pairs
                                .map(|(set, weight)| if set { weight } else { 0.0 })
                                .sum(),
                        )
                    };
                    sampler.mean(x, y, set) >= Some(HALF_COVERED)
                });
                assert_eq!(warped, plain);
                assert_eq!(warp_mask(&mask, &map, 50, 60), plain);
            }
        }
    }
}
