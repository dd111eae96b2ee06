//! How deep the carving is, and soft tops: relief without a threshold.

use crate::raster::DepthMap;
use crate::stages::otsu;
use crate::stages::pose::Soft;

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

    /// Depth of every pixel under the tops, a share of the relief between -1 and 2.
    pub(in crate::stages) fn depths(&self, depth: &DepthMap) -> Soft {
        let scale = &depth.scale;
        let per_level = scale.height_per_level / self.depth();
        let first = (self.top - scale.height(1)) / self.depth();
        Soft {
            amount: depth.levels.map(|level| {
                (first - per_level * (f64::from(*level) - 1.0)).clamp(-1.0, 2.0) as f32
            }),
            known: depth.levels.map(|level| *level != 0),
        }
    }
}

/// Soft stroke of a depth under the tops: 1 well above the cut, 0 well below, in between over `softness`; all are
/// shares of the relief.
pub(in crate::stages) fn soft_stroke(depth: f32, cut: f64, softness: f64) -> f32 {
    (0.5 + (cut as f32 - depth) / softness as f32).clamp(0.0, 1.0)
}
