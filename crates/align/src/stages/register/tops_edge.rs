//! Estimates the depth at which the stroke tops end, from the relief and from the width of the printed strokes.
//!
//! On new blocks, the relief alone shows this depth: flat tops end at steep walls. Worn tops are round, and their
//! steepness hardly differs from that of the walls. There the print decides, because ink spreads only a little: a mask
//! whose strokes are much thinner or thicker than the ink is improbable. Each candidate depth gets a probability, the
//! normalized product of both kinds of evidence. The probabilities also give the confidence in a mask.

use super::half_canvas::HalfCanvas;
use super::ink_edge::InkEdge;
use mocban_core::domain::ReliefHeights;

/// Typical spread of the ink, and its deviation, as fractions of the stroke width. Dry ink has negative spreads.
const SPREAD: f64 = 0.03;
const SPREAD_DEVIATION: f64 = 0.05;
/// Deviation that the pixels of a small print add, as a fraction of their side.
const PIXEL_DEVIATION: f64 = 0.1;
/// Smallest deviation of the logarithm of the depth that the relief shows.
const LEAST_DEVIATION: f64 = 0.02;
/// Largest intersection over union with the true tops that a mask of the best depth is expected to have.
const BEST_IOU: f64 = 0.93;
/// Part of [`BEST_IOU`] that is lost if the pixels of a small print are as wide as the strokes: the pose is less exact.
const PIXEL_IOU: f64 = 0.08;
/// A mask is right if its intersection over union with the true tops is at least this.
const RIGHT_IOU: f64 = 0.7;

/// Candidate depths with the probability of each to be the edge of the stroke tops.
pub(super) struct TopsEdge {
    /// Number of stroke pixels at each candidate.
    areas: Vec<f64>,
    /// Distance by which the ink spreads over the edge of each candidate's mask, in pixels of the half canvas.
    spreads: Vec<f64>,
    /// Probability of each candidate. Their sum is 1.
    probabilities: Vec<f64>,
    /// Largest intersection over union that is expected, see [`BEST_IOU`].
    best_iou: f64,
}

impl TopsEdge {
    /// Computes the probabilities. `levels` holds at least one candidate, as depth and level, the shallowest first.
    pub(super) fn of(canvas: &HalfCanvas, levels: &[(f64, u16)], relief: &ReliefHeights) -> Self {
        let first_candidate = |level: u16| levels.partition_point(|(_, other)| *other > level);
        let firsts: Vec<usize> = canvas
            .levels
            .data()
            .iter()
            .map(|l| first_candidate(*l))
            .collect();
        let mut areas = vec![0.0; levels.len()];
        for first in firsts.iter().filter(|first| **first < levels.len()) {
            areas[*first] += 1.0;
        }
        for k in 1..areas.len() {
            areas[k] += areas[k - 1];
        }
        let spreads: Vec<f64> = edge_distances(canvas, &firsts, levels.len())
            .iter_mut()
            .map(|distances| InkEdge::mean_near(distances))
            .collect();
        let width = canvas.stroke_width;
        let deviation = SPREAD_DEVIATION.hypot(PIXEL_DEVIATION * canvas.print_px / width);
        let weight = |(k, (share, _)): (usize, &(f64, u16))| {
            if areas[k] == 0.0 {
                return 0.0;
            }
            let depth = (share / relief.tops_end.max(f64::MIN_POSITIVE)).ln();
            let spread = spreads[k] / width - SPREAD;
            heavy_tailed(depth / relief.tops_end_log_deviation.max(LEAST_DEVIATION))
                * heavy_tailed(spread / deviation)
        };
        let mut probabilities: Vec<f64> = levels.iter().enumerate().map(weight).collect();
        let sum: f64 = probabilities.iter().sum();
        for probability in &mut probabilities {
            *probability /= sum.max(f64::MIN_POSITIVE);
        }
        Self {
            areas,
            spreads,
            probabilities,
            best_iou: BEST_IOU - PIXEL_IOU * (canvas.print_px / width).powi(2),
        }
    }

    /// Returns the index of the candidate whose mask has the highest expected intersection over union with the mask of
    /// the true edge.
    pub(super) fn best(&self) -> usize {
        let expected = |k: &usize| self.expected(*k, |iou| iou);
        (0..self.areas.len())
            .max_by(|a, b| expected(a).total_cmp(&expected(b)))
            .unwrap_or(0)
    }

    /// Returns how far the ink spreads over the edge of a candidate's mask, in pixels of the half canvas.
    pub(super) fn spread(&self, candidate: usize) -> f64 {
        self.spreads[candidate]
    }

    /// Returns the probability that a candidate's mask is right.
    pub(super) fn probability_right(&self, candidate: usize) -> f64 {
        self.expected(candidate, |iou| {
            f64::from(u8::from(self.best_iou * iou >= RIGHT_IOU))
        })
    }

    /// Returns the expected value of a function of the intersection over union of the true mask with a candidate's
    /// mask. Masks of different depths contain each other, so the ratio of their areas is their intersection over
    /// union.
    fn expected(&self, candidate: usize, value: impl Fn(f64) -> f64) -> f64 {
        let area = self.areas[candidate];
        let candidates = self.areas.iter().zip(&self.probabilities);
        let ratio = |other: f64| area.min(other) / area.max(other).max(1.0);
        candidates
            .map(|(other, probability)| probability * value(ratio(*other)))
            .sum()
    }
}

