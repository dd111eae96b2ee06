//! Mean steepness of the relief at each depth below the tops, and the depth at which the tops end.
//!
//! Stroke tops are nearly flat and walls are steep. Going down from the tops, the steepness rises to that of the walls.
//! The tops end shortly before the steepness reaches that of the walls. The depth at which they end differs between
//! 0.05 and 0.3 of the relief. The rule holds for new and worn tops, deep and shallow carving, and valleys filled with
//! dirt. Only ratios of slopes are used, so the depth of the carving and the map's resolution do not matter.

use super::height_histogram::{BINS, bin_of, bin_with, middle, smoothed};
use super::sampling::sampled;
use mocban_core::domain::ReliefHeights;
use mocban_core::raster::{DepthMap, PixelBox};

/// A slope is measured between two points, each this fraction of the map's longest side away from the sample.
const REACH: f64 = 1.0 / 256.0;
/// Number of bins averaged.
const WIDTH: usize = 7;
/// Range of depths that holds the flattest tops.
const TOPS: [f64; 2] = [-0.02, 0.06];
/// Range of depths that holds only walls. Their steepness is the quantile `WALL_QUANTILE` over the bins of this range.
const WALLS: [f64; 2] = [0.15, 0.6];
const WALL_QUANTILE: f64 = 0.8;
/// The tops end where the steepness reaches `walls^(1 - SHARE) * tops^SHARE`. Values from 0.2 to 0.25 are about equally
/// accurate on generated reliefs of twelve kinds.
const SHARE: f64 = 0.22;
/// Smallest steepness of tops, as a fraction of the walls' steepness. Without it, flat tops would end at any slope.
const FLATTEST: f64 = 0.05;
/// Range of depths at which tops can end.
const RANGE: [f64; 2] = [0.02, 0.4];
/// Depth that is used if a map has no slopes to measure. It keeps most strokes whole on blocks of all kinds.
const USUAL: f64 = 0.13;

/// Deviation of the logarithm of the depth on a new block.
const LEAST_DEVIATION: f64 = 0.1;
/// Tops are rounded if their steepness, as a fraction of the walls' steepness, is above this. The excess makes the
/// depth uncertain and too large.
const FLAT_TOPS: f64 = 0.04;
/// Growth of the deviation with the excess.
const ROUNDED_DEVIATION: f64 = 2.5;
/// Decrease of the logarithm of the depth with the excess.
const ROUNDED_SHIFT: f64 = 2.0;
/// Growth of the deviation if the surface below the found depth is flatter than `EVEN_WALLS`, as a fraction of the
/// walls' steepness. Then the found depth may be the edge of the last unworn tops, and the strokes end at a lower
/// depth.
const DIP_DEVIATION: f64 = 4.0;
const EVEN_WALLS: f64 = 0.8;
/// The surface below the found depth begins this much deeper, and is measured at every `BELOW_STEP`-th bin.
const BELOW: f64 = 0.04;
const BELOW_STEP: usize = 10;
/// Deviation that is used if a map has no slopes to measure.
const UNKNOWN_DEVIATION: f64 = 1.0;

/// Depth at which the tops end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TopsEnd {
    /// Depth below the tops, as a fraction of the relief.
    pub(super) depth: f64,
    /// Standard deviation of the logarithm of `depth`.
    pub(super) log_deviation: f64,
}

/// Number of samples in each bin of depth, and the sum of their slopes.
#[derive(Debug, Clone)]
pub(super) struct SteepnessProfile {
    counts: Vec<f64>,
    slopes: Vec<f64>,
}

impl SteepnessProfile {
    /// Measures the slopes inside a box of the map. `tops` gives the heights of tops and ground.
    pub(super) fn of(depth: &DepthMap, bounds: PixelBox, tops: &ReliefHeights) -> Self {
        let levels = &depth.levels;
        let (width, height) = (levels.width(), levels.height());
        let reach = ((width.max(height) as f64 * REACH).round() as usize).max(1);
        let per_level = depth.scale.height_per_level / tops.depth();
        let at_zero = (tops.top - depth.scale.height(1)) / tops.depth() + per_level;
        let mut profile = Self {
            counts: vec![0.0; BINS],
            slopes: vec![0.0; BINS],
        };
        let is_inside = |at: &usize, side: usize| *at >= reach && at + reach < side;
        let columns: Vec<usize> = sampled(bounds.x0, bounds.x1)
            .filter(|x| is_inside(x, width))
            .collect();
        for y in sampled(bounds.y0, bounds.y1).filter(|y| is_inside(y, height)) {
            let [above, row, below] = [y - reach, y, y + reach].map(|y| levels.row(y));
            for &x in &columns {
                let near = [row[x - reach], row[x + reach], above[x], below[x]];
                let level = row[x];
                if level == 0 || near.contains(&0) {
                    continue;
                }
                let [left, right, up, down] = near.map(f64::from);
                if let Some(bin) = bin_with(at_zero - per_level * f64::from(level)) {
                    profile.counts[bin] += 1.0;
                    let [across, along] = [right - left, down - up];
                    profile.slopes[bin] += (across * across + along * along).sqrt();
                }
            }
        }
        profile
    }

