//! Bounding boxes of triangle blocks, to skip blocks without reading their triangles.

use super::triangle_block::{AffineForm, LANES, LaneArray, TriangleBlock};
use mocban_core::simd::{max_f32, min_f32};

/// A box is enlarged by this fraction of the sum of three lengths: the extent of the surface, half the side of the box,
/// and the distance of its centre from the origin. This exceeds rounding errors, so no corner is outside its box.
const MARGIN: f32 = 2e-6;

/// Boxes of [`LANES`] blocks, one per lane. Each box is stored as its centre and half its sides, in x, y and z.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockBounds {
    centre: [LaneArray; 3],
    half: [LaneArray; 3],
}

impl BlockBounds {
    /// Computes the boxes of up to [`LANES`] blocks. Lanes without a block repeat the last block.
    #[inline(always)]
    pub(super) fn new(blocks: &[TriangleBlock], extent: f32) -> Self {
        let mut bounds = Self {
            centre: [[0.0; LANES]; 3],
            half: [[0.0; LANES]; 3],
        };
        for lane in 0..LANES {
            let block = &blocks[lane.min(blocks.len() - 1)];
            for axis in 0..3 {
                let [low, high] = axis_range(block, axis);
                let (centre, half) = (f32::midpoint(low, high), (high - low) * 0.5);
                bounds.centre[axis][lane] = centre;
                bounds.half[axis][lane] = half + MARGIN * (extent + half + centre.abs());
            }
        }
        bounds
    }

    /// Returns the lowest and highest value of an affine form over each box.
    #[inline(always)]
    pub(super) fn range_along(&self, row: &AffineForm) -> [LaneArray; 2] {
        let AffineForm([a, b, c, _]) = *row;
        let centre = row.at_lanes(&self.centre);
        let [x, y, z] = &self.half;
        let (mut low, mut high) = (centre, centre);
        for k in 0..LANES {
            let half = a.abs() * x[k] + b.abs() * y[k] + c.abs() * z[k];
            low[k] -= half;
            high[k] += half;
        }
        [low, high]
    }
}

/// Returns the lowest and highest coordinate along an axis.
#[inline(always)]
fn axis_range(block: &TriangleBlock, axis: usize) -> [f32; 2] {
    let (mut low, mut high) = (block[0][axis], block[0][axis]);
    for corner in &block[1..] {
        for k in 0..LANES {
            low[k] = min_f32(low[k], corner[axis][k]);
            high[k] = max_f32(high[k], corner[axis][k]);
        }
    }
    // Reduces half with half, which is vectorised.
    let (mut lows, mut highs) = ([0.0; LANES / 2], [0.0; LANES / 2]);
    for k in 0..LANES / 2 {
        lows[k] = min_f32(low[k], low[k + LANES / 2]);
        highs[k] = max_f32(high[k], high[k + LANES / 2]);
    }
    let [a, b, c, d] = lows;
    let [e, f, g, h] = highs;
    [
        min_f32(min_f32(a, b), min_f32(c, d)),
        max_f32(max_f32(e, f), max_f32(g, h)),
    ]
}
