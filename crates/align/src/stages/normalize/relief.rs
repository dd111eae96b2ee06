//! Measures the heights of tops and ground in a depth map, and computes soft strokes from depths.

use super::height_histogram::HeightHistogram;
use super::sampling::sampled;
use super::steepness::SteepnessProfile;
use crate::stages::binarize::{self, Split};
use crate::stages::face::{Face, PositionedHeight};
use crate::stages::pose::SoftMask;
use mocban_core::domain::ReliefHeights;
use mocban_core::raster::{DepthMap, PixelBox};
use mocban_core::simd::dispatch;

/// If the tops are closer to the fitted surface than this fraction of the relief, they are first assumed to lie on it.
const ANCHORED: f64 = 0.5;

/// Largest depth of a carving, as a fraction of the longest side of the map's data. Real characters reach about 0.1.
const DEEPEST: f64 = 0.25;
/// Largest fraction of the sampled heights that may lie below the ground, such as heights of a table seen through
/// holes.
const MOST_BELOW: f64 = 0.3;

/// Measures the heights of tops and ground over the fitted surface. Returns `None` if no two sampled heights differ.
///
/// Otsu's threshold splits the heights into two classes. The ground is the median of the lower class. The top is the
/// most frequent height near the upper class, whose median would be too low because of worn rims and walls.
pub(crate) fn relief_heights(depth: &DepthMap) -> Option<ReliefHeights> {
    let bounds = depth.levels.map(|level| *level != 0).bounding_box()?;
    let samples = samples(depth, bounds);
    let side = bounds.longest_side() as f64 * depth.scale.mesh_unit_per_px;
    let split = split_face(Face::of(&samples).heights(&samples), DEEPEST * side)?;
    let classes = ReliefHeights {
        // Heights are measured from the fitted surface, which lies on the tops.
        top: if split.high.abs() < ANCHORED * (split.high - split.low) {
            0.0
        } else {
            split.high
        },
        ground: split.low,
        tops_end: 0.0,
        tops_end_log_deviation: 0.0,
    };
    let heights: Vec<f32> = samples.iter().map(|sample| sample.height).collect();
    let peak = HeightHistogram::of(&heights, &classes).peak();
    let tops = ReliefHeights {
        top: classes.top - peak * classes.depth(),
        ..classes
    };
    let end = SteepnessProfile::of(depth, bounds, &tops).tops_end();
    Some(ReliefHeights {
        tops_end: end.depth,
        tops_end_log_deviation: end.log_deviation,
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

/// Returns the depth of every pixel below the tops as a fraction of the relief, clamped to -1..=2.
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
/// well below, linear over `softness` in between. All arguments are fractions of the relief.
#[inline(always)]
pub(crate) fn soft_stroke(depth: f32, cut: f64, softness: f64) -> f32 {
    (0.5 + (cut as f32 - depth) / softness as f32).clamp(0.0, 1.0)
}

/// Samples the heights inside a box.
fn samples(depth: &DepthMap, bounds: PixelBox) -> Vec<PositionedHeight> {
    let [width, height] = [bounds.width(), bounds.height()].map(|side| side as f32);
    let mut samples = Vec::new();
    for y in sampled(bounds.y0, bounds.y1) {
        let row = depth.levels.row(y);
        for x in sampled(bounds.x0, bounds.x1).filter(|x| row[*x] > 0) {
            let position = [
                (x - bounds.x0) as f32 / width,
                (y - bounds.y0) as f32 / height,
            ];
            let height = depth.scale.height(row[x]) as f32;
            samples.push(PositionedHeight::new(position, height));
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::relief_heights;
    use mocban_core::raster::{DepthMap, Grid};

    const SIDE: usize = 80;

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
}
