//! Choosing depth thresholds in the aligned frame.
//!
//! Every level between two depths under the tops is a candidate; its mask is compared with the print's ink where
//! both print and depth map hold data.

use super::params::{NormalizeError, NormalizeParams};
use super::relief::Relief;
use crate::domain::{Affine2, ThresholdChoice, ThresholdMetric};
use crate::raster::{DepthMap, Grid, Mask, warp_depth, warp_mask};
use crate::stages::binarize::InkMask;
use crate::stages::score::{SsimReference, SsimWindow};

/// Candidate thresholds between the first and the last cut.
const CANDIDATES: u32 = 40;
/// Every how many candidates the structure score is looked at first.
const COARSE: usize = 4;
/// `ensemble` may differ from `relief` by this factor in area.
const CLOSE_AREA: f64 = 1.12;
/// Ink covers at most this many times the area of the tops, and of the tops' area at least one in this many is inked.
const MOST_SPREAD: f64 = 2.2;
const LEAST_INKED: f64 = 1.15;

/// Both pictures on the canvas, at half its size: the structure of strokes shows as well, in a quarter of the time.
pub(super) struct Canvas {
    /// Levels of the depth map; 0 where one of the two holds nothing.
    levels: Grid<u16>,
    /// Ink where both hold data.
    ink: Mask,
}

impl Canvas {
    /// Brings print and depth map to the canvas by a pose; only what both hold is kept.
    pub(super) fn new(
        depth: &DepthMap,
        print: &InkMask,
        canvas_from_print: &Affine2,
        print_from_depth: &Affine2,
        params: &NormalizeParams,
    ) -> Self {
        let side = params.canvas_px as usize / 2;
        let half_from_print = Affine2::scale_shift(0.5, [-0.25, -0.25]).after(canvas_from_print);
        let half_from_depth = half_from_print.after(print_from_depth);
        let mut levels = warp_depth(depth, &half_from_depth, side, side);
        let paper = warp_mask(&print.soft.known, &half_from_print, side, side);
        let mut ink = warp_mask(&print.mask, &half_from_print, side, side);
        let both = levels.data_mut().iter_mut().zip(ink.data_mut());
        for ((level, ink), paper) in both.zip(paper.data()) {
            *level *= u16::from(*paper);
            *ink &= *level > 0;
        }
        Self { levels, ink }
    }

    /// Strokes at a level above 0.
    fn mask(&self, level: u16) -> Mask {
        self.levels.map(|l| *l >= level)
    }

    /// Number of pixels of the strokes at a level above 0.
    fn area(&self, level: u16) -> f64 {
        self.levels.count_at_least(level) as f64
    }
}

/// One threshold that could be chosen.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    level: u16,
    /// Pixels of the canvas that are stroke at it.
    area: f64,
}

/// Chooses each metric's threshold.
///
/// - `nl_ssim`: the highest structure score.
/// - `density`: the ink share closest to the print's over `ink_spread`.
/// - `ensemble`: the highest structure score among thresholds whose ink share is close to that of `relief`. Structure
///   and density alone copy the print's spread ink; geometry alone knows nothing of the print.
/// - `relief`: where the tops end and the walls begin, whatever the print shows; it has no score.
pub(super) fn choose(
    depth: &DepthMap,
    relief: &Relief,
    canvas: &Canvas,
    params: &NormalizeParams,
) -> Result<Vec<ThresholdChoice>, NormalizeError> {
    let ink = canvas.ink.count() as f64;
    let candidates = candidates(depth, relief, canvas, params);
    if candidates.is_empty() || ink == 0.0 {
        return Err(NormalizeError::NoStrokes);
    }
    let mut structure = Structure::new(canvas, &candidates, params.window);
    let best = structure.best_of_all();
    let gap = |c: &Candidate| (c.area / ink * params.ink_spread - 1.0).abs();
    let density = nearest(&candidates, gap);
    let edge = relief.level_at(depth, relief.edge);
    // Ink covers more than the wood, within reason: beyond that the tops' end was misjudged.
    let own_area = canvas
        .area(edge)
        .clamp(ink / MOST_SPREAD, ink * LEAST_INKED);
    let close = |c: &Candidate| (c.area / own_area.max(1.0)).ln().abs() <= CLOSE_AREA.ln();
    let both = structure
        .best_among(&close)
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

/// Position of the candidate that is least far.
fn nearest(candidates: &[Candidate], far: impl Fn(&Candidate) -> f64) -> usize {
    (0..candidates.len())
        .min_by(|a, b| far(&candidates[*a]).total_cmp(&far(&candidates[*b])))
        .unwrap_or(0)
}

/// Every threshold between the cuts that leaves strokes, the shallowest first.
fn candidates(
    depth: &DepthMap,
    relief: &Relief,
    canvas: &Canvas,
    params: &NormalizeParams,
) -> Vec<Candidate> {
    let span = params.threshold_max - params.threshold_min;
    let share = |k: u32| params.threshold_min + span * f64::from(k) / f64::from(CANDIDATES - 1);
    let mut levels: Vec<u16> = (0..CANDIDATES)
        .map(|k| relief.level_at(depth, share(k)))
        .collect();
    levels.dedup();
    let candidate = |level| Candidate {
        level,
        area: canvas.area(level),
    };
    let tried = levels.into_iter().map(candidate);
    tried.filter(|c| c.area > 0.0).collect()
}

/// Structure scores of candidates, each computed once and only when asked for.
struct Structure<'a> {
    canvas: &'a Canvas,
    candidates: &'a [Candidate],
    means: SsimReference,
    known: Vec<Option<f64>>,
}

impl<'a> Structure<'a> {
    fn new(canvas: &'a Canvas, candidates: &'a [Candidate], window: SsimWindow) -> Self {
        Self {
            canvas,
            candidates,
            means: SsimReference::new(&canvas.ink, window),
            known: vec![None; candidates.len()],
        }
    }

    fn at(&mut self, k: usize) -> f64 {
        if let Some(score) = self.known[k] {
            return score;
        }
        let mask = self.canvas.mask(self.candidates[k].level);
        let score = self.means.nl_ssim(&mask);
        self.known[k] = Some(score);
        score
    }

    /// The best of all: the score changes slowly with depth, so every few are tried, then those around the best.
    fn best_of_all(&mut self) -> usize {
        let count = self.candidates.len();
        let coarse = self.best((0..count).step_by(COARSE));
        let near = coarse.saturating_sub(COARSE - 1)..(coarse + COARSE).min(count);
        self.best(near)
    }

    fn best_among(&mut self, allowed: &impl Fn(&Candidate) -> bool) -> Option<usize> {
        let among: Vec<usize> = (0..self.candidates.len())
            .filter(|k| allowed(&self.candidates[*k]))
            .collect();
        (!among.is_empty()).then(|| self.best(among.into_iter()))
    }

    /// The first of the best.
    fn best(&mut self, among: impl Iterator<Item = usize>) -> usize {
        let mut best = (0, f64::NEG_INFINITY);
        for k in among {
            let score = self.at(k);
            if score > best.1 {
                best = (k, score);
            }
        }
        best.0
    }
}
