//! Chooses each metric's depth threshold in the aligned frame.
//!
//! Candidates are equally spaced depths below the tops. Their masks are compared with the print's ink on the pixels
//! where both print and depth map have data. See [`ThresholdMetric`] for the formulas.

use super::params::{RegisterError, RegisterParams};
use crate::domain::{Affine2, ReliefHeights, ThresholdChoice, ThresholdMetric};
use crate::raster::{DepthMap, Grid, Mask, warp_depth, warp_mask};
use crate::stages::normalize::PrintMasks;
use crate::stages::score::{SsimReference, SsimWindow};

/// Number of candidates between the smallest and the largest depth.
const CANDIDATES: u32 = 40;
/// Step between the candidates whose structure score is computed first.
const COARSE: usize = 4;
/// `ensemble` prefers masks whose area differs from that of the `relief` mask by at most this factor.
const CLOSE_AREA: f64 = 1.12;
/// Smallest plausible area of the tops: the ink's area divided by this. Smaller areas are raised to it.
const MOST_SPREAD: f64 = 2.2;
/// Largest plausible area of the tops: the ink's area times this. Larger areas are lowered to it.
const LEAST_INKED: f64 = 1.15;

/// Print and depth map on a canvas of half the size, on which masks are compared in a quarter of the time.
pub(super) struct HalfCanvas {
    /// Levels of the depth map; 0 where print or depth map holds no data.
    levels: Grid<u16>,
    /// Ink where both hold data.
    ink: Mask,
}

impl HalfCanvas {
    /// Warps print and depth map to the canvas, and clears the pixels where print or depth map has no data.
    pub(super) fn new(
        depth: &DepthMap,
        print: &PrintMasks,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        canvas_px: u32,
    ) -> Self {
        let side = canvas_px as usize / 2;
        let half_from_print = Affine2::scale_shift(0.5, [-0.25, -0.25]).after(canvas_from_print);
        let half_from_depth = half_from_print.after(print_from_depth);
        let mut levels = warp_depth(depth, &half_from_depth, side, side);
        let paper = warp_mask(&print.known, &half_from_print, side, side);
        let mut ink = warp_mask(&print.ink, &half_from_print, side, side);
        let both = levels.data_mut().iter_mut().zip(ink.data_mut());
        for ((level, ink), paper) in both.zip(paper.data()) {
            *level *= u16::from(*paper);
            *ink &= *level > 0;
        }
        Self { levels, ink }
    }

    /// Returns the stroke mask of a level above 0.
    fn mask(&self, level: u16) -> Mask {
        self.levels.map(|l| *l >= level)
    }

    /// Returns the number of stroke pixels of a level above 0.
    fn area(&self, level: u16) -> f64 {
        self.levels.count_at_least(level) as f64
    }
}

/// A candidate threshold.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    level: u16,
    /// Number of stroke pixels on the canvas.
    area: f64,
}

/// Chooses each metric's threshold, in the order of [`ThresholdMetric::ALL`].
///
/// `nl_ssim` includes the spread of the print's ink, and `relief` ignores the print. `ensemble` therefore takes the
/// best structure score among the thresholds whose mask has about the area of the `relief` mask.
///
/// # Errors
/// Returns an error if no threshold leaves strokes, or if no ink lies where the depth map has data.
pub(super) fn choose(
    depth: &DepthMap,
    relief: &ReliefHeights,
    canvas: &HalfCanvas,
    params: &RegisterParams,
) -> Result<Vec<ThresholdChoice>, RegisterError> {
    let ink = canvas.ink.count() as f64;
    let candidates = candidates(depth, relief, canvas, params);
    if candidates.is_empty() || ink == 0.0 {
        return Err(RegisterError::NoStrokes);
    }
    let mut structure = Structure::new(canvas, &candidates, params.window);
    let best = structure.best_of_all().unwrap_or(0);
    let gap = |c: &Candidate| (c.area / ink * params.ink_spread - 1.0).abs();
    let density = nearest(&candidates, gap);
    let edge = relief.level_at(&depth.scale, relief.tops_end);
    // If the tops' area is implausible for this area of ink, `tops_end` is taken to be wrong, and the area is clamped.
    let own_area = canvas
        .area(edge)
        .clamp(ink / MOST_SPREAD, ink * LEAST_INKED);
    let close = |c: &Candidate| (c.area / own_area.max(1.0)).ln().abs() <= CLOSE_AREA.ln();
    let both = structure
        .best((0..candidates.len()).filter(|k| close(&candidates[*k])))
        .unwrap_or_else(|| nearest(&candidates, |c| f64::from(c.level.abs_diff(edge))));
    let choice = |metric, k: usize, score| ThresholdChoice {
        metric,
        level: candidates[k].level,
        score,
        at_bound: k == 0 || k + 1 == candidates.len(),
    };
    Ok(vec![
        choice(ThresholdMetric::NlSsim, best, structure.at(best)),
        choice(
            ThresholdMetric::Density,
            density,
            -gap(&candidates[density]),
        ),
        choice(ThresholdMetric::Ensemble, both, structure.at(both)),
        ThresholdChoice {
            metric: ThresholdMetric::Relief,
            level: edge,
            score: 0.0,
            at_bound: false,
        },
    ])
}

/// Returns the index of the candidate with the smallest distance.
fn nearest(candidates: &[Candidate], far: impl Fn(&Candidate) -> f64) -> usize {
    (0..candidates.len())
        .min_by(|a, b| far(&candidates[*a]).total_cmp(&far(&candidates[*b])))
        .unwrap_or(0)
}