/// Returns the density of Student's t distribution with three degrees of freedom, up to a constant factor.
fn heavy_tailed(deviations: f64) -> f64 {
    (1.0 + deviations * deviations / 3.0).powi(-2)
}

/// Returns, for each candidate, the distances to the edge of the ink at the edges of the candidate's mask. `firsts`
/// holds the first candidate whose mask contains each pixel. Edges beside pixels without data are left out.
fn edge_distances(canvas: &HalfCanvas, firsts: &[usize], candidates: usize) -> Vec<Vec<f32>> {
    let mut distances = vec![Vec::new(); candidates];
    canvas.each_adjacent_pair(|one, other| {
        let distance = canvas.edge.at(one).midpoint(canvas.edge.at(other));
        let [one, other] = [firsts[one], firsts[other]];
        for of_candidate in &mut distances[one.min(other)..one.max(other)] {
            of_candidate.push(distance);
        }
    });
    distances
}

#[cfg(test)]
mod tests {
    use super::TopsEdge;
    use crate::stages::register::half_canvas::HalfCanvas;
    use mocban_core::domain::ReliefHeights;
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 96;
    const TOP: u16 = 1000;

    /// Returns a canvas of two bars with a half width of 8 px, inked up to `ink_px` from their axes. The first bar has
    /// ink only in the rows of `is_inked`. The second bar has wood only in the rows of `is_carved`.
    fn canvas(
        ink_px: f64,
        is_inked: impl Fn(usize) -> bool,
        is_carved: impl Fn(usize) -> bool,
    ) -> HalfCanvas {
        let level = |x: usize, y: usize| {
            let is_on_bar = from_axis(x).abs() < 8.0 && (x < 48 || is_carved(y));
            if is_on_bar { TOP } else { 1 }
        };
        canvas_of(level, |x, y| {
            from_axis(x).abs() < ink_px && (x > 48 || is_inked(y))
        })
    }

    fn from_axis(x: usize) -> f64 {
        (x % 48) as f64 - 23.5
    }

    fn canvas_of(
        level: impl Fn(usize, usize) -> u16,
        ink: impl Fn(usize, usize) -> bool,
    ) -> HalfCanvas {
        HalfCanvas::of(
            Grid::from_fn(SIDE, SIDE, level),
            Mask::from_fn(SIDE, SIDE, ink),
        )
    }

    fn relief(tops_end: f64, tops_end_log_deviation: f64) -> ReliefHeights {
        ReliefHeights {
            top: 0.0,
            ground: -1.0,
            tops_end,
            tops_end_log_deviation,
        }
    }

    /// Returns the spread of the ink over bars with vertical walls.
    fn spread(canvas: &HalfCanvas) -> f64 {
        TopsEdge::of(canvas, &[(0.1, TOP)], &relief(0.1, 0.1)).spread(0)
    }

    #[test]
    fn ink_spread_is_measured_from_dry_to_heavy_ink() {
        for wanted in [-2.0, -1.0, 0.0, 1.0, 2.0, 4.0] {
            let found = spread(&canvas(8.0 + wanted, |_| true, |_| true));
            assert!((found - wanted).abs() < 0.1, "{found} for {wanted}");
        }
    }

    #[test]
    fn missing_ink_and_missing_wood_do_not_change_the_spread() {
        let missing = |y: usize| !(30..60).contains(&y);
        for wanted in [-1.0, 2.0] {
            let found = spread(&canvas(8.0 + wanted, missing, missing));
            assert!((found - wanted).abs() < 0.2, "{found} for {wanted}");
        }
    }

    /// Returns the depth that is chosen on ridges whose height falls by 5 % of the relief a pixel from their axes, and
    /// the probability that its mask is right. The ink reaches 8 px from the axes, so the depth of the printed edge is
    /// 0.4.
    fn on_ridges(tops_end: f64, log_deviation: f64) -> (f64, f64) {
        let level = |x: usize, _| (1000.0 * (1.0 - 0.05 * from_axis(x).abs()).max(0.1)) as u16;
        let canvas = canvas_of(level, |x, _| from_axis(x).abs() < 8.0);
        let levels: Vec<(f64, u16)> = (1..60)
            .map(|k| (f64::from(k) / 100.0, 1000 - 10 * k as u16))
            .collect();
        let edge = TopsEdge::of(&canvas, &levels, &relief(tops_end, log_deviation));
        let best = edge.best();
        (levels[best].0, edge.probability_right(best))
    }

    #[test]
    fn print_decides_where_the_relief_is_uncertain() {
        let (depth, probability) = on_ridges(0.1, 1.0);
        assert!((0.3..0.45).contains(&depth), "{depth}");
        assert!(probability > 0.9, "{probability}");
    }

    #[test]
    fn relief_decides_where_it_is_certain() {
        let (depth, probability) = on_ridges(0.1, 0.02);
        assert!((0.08..0.15).contains(&depth), "{depth}");
        // The ink is several times wider than these strokes.
        assert!(probability < on_ridges(0.38, 0.02).1, "{probability}");
    }
}
