//! Boxes around blocks of triangles: a block that cannot matter is passed over without a look at its triangles.

use super::{Block, LANES, Lanes, Row};
use crate::simd::{higher, lower};

/// The boxes are wider than the blocks by this share of the surface's extent and of their own places, so that rounding
/// never leaves a corner outside.
const WIDER: f32 = 2e-6;

/// Boxes around [`LANES`] blocks side by side: x, y and z of their middles, then half their sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Boxes {
    middle: [Lanes; 3],
    half: [Lanes; 3],
}

impl Boxes {
    /// Around each of up to [`LANES`] blocks; lanes without one repeat the last.
    #[inline(always)]
    pub(super) fn around(blocks: &[Block], extent: f32) -> Self {
        let mut boxes = Self {
            middle: [[0.0; LANES]; 3],
            half: [[0.0; LANES]; 3],
        };
        for lane in 0..LANES {
            let block = &blocks[lane.min(blocks.len() - 1)];
            for axis in 0..3 {
                let [low, high] = ends(block, axis);
                let (middle, half) = (f32::midpoint(low, high), (high - low) * 0.5);
                boxes.middle[axis][lane] = middle;
                boxes.half[axis][lane] = half + WIDER * (extent + half + middle.abs());
            }
        }
        boxes
    }

    /// Lowest and highest places that a corner in each of the boxes may have.
    #[inline(always)]
    pub(super) fn reach(&self, row: &Row) -> [Lanes; 2] {
        let Row([a, b, c, _]) = *row;
        let middle = row.at(&self.middle);
        let [x, y, z] = &self.half;
        let (mut low, mut high) = (middle, middle);
        for k in 0..LANES {
            let half = a.abs() * x[k] + b.abs() * y[k] + c.abs() * z[k];
            low[k] -= half;
            high[k] += half;
        }
        [low, high]
    }
}

/// The least and the greatest coordinate along an axis.
#[inline(always)]
fn ends(block: &Block, axis: usize) -> [f32; 2] {
    let (mut low, mut high) = (block[0][axis], block[0][axis]);
    for corner in &block[1..] {
        for k in 0..LANES {
            low[k] = lower(low[k], corner[axis][k]);
            high[k] = higher(high[k], corner[axis][k]);
        }
    }
    // Half with half, so that lanes are compared side by side.
    let (mut lows, mut highs) = ([0.0; LANES / 2], [0.0; LANES / 2]);
    for k in 0..LANES / 2 {
        lows[k] = lower(low[k], low[k + LANES / 2]);
        highs[k] = higher(high[k], high[k + LANES / 2]);
    }
    let [a, b, c, d] = lows;
    let [e, f, g, h] = highs;
    [
        lower(lower(a, b), lower(c, d)),
        higher(higher(e, f), higher(g, h)),
    ]
}