/// Returns the candidates that leave strokes, the shallowest first.
fn candidates(
    depth: &DepthMap,
    relief: &ReliefHeights,
    canvas: &HalfCanvas,
    params: &RegisterParams,
) -> Vec<Candidate> {
    let span = params.threshold_max - params.threshold_min;
    let share = |k: u32| params.threshold_min + span * f64::from(k) / f64::from(CANDIDATES - 1);
    let mut levels: Vec<u16> = (0..CANDIDATES)
        .map(|k| relief.level_at(&depth.scale, share(k)))
        .collect();
    levels.dedup();
    let candidate = |level| Candidate {
        level,
        area: canvas.area(level),
    };
    let tried = levels.into_iter().map(candidate);
    tried.filter(|c| c.area > 0.0).collect()
}

/// Structure scores of candidates, computed on demand and cached.
struct Structure<'a> {
    canvas: &'a HalfCanvas,
    candidates: &'a [Candidate],
    means: SsimReference,
    known: Vec<Option<f64>>,
}

impl<'a> Structure<'a> {
    fn new(canvas: &'a HalfCanvas, candidates: &'a [Candidate], window: SsimWindow) -> Self {
        Self {
            canvas,
            candidates,
            means: SsimReference::new(&canvas.ink, window),
            known: vec![None; candidates.len()],
        }
    }

    fn at(&mut self, k: usize) -> f64 {
        *self.known[k].get_or_insert_with(|| {
            let mask = self.canvas.mask(self.candidates[k].level);
            self.means.nl_ssim(&mask)
        })
    }

    /// Returns the best candidate. The score changes slowly with depth, so the search tries every fourth candidate
    /// first and then the neighbours of the best one.
    fn best_of_all(&mut self) -> Option<usize> {
        let count = self.candidates.len();
        let coarse = self.best((0..count).step_by(COARSE))?;
        self.best(coarse.saturating_sub(COARSE - 1)..(coarse + COARSE).min(count))
    }

    /// Returns the first candidate with the highest score.
    fn best(&mut self, among: impl Iterator<Item = usize>) -> Option<usize> {
        let scored = among.map(|k| (k, self.at(k)));
        let best = scored.reduce(|best, other| if other.1 > best.1 { other } else { best });
        best.map(|(k, _)| k)
    }
}

#[cfg(test)]
mod tests {
    //! The choices follow the formulas of [`ThresholdMetric`].

    use super::{CLOSE_AREA, Candidate, HalfCanvas, LEAST_INKED, MOST_SPREAD, candidates, choose};
    use crate::domain::{ReliefHeights, ThresholdChoice, ThresholdMetric};
    use crate::raster::{DepthMap, Grid, Mask};
    use crate::stages::register::RegisterParams;
    use crate::stages::score::SsimReference;
    use crate::stages::testing::settings;

    const SIDE: usize = 128;

    /// Returns a relief of bars with sloping walls, and a canvas on which ink covers the tops and part of the walls.
    fn bars() -> (DepthMap, HalfCanvas, ReliefHeights) {
        let from_axis = |x: usize| (x % 32).abs_diff(16) as f64;
        let level = |x: usize, y: usize| {
            let wall = ((from_axis(x) - 4.0) / 8.0).clamp(0.0, 1.0);
            let rough = 600.0 * ((x * 7 + y * 13) % 11) as f64 / 11.0;
            (50_001.0 * (1.0 - wall) - rough).max(1.0) as u16
        };
        let levels = Grid::from_fn(SIDE, SIDE, level);
        let canvas = HalfCanvas {
            levels: levels.clone(),
            ink: Mask::from_fn(SIDE, SIDE, |x, _| from_axis(x) < 6.0),
        };
        let relief = ReliefHeights {
            top: 0.0,
            ground: -1.0,
            tops_end: 0.08,
        };
        (DepthMap::of_levels(levels), canvas, relief)
    }

    fn best(candidates: &[Candidate], score: impl Fn(&Candidate) -> f64) -> Option<u16> {
        // The first of equals: `max_by` returns the last.
        let best = candidates
            .iter()
            .rev()
            .max_by(|a, b| score(a).total_cmp(&score(b)));
        best.map(|candidate| candidate.level)
    }

    #[test]
    fn each_metric_chooses_by_its_formula() {
        let params: RegisterParams = settings().register;
        let (depth, canvas, relief) = bars();
        let chosen = choose(&depth, &relief, &canvas, &params).expect("strokes and ink");
        let level = |metric: ThresholdMetric| {
            let of_metric = |choice: &&ThresholdChoice| choice.metric == metric;
            chosen.iter().find(of_metric).expect("every metric").level
        };
        let all = candidates(&depth, &relief, &canvas, &params);
        let reference = SsimReference::new(&canvas.ink, params.window);
        let structure = |c: &Candidate| reference.nl_ssim(&canvas.mask(c.level));
        let ink = canvas.ink.count() as f64;
        let gap = |c: &Candidate| (c.area / ink * params.ink_spread - 1.0).abs();
        let by_relief = relief.level_at(&depth.scale, relief.tops_end);
        let wanted = canvas
            .area(by_relief)
            .clamp(ink / MOST_SPREAD, ink * LEAST_INKED);
        let close: Vec<Candidate> = all
            .iter()
            .copied()
            .filter(|c| (c.area / wanted).ln().abs() <= CLOSE_AREA.ln())
            .collect();
        assert_eq!(Some(level(ThresholdMetric::NlSsim)), best(&all, structure));
        assert_eq!(
            Some(level(ThresholdMetric::Density)),
            best(&all, |c| -gap(c))
        );
        assert_eq!(
            Some(level(ThresholdMetric::Ensemble)),
            best(&close, structure)
        );
        assert_eq!(level(ThresholdMetric::Relief), by_relief);
    }
}
