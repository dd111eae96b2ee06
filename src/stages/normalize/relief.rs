//! How deep the carving is, and soft tops: relief without a threshold.

use super::heap::Heap;
use crate::raster::DepthMap;
use crate::stages::otsu;
use crate::stages::pose::Soft;

/// Every how many pixels the heights are looked at when tops and ground are told apart.
const STRIDE: usize = 3;
/// Tops and ground are told apart without this margin: side walls and a foot that juts out are neither.
const MARGIN: f64 = 0.15;
/// Tops within this share of the relief of the fitted surface lie on it.
const ANCHORED: f64 = 0.5;

/// Heights of tops and ground over the fitted surface, mesh units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    /// Height at which the tops crowd.
    pub top: f64,
    /// Median height of the ground.
    pub ground: f64,
    /// Depth under the tops at which they end and the walls begin, a share of the relief.
    pub edge: f64,
}

impl Relief {
    /// Tells tops from ground; `None` when the map holds fewer than two heights or only one.
    ///
    /// The tops are where most heights crowd near the upper class's median: worn rims and walls are in that class
    /// too, and pull its median down.
    pub fn of(depth: &DepthMap) -> Option<Self> {
        let split = |margin| otsu::split(&mut heights(depth, margin)).filter(|s| s.high > s.low);
        let split = split(MARGIN).or_else(|| split(0.0))?;
        let classes = Self {
            // Heights are over the fitted surface, which lies on the tops, unless the paper's plane was asked for.
            top: if split.high.abs() < ANCHORED * (split.high - split.low) {
                0.0
            } else {
                split.high
            },
            ground: split.low,
            edge: 0.0,
        };
        let heights = heights(depth, 0.0);
        let peak = Heap::of(&heights, &classes).peak();
        let tops = Self {
            top: classes.top - peak * classes.depth(),
            ..classes
        };
        Some(Self {
            edge: Heap::of(&heights, &tops).edge(),
            ..tops
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

/// Every few heights, without a margin of the known box on each side (a share of its length).
fn heights(depth: &DepthMap, margin: f64) -> Vec<f32> {
    let known = depth.levels.map(|level| *level != 0);
    let Some(bounds) = known.bounding_box() else {
        return Vec::new();
    };
    let inner = |low: usize, high: usize| {
        let cut = ((high - low) as f64 * margin) as usize;
        // As far from one end as from the other: a map turned about must give the same heights.
        let rest = 2 * (high - low - 2 * cut) % STRIDE;
        (low + cut + rest..=high - cut).step_by(STRIDE)
    };
    let rows = inner(bounds.y0, bounds.y1);
    rows.flat_map(|y| inner(bounds.x0, bounds.x1).map(move |x| (x, y)))
        .filter_map(|(x, y)| depth.height(x, y).map(|h| h as f32))
        .collect()
}
