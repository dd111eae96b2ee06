//! How deep the carving is, and soft tops: relief without a threshold.

use crate::raster::{DepthMap, Mask};
use crate::stages::otsu;
use crate::stages::pose::Soft;

/// Soft tops fade to nothing at this share of the relief under the surface.
const FADE: f64 = 0.5;
/// Every how many pixels the heights are looked at when tops and ground are told apart.
const STRIDE: usize = 3;

/// Heights of tops and ground over the fitted surface, mesh units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    /// Median height of the tops.
    pub top: f64,
    /// Median height of the ground.
    pub ground: f64,
}

impl Relief {
    /// Tells tops from ground; `None` when the map holds fewer than two heights or only one.
    pub fn of(depth: &DepthMap) -> Option<Self> {
        let mut heights = Vec::new();
        for y in (0..depth.levels.height()).step_by(STRIDE) {
            for x in (0..depth.levels.width()).step_by(STRIDE) {
                heights.extend(depth.height(x, y).map(|h| h as f32));
            }
        }
        // A foot or a wall is much deeper than the ground: past twice the median depth nothing is carved.
        heights.sort_unstable_by(f32::total_cmp);
        let split = otsu::split(&mut heights)?;
        (split.high > split.low).then_some(Self {
            top: split.high,
            ground: split.low,
        })
    }

    /// Depth of the carving, mesh units.
    pub fn depth(&self) -> f64 {
        self.top - self.ground
    }

    /// Level of the depth map at a depth under the tops, given as a share of the relief.
    pub fn level_at(&self, depth: &DepthMap, share: f64) -> u16 {
        let scale = &depth.scale;
        let height = self.top - share * self.depth();
        let steps = (height - scale.height_min) / scale.height_per_level;
        (1.0 + steps.round()).clamp(1.0, 65_535.0) as u16
    }

    /// Nearness to the tops, 1 at the tops and 0 from `FADE` of the relief down.
    pub(in crate::stages) fn soft_tops(&self, depth: &DepthMap) -> Soft {
        let span = FADE * self.depth();
        Soft {
            amount: depth.levels.map(|level| {
                if *level == 0 {
                    return 0.0;
                }
                let under = self.top - depth.scale.height(*level);
                (1.0 - under / span).clamp(0.0, 1.0) as f32
            }),
            known: Mask::from_fn(depth.levels.width(), depth.levels.height(), |x, y| {
                depth.levels.at(x, y) != 0
            }),
        }
    }
}
