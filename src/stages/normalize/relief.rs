//! How deep the carving is, and soft tops: relief without a threshold.

use super::height_histogram::HeightHistogram;
use crate::raster::{DepthMap, PixelBox};
use crate::simd::dispatch;
use crate::stages::binarize;
use crate::stages::pose::SoftMask;

/// Every how many pixels the heights are looked at when tops and ground are told apart.
const STRIDE: usize = 3;
/// Tops and ground are told apart without this margin: side walls and a foot that juts out are neither.
const MARGIN: f64 = 0.15;
/// Tops within this share of the relief of the fitted surface lie on it.
const ANCHORED: f64 = 0.5;

/// Share of the relief by which a cut is lowered to see whether it runs through tops.
const A_BIT: f64 = 0.03;

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
        let known = known_box(depth)?;
        let heights = |margin| heights(depth, known, margin);
        let split = |margin| binarize::split(&mut heights(margin)).filter(|s| s.high > s.low);
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
        let heights = heights(0.0);
        let peak = HeightHistogram::of(&heights, &classes).peak();
        let tops = Self {
            top: classes.top - peak * classes.depth(),
            ..classes
        };
        Some(Self {
            edge: HeightHistogram::of(&heights, &tops).edge(),
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

    /// How much the strokes of a level grow when it is lowered by [`A_BIT`]: the logarithm of their areas' ratio.
    ///
    /// Walls are steep, so much of it says that the cut runs through tops, worn or tilted ones.
    pub(in crate::stages) fn growth(&self, depth: &DepthMap, level: u16) -> f64 {
        let bit = A_BIT * self.depth() / depth.scale.height_per_level;
        let lower = (f64::from(level) - bit).clamp(1.0, 65_535.0) as u16;
        let area = |least: u16| depth.levels.count_at_least(least);
        (area(lower) as f64 / area(level.max(1)).max(1) as f64).ln()
    }

    /// Depth of every pixel under the tops, a share of the relief between -1 and 2.
    pub(in crate::stages) fn depths(&self, depth: &DepthMap) -> SoftMask {
        let scale = &depth.scale;
        let per_level = (scale.height_per_level / self.depth()) as f32;
        let none = ((self.top - scale.height(1)) / self.depth()) as f32 + per_level;
        let of_level = |level: u16| (none - per_level * f32::from(level)).clamp(-1.0, 2.0);
        dispatch(
            #[inline(always)]
            || SoftMask {
                amount: depth.levels.map(|level| of_level(*level)),
                known: depth.levels.map(|level| *level != 0),
            },
        )
    }
}

/// Soft stroke of a depth under the tops: 1 well above the cut, 0 well below, in between over `softness`; all are
/// shares of the relief.
#[inline(always)]
pub(in crate::stages) fn soft_stroke(depth: f32, cut: f64, softness: f64) -> f32 {
    (0.5 + (cut as f32 - depth) / softness as f32).clamp(0.0, 1.0)
}

/// Box around what holds data.
fn known_box(depth: &DepthMap) -> Option<PixelBox> {
    depth.levels.map(|level| *level != 0).bounding_box()
}

/// Every few heights, without a margin of the known box on each side (a share of its length).
fn heights(depth: &DepthMap, bounds: PixelBox, margin: f64) -> Vec<f32> {
    let inner = |low: usize, high: usize| {
        let cut = ((high - low) as f64 * margin) as usize;
        // As far from one end as from the other: a map turned about must give the same heights.
        let rest = 2 * (high - low - 2 * cut) % STRIDE;
        (low + cut + rest..=high - cut).step_by(STRIDE)
    };
    let mut heights = Vec::new();
    for y in inner(bounds.y0, bounds.y1) {
        let row = depth.levels.row(y);
        let known = inner(bounds.x0, bounds.x1)
            .map(|x| row[x])
            .filter(|level| *level > 0);
        heights.extend(known.map(|level| depth.scale.height(level) as f32));
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::Relief;
    use crate::raster::{DepthMap, Grid};

    const SIDE: usize = 80;

    /// A bar on the ground, its top as many levels lower on the right as is said; the relief is 50,000 levels.
    fn bar(tilt: f64) -> DepthMap {
        let on_bar = |x, y| (20..60).contains(&x) && (30..50).contains(&y);
        let top = |x: usize| 51_000.0 - tilt * (x as f64 - 40.0) / 40.0;
        let level = |x, y| if on_bar(x, y) { top(x) as u16 } else { 1000 };
        DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level))
    }

    #[test]
    fn strokes_grow_where_a_cut_runs_through_tops() {
        let relief = Relief {
            top: 0.02,
            ground: -0.98,
            edge: 0.05,
        };
        let growth = |tilt| relief.growth(&bar(tilt), 51_000);
        assert_eq!(growth(0.0), 0.0);
        assert!(growth(6000.0) > 0.3, "{}", growth(6000.0));
    }
}
