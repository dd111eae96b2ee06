//! Measures the heights of tops and ground in a depth map, and computes soft strokes from depths.

use super::height_histogram::HeightHistogram;
use super::sampling::sampled;
use super::steepness::SteepnessProfile;
use crate::domain::ReliefHeights;
use crate::raster::{DepthMap, PixelBox};
use crate::simd::dispatch;
use crate::stages::binarize::{self, Split};
use crate::stages::pose::SoftMask;

/// Share of the map's width and height left out at each border when tops and ground are separated. Side walls and a
/// protruding foot of the block may lie there. They are neither tops nor ground.
const MARGIN: f64 = 0.15;
/// If the tops are closer to the fitted surface than this share of the relief, they are first assumed to lie on it.
const ANCHORED: f64 = 0.5;

/// Largest depth of a carving, as a share of the longest side of the map's data. Real characters reach about 0.1.
const DEEPEST: f64 = 0.25;
/// Largest share of the sampled heights that may lie below the ground, such as heights of a table seen through holes.
const MOST_BELOW: f64 = 0.3;

/// Share of the relief by which a threshold is lowered to see whether it cuts through tops.
const LOWERED_BY: f64 = 0.03;

/// Measures the heights of tops and ground over the fitted surface. Returns `None` if no two sampled heights differ.
///
/// Otsu's threshold splits the heights into two classes. The ground is the median of the lower class. The top is the
/// most frequent height near the upper class, whose median would be too low because of worn rims and walls.
pub(super) fn relief_heights(depth: &DepthMap) -> Option<ReliefHeights> {
    let bounds = depth.levels.map(|level| *level != 0).bounding_box()?;
    let heights = |margin| heights(depth, bounds, margin);
    let side = bounds.longest_side() as f64 * depth.scale.mesh_unit_per_px;
    let split = |margin| split_face(heights(margin), DEEPEST * side);
    let split = split(MARGIN).or_else(|| split(0.0))?;
    let classes = ReliefHeights {
        // Heights are measured from the fitted surface, which lies on the tops.
        top: if split.high.abs() < ANCHORED * (split.high - split.low) {
            0.0
        } else {
            split.high
        },
        ground: split.low,
        tops_end: 0.0,
    };
    let heights = heights(0.0);
    let peak = HeightHistogram::of(&heights, &classes).peak();
    let tops = ReliefHeights {
        top: classes.top - peak * classes.depth(),
        ..classes
    };
    Some(ReliefHeights {
        tops_end: SteepnessProfile::of(depth, bounds, &tops).tops_end(),
        ..tops
    })
}

/// Splits heights into tops and ground. If the classes are farther apart than `deepest`, and few heights are in the
/// lower class, the lower class lies below the ground and is seen through holes of the scan. In that case it is left
/// out, and the other heights are split again.
fn split_face(mut heights: Vec<f32>, deepest: f64) -> Option<Split> {
    let first = binarize::split(&mut heights).filter(|split| split.high > split.low)?;
    let mut split = first;
    while split.high - split.low > deepest {
        let count = heights.len();
        heights.retain(|height| f64::from(*height) > split.threshold);
        let is_few = (count - heights.len()) as f64 <= MOST_BELOW * count as f64;
        let next = binarize::split(&mut heights).filter(|next| next.high > next.low);
        match next {
            Some(next) if is_few => split = next,
            Some(_) | None => return Some(first),
        }
    }
    Some(split)
}

/// Returns the growth of the strokes' area if the threshold `level` is lowered by [`LOWERED_BY`] of the relief, as the
/// logarithm of the ratio of the two areas.
///
/// Walls are steep, so strong growth means that the threshold cuts through worn or tilted tops.
pub(crate) fn stroke_growth(depth: &DepthMap, relief: &ReliefHeights, level: u16) -> f64 {
    let step = LOWERED_BY * relief.depth() / depth.scale.height_per_level;
    let lower = (f64::from(level) - step).clamp(1.0, 65_535.0) as u16;
    let area = |least: u16| depth.levels.count_at_least(least);
    (area(lower) as f64 / area(level.max(1)).max(1) as f64).ln()
}

