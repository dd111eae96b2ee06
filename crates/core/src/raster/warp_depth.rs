//! Warps a depth map into another frame.

use super::depth_map::nearest_level;
use super::minmax_pyramid::MinMaxPyramid;
use super::supersample::{Supersampler, bilinear_cell, interpolate};
use super::{DepthMap, Grid};
use crate::domain::Affine2;
use crate::domain::cancel::poll;
use crate::simd::dispatch;

/// Side in pixels of the square blocks of output pixels that are tested together for missing data.
const BLOCK_PX: usize = 4;

/// Warps the levels of a depth map into a frame of `width` x `height` pixels. A pixel gets
/// level 0 (no data) if data covers less than about half of its square, or if the map has no inverse.
///
/// `to_from` maps depth-map pixels to output pixels. A level means the same height in the result as in `depth`.
pub fn warp_depth(depth: &DepthMap, to_from: &Affine2, width: usize, height: usize) -> Grid<u16> {
    let Some(from_to) = to_from.inverse() else {
        return Grid::new(width, height, 0);
    };
    let levels = &depth.levels;
    let (sampler, value_ranges) = (Supersampler::new(&from_to), MinMaxPyramid::new(levels));
    let mut out = Grid::new(width, height, 0);
    for top in (0..height).step_by(BLOCK_PX) {
        poll();
        for left in (0..width).step_by(BLOCK_PX) {
            let columns = left..(left + BLOCK_PX).min(width);
            let rows = top..(top + BLOCK_PX).min(height);
            let [low, high] = value_ranges.range_in_box(sampler.source_bounds(&columns, &rows), 0);
            if high == 0 {
                continue;
            }
            dispatch!({
                for y in rows {
                    for x in columns.clone() {
                        let mean = if low > 0 {
                            Some(sampler.mean_inside(x, y, levels))
                        } else {
                            sampler.mean(x, y, |p| level_at(levels, p))
                        };
                        out.set(x, y, mean.map_or(0, nearest_level));
                    }
                }
            });
        }
    }
    out
}

/// Interpolates the level between the neighbours with data, or returns `None` if their weights sum to less than 0.5.
#[inline(always)]
fn level_at(levels: &Grid<u16>, place: [f64; 2]) -> Option<f64> {
    let (near, within) = bilinear_cell(levels, place);
    if near == [0; 4] {
        return None;
    }
    let level = interpolate(near.map(f64::from), within);
    if !near.contains(&0) {
        return Some(level);
    }
    let weights = near.map(|level| if level > 0 { 1.0 } else { 0.0 });
    let weight = interpolate(weights, within);
    (weight >= 0.5).then(|| level / weight)
}