    /// Estimates the depth at which the tops end.
    pub(super) fn tops_end(&self) -> TopsEnd {
        let steepness = self.smoothed();
        let Some([tops, walls]) = tops_and_walls(&steepness) else {
            return TopsEnd {
                depth: USUAL,
                log_deviation: UNKNOWN_DEVIATION,
            };
        };
        let end = walls.powf(1.0 - SHARE) * tops.max(FLATTEST * walls).powf(SHARE);
        let depth = (bin_of(RANGE[0])..bin_of(RANGE[1]))
            .find(|bin| steepness[*bin].is_some_and(|steepness| steepness >= end))
            .map_or(RANGE[1], middle);
        let below = (bin_of(depth + BELOW)..bin_of(WALLS[1])).step_by(BELOW_STEP);
        let flattest_below = below.filter_map(|bin| steepness[bin]).fold(walls, f64::min);
        let [rounded, dip] = [
            (tops / walls - FLAT_TOPS).max(0.0),
            (EVEN_WALLS - flattest_below / walls).max(0.0),
        ];
        TopsEnd {
            depth: depth * (-ROUNDED_SHIFT * rounded).exp(),
            log_deviation: LEAST_DEVIATION + ROUNDED_DEVIATION * rounded + DIP_DEVIATION * dip,
        }
    }

    /// Returns the mean steepness at each bin of depth, or `None` for bins without samples.
    fn smoothed(&self) -> Vec<Option<f64>> {
        let (counts, slopes) = (smoothed(&self.counts, WIDTH), smoothed(&self.slopes, WIDTH));
        let mean = |(count, slope): (&f64, &f64)| (*count > 0.0).then(|| slope / count);
        counts.iter().zip(&slopes).map(mean).collect()
    }
}

/// Returns the steepness of the flattest tops and of the walls. Returns `None` if there are no tops or no walls.
fn tops_and_walls(steepness: &[Option<f64>]) -> Option<[f64; 2]> {
    let of_range = |[from, to]: [f64; 2]| steepness[bin_of(from)..bin_of(to)].iter().flatten();
    let tops = of_range(TOPS).copied().reduce(f64::min)?;
    let mut walls: Vec<f64> = of_range(WALLS).copied().collect();
    let at = (walls.len().checked_sub(1)? as f64 * WALL_QUANTILE).round() as usize;
    let walls = *walls.select_nth_unstable_by(at, f64::total_cmp).1;
    Some([tops, walls.max(f64::MIN_POSITIVE)])
}

#[cfg(test)]
mod tests {
    use super::{SteepnessProfile, TopsEnd, UNKNOWN_DEVIATION, USUAL};
    use mocban_core::domain::ReliefHeights;
    use mocban_core::raster::{DepthMap, Grid, PixelBox};

    const SIDE: usize = 256;

    /// Returns the depth at which the tops of bars end. The tops are rounded, and their edges are worn by up to `worn`,
    /// a fraction of the relief. The walls are `wall_px` wide.
    fn tops_end(worn: f64, wall_px: f64) -> TopsEnd {
        let depth = |x: usize, y: usize| {
            let from_axis = (x % 64).abs_diff(32) as f64;
            let uneven = 0.5 + 0.5 * (y as f64 / 9.0).sin();
            let top = worn * (from_axis / 12.0).min(1.0) * uneven;
            top + ((from_axis - 12.0) / wall_px).clamp(0.0, 1.0) * (1.0 - top)
        };
        let level = |x: usize, y: usize| 1 + (50_000.0 * (1.0 - depth(x, y))) as u16;
        let map = DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level));
        let heights = ReliefHeights {
            top: map.scale.height(50_001),
            ground: map.scale.height(1),
            tops_end: 0.0,
            tops_end_log_deviation: 0.0,
        };
        let bounds = PixelBox {
            x0: 0,
            y0: 0,
            x1: SIDE - 1,
            y1: SIDE - 1,
        };
        SteepnessProfile::of(&map, bounds, &heights).tops_end()
    }

    #[test]
    fn tops_end_where_walls_begin_at_any_wear_and_depth() {
        for wall_px in [10.0, 16.0] {
            for worn in [0.05, 0.15, 0.25] {
                let end = tops_end(worn, wall_px).depth;
                let wanted = 0.4 * worn..worn + 0.08;
                assert!(wanted.contains(&end), "{end} for {worn}, {wall_px}");
            }
        }
    }

    #[test]
    fn a_map_without_slopes_has_the_usual_depth() {
        let profile = SteepnessProfile {
            counts: vec![0.0; super::BINS],
            slopes: vec![0.0; super::BINS],
        };
        let unknown = TopsEnd {
            depth: USUAL,
            log_deviation: UNKNOWN_DEVIATION,
        };
        assert_eq!(profile.tops_end(), unknown);
    }
}