/// Returns the depth of every pixel below the tops as a share of the relief, clamped to -1..=2.
pub(crate) fn relative_depths(depth: &DepthMap, relief: &ReliefHeights) -> SoftMask {
    let scale = &depth.scale;
    let per_level = (scale.height_per_level / relief.depth()) as f32;
    let none = ((relief.top - scale.height(1)) / relief.depth()) as f32 + per_level;
    let of_level = |level: u16| (none - per_level * f32::from(level)).clamp(-1.0, 2.0);
    dispatch!(SoftMask {
        amount: depth.levels.map(|level| of_level(*level)),
        known: depth.levels.map(|level| *level != 0),
    })
}

/// Returns how surely a point belongs to a stroke, given its depth below the tops: 1 well above the threshold `cut`, 0
/// well below, linear over `softness` in between. All arguments are shares of the relief.
#[inline(always)]
pub(crate) fn soft_stroke(depth: f32, cut: f64, softness: f64) -> f32 {
    (0.5 + (cut as f32 - depth) / softness as f32).clamp(0.0, 1.0)
}

/// Samples the heights inside a box. `margin` is the part left out at each side, as a share of the side's length.
fn heights(depth: &DepthMap, bounds: PixelBox, margin: f64) -> Vec<f32> {
    let mut heights = Vec::new();
    for y in sampled(bounds.y0, bounds.y1, margin) {
        let row = depth.levels.row(y);
        let known = sampled(bounds.x0, bounds.x1, margin)
            .map(|x| row[x])
            .filter(|level| *level > 0);
        heights.extend(known.map(|level| depth.scale.height(level) as f32));
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::{relief_heights, stroke_growth};
    use crate::domain::ReliefHeights;
    use crate::raster::{DepthMap, Grid};

    const SIDE: usize = 80;

    /// Returns the map of a bar on flat ground. The bar is 50,000 levels high and falls by `tilt` levels to the right.
    fn bar(tilt: f64) -> DepthMap {
        let on_bar = |x, y| (20..60).contains(&x) && (30..50).contains(&y);
        let top = |x: usize| 51_000.0 - tilt * (x as f64 - 40.0) / 40.0;
        let level = |x, y| if on_bar(x, y) { top(x) as u16 } else { 1000 };
        DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level))
    }

    #[test]
    fn a_table_seen_through_holes_is_not_the_ground() {
        // A bar 1 mm high, on a map of 80 pixels of 0.1 mm. Every tenth column shows a table 6 mm below the ground.
        let at_height = |mm: f64| (60_000.0 + (mm - 1.0) * 8000.0) as u16;
        let level = |x: usize, y: usize| match (x % 10, y) {
            (0, _) => at_height(-6.0),
            (_, 30..50) => at_height(1.0),
            _ => at_height(0.0) + (x % 7) as u16,
        };
        let mut map = DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level));
        map.scale.height_per_level = 1.0 / 8000.0;
        map.scale.height_min = 1.0 - 60_000.0 / 8000.0;
        map.scale.mesh_unit_per_px = 0.1;
        let relief = relief_heights(&map).expect("a relief");
        assert!((relief.depth() - 1.0).abs() < 0.1, "{relief:?}");
    }

    #[test]
    fn strokes_grow_where_a_threshold_cuts_through_tops() {
        let relief = ReliefHeights {
            top: 0.02,
            ground: -0.98,
            tops_end: 0.05,
        };
        let growth = |tilt| stroke_growth(&bar(tilt), &relief, 51_000);
        assert_eq!(growth(0.0), 0.0);
        assert!(growth(6000.0) > 0.3, "{}", growth(6000.0));
    }
}
