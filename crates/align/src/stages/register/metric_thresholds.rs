//! Chooses each metric's depth threshold in the aligned frame.
//!
//! Candidates are depths below the tops. Their masks are compared with the print's ink on the pixels where both print
//! and depth map have data. The ink is first corrected by its spread, which is measured at the edges of the `relief`
//! mask. See [`ThresholdMetric`] for the formulas.

use super::half_canvas::HalfCanvas;
use super::params::{RegisterError, RegisterParams};
use super::tops_edge::TopsEdge;
use crate::stages::score::{SsimReference, SsimWindow};
use mocban_core::domain::{ReliefHeights, ThresholdChoice, ThresholdMetric};
use mocban_core::raster::{DepthMap, Mask};

/// Number of candidates between the smallest and the largest depth.
const CANDIDATES: u32 = 40;
/// Step between the candidates whose structure score is computed first.
const COARSE: usize = 4;
/// If a stroke pixel is farther than this from the corrected ink, its ink is missing, and `density` ignores it. The
/// distance is in pixels of the half canvas.
const MISSING_PX: f64 = 3.0;
/// `ensemble` gives full weight to pixels at least this far from the edge of the corrected ink, in half-canvas pixels.
const FULL_PX: f64 = 1.0;
/// Weight of the prior in the score of `ensemble`: a candidate's depth is probably close to the depth of `relief`.
const PRIOR: f64 = 0.05;
/// Largest loss of agreement with the ink, compared with the best candidate, for which `relief` keeps its threshold on a
/// levelled depth map. It is measured with the spread of the first choice.
const LEVELLED_LOSS: f64 = 0.03;

/// A candidate threshold, and how its mask fits the corrected ink.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// Depth below the tops, as a fraction of the relief.
    share: f64,
    level: u16,
    /// Number of stroke pixels whose ink is not missing.
    area_inked: f64,
    /// Agreement with the corrected ink: 1 if the mask covers all ink and no background.
    agreement: f64,
}

/// A metric's threshold with the probability that its mask is right.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChosenThreshold {
    pub(super) choice: ThresholdChoice,
    /// Probability that the mask's intersection over union with the true tops is at least 0.7, given a right pose.
    pub(super) probability_right: f64,
}

/// Chooses each metric's threshold, in the order of [`ThresholdMetric::ALL`]. Also returns the distance by which the ink
/// spreads over the strokes of `relief`, in pixels of the half canvas. `is_levelled` is whether the heights were chosen
/// from the ink: then the relief alone does not show where the tops end.
///
/// # Errors
/// Returns an error if no threshold leaves strokes, or if no ink lies where the depth map has data.
pub(super) fn choose(
    depth: &DepthMap,
    relief: &ReliefHeights,
    canvas: &HalfCanvas,
    is_levelled: bool,
    params: &RegisterParams,
) -> Result<(Vec<ChosenThreshold>, f64), RegisterError> {
    let mut levels = candidate_levels(depth, relief, params);
    let highest = canvas.levels.data().iter().max().copied().unwrap_or(0);
    levels.retain(|(_, level)| *level <= highest);
    if levels.is_empty() || canvas.ink.count() == 0 {
        return Err(RegisterError::NoStrokes);
    }
    let edge = TopsEdge::of(canvas, &levels, relief);
    let measured = |by_relief| candidates(canvas, &levels, edge.spread(by_relief));
    let mut by_relief = edge.best();
    let mut candidates = measured(by_relief);
    if is_levelled {
        by_relief = nearest_agreeing(&candidates, by_relief);
        candidates = measured(by_relief);
    }
    let spread = edge.spread(by_relief);
    let corrected = canvas.edge.corrected(spread);
    // Ink thinner than its spread would vanish.
    let corrected = if corrected.count() == 0 {
        &canvas.ink
    } else {
        &corrected
    };
    let mut structure = Structure::new(canvas, corrected, &candidates, params.window);
    let best = structure.best_of_all();
    let ink = carved_ink(
        canvas,
        corrected,
        levels.last().map_or(1, |(_, level)| *level),
    );
    let gap = |c: &Candidate| (c.area_inked / ink.max(1.0) - 1.0).abs();
    let density = lowest(&candidates, gap);
    let far = |c: &Candidate| (c.share / levels[by_relief].0.max(f64::MIN_POSITIVE)).ln();
    let combined = |c: &Candidate| c.agreement - PRIOR * far(c).powi(2);
    let ensemble = lowest(&candidates, |c| -combined(c));
    let choice = |metric, k: usize, score| ChosenThreshold {
        choice: ThresholdChoice {
            metric,
            level: candidates[k].level,
            score,
            at_bound: k == 0 || k + 1 == candidates.len(),
        },
        probability_right: edge.probability_right(k),
    };
    let chosen = vec![
        choice(ThresholdMetric::NlSsim, best, structure.at(best)),
        choice(
            ThresholdMetric::Density,
            density,
            -gap(&candidates[density]),
        ),
        choice(
            ThresholdMetric::Ensemble,
            ensemble,
            combined(&candidates[ensemble]),
        ),
        choice(ThresholdMetric::Relief, by_relief, 0.0),
    ];
    Ok((chosen, spread))
}

/// Returns the index of the candidate nearest to `from` that agrees with the ink about as well as the best one.
fn nearest_agreeing(candidates: &[Candidate], from: usize) -> usize {
    let agreements = candidates.iter().map(|candidate| candidate.agreement);
    let least = agreements.fold(f64::NEG_INFINITY, f64::max) - LEVELLED_LOSS;
    (0..candidates.len())
        .filter(|k| candidates[*k].agreement >= least)
        .min_by_key(|k| k.abs_diff(from))
        .unwrap_or(from)
}

/// Returns the index of the first candidate with the lowest value.
fn lowest(candidates: &[Candidate], value: impl Fn(&Candidate) -> f64) -> usize {
    (0..candidates.len())
        .min_by(|a, b| value(&candidates[*a]).total_cmp(&value(&candidates[*b])))
        .unwrap_or(0)
}

/// Returns the depths to try, as fractions of the relief, with their levels, the shallowest first. The square roots of
/// the depths are evenly spaced, because the best depth of most blocks is small.
fn candidate_levels(
    depth: &DepthMap,
    relief: &ReliefHeights,
    params: &RegisterParams,
) -> Vec<(f64, u16)> {
    let [from, to] = [params.threshold_min, params.threshold_max].map(f64::sqrt);
    let share = |k: u32| (from + (to - from) * f64::from(k) / f64::from(CANDIDATES - 1)).powi(2);
    let mut levels: Vec<(f64, u16)> = (0..CANDIDATES)
        .map(|k| (share(k), relief.level_at(&depth.scale, share(k))))
        .collect();
    levels.dedup_by_key(|(_, level)| *level);
    levels
}

/// Returns the number of pixels of corrected ink that the deepest candidate covers. For the other ink, the block has no
/// strokes left.
fn carved_ink(canvas: &HalfCanvas, corrected: &Mask, deepest: u16) -> f64 {
    let both = corrected.data().iter().zip(canvas.levels.data());
    both.filter(|(ink, level)| **ink && **level >= deepest)
        .count() as f64
}

/// Measures the candidates. `levels` holds depths and levels, the shallowest first.
fn candidates(canvas: &HalfCanvas, levels: &[(f64, u16)], spread: f64) -> Vec<Candidate> {
    // What each candidate adds to the mask of the candidate before.
    let mut added = vec![[0.0; 2]; levels.len() + 1];
    let mut all_ink = 0.0;
    for (level, distance) in canvas.levels.data().iter().zip(canvas.edge.distances()) {
        if *level == 0 {
            continue;
        }
        let inside = f64::from(*distance) - spread;
        let weight = (inside / FULL_PX).clamp(-1.0, 1.0);
        all_ink += weight.max(0.0);
        let first = levels.partition_point(|(_, candidate)| candidate > level);
        let [area_inked, agreement] = &mut added[first];
        *area_inked += f64::from(u8::from(inside > -MISSING_PX));
        *agreement += weight;
    }
    let mut sum = [0.0; 2];
    let candidate = |((share, level), added): (&(f64, u16), &[f64; 2])| {
        for (sum, added) in sum.iter_mut().zip(added) {
            *sum += added;
        }
        Candidate {
            share: *share,
            level: *level,
            area_inked: sum[0],
            agreement: sum[1] / f64::max(all_ink, 1.0),
        }
    };
    levels.iter().zip(&added).map(candidate).collect()
}

/// Structure scores of candidates, computed on demand and cached.
struct Structure<'a> {
    canvas: &'a HalfCanvas,
    candidates: &'a [Candidate],
    means: SsimReference,
    known: Vec<Option<f64>>,
}

impl<'a> Structure<'a> {
    fn new(
        canvas: &'a HalfCanvas,
        corrected: &Mask,
        candidates: &'a [Candidate],
        window: SsimWindow,
    ) -> Self {
        let ink = corrected.zip_map(&canvas.levels, |ink, level| ink && level > 0);
        Self {
            canvas,
            candidates,
            means: SsimReference::new(&ink, window),
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
    /// first and then the neighbours of the best one. If several are equally good, the search continues near the first
    /// and the last of them, because worn strokes may begin just below the last one.
    fn best_of_all(&mut self) -> usize {
        let count = self.candidates.len();
        let first = self.best((0..count).step_by(COARSE));
        let last = self.best((0..count).step_by(COARSE).rev());
        let near = |k: usize| k.saturating_sub(COARSE - 1)..(k + COARSE).min(count);
        self.best(near(first).chain(near(last)))
    }

    /// Returns the first candidate with the highest score.
    fn best(&mut self, among: impl Iterator<Item = usize>) -> usize {
        let scored = among.map(|k| (k, self.at(k)));
        let best = scored.reduce(|best, other| if other.1 > best.1 { other } else { best });
        best.map_or(0, |(k, _)| k)
    }
}

#[cfg(test)]
mod tests {
    //! The choices follow the formulas of [`ThresholdMetric`].

    use super::{FULL_PX, MISSING_PX, PRIOR, candidate_levels, choose};
    use crate::stages::register::RegisterParams;
    use crate::stages::register::half_canvas::HalfCanvas;
    use crate::stages::register::tops_edge::TopsEdge;
    use crate::stages::score::SsimReference;
    use crate::stages::testing::settings;
    use mocban_core::domain::{ReliefHeights, ThresholdMetric};
    use mocban_core::raster::{DepthMap, Grid, Mask};

    const SIDE: usize = 128;
    const RELIEF: ReliefHeights = ReliefHeights {
        top: 0.0,
        ground: -1.0,
        tops_end: 0.08,
        tops_end_log_deviation: 0.05,
    };

    /// Returns a relief of bars with sloping walls. The tops have a half width of 4 px. The top of the third bar is
    /// worn by `worn`, a fraction of the relief.
    fn bars(worn: f64) -> DepthMap {
        let level = |x: usize, y: usize| {
            let from_axis = (x % 32).abs_diff(16) as f64;
            let wall = ((from_axis - 4.0) / 8.0).clamp(0.0, 1.0);
            let wall = if x / 32 == 2 { wall.max(worn) } else { wall };
            let rough = 600.0 * ((x * 7 + y * 13) % 11) as f64 / 11.0;
            (50_001.0 * (1.0 - wall) - rough).max(1.0) as u16
        };
        DepthMap::of_levels(Grid::from_fn(SIDE, SIDE, level))
    }

    /// Returns a canvas on which ink covers the bars up to `ink_px` from their axes, except in missing rows.
    fn canvas(depth: &DepthMap, ink_px: f64, missing: std::ops::Range<usize>) -> HalfCanvas {
        let ink =
            |x: usize, y: usize| ((x % 32).abs_diff(16) as f64) < ink_px && !missing.contains(&y);
        HalfCanvas::of(depth.levels.clone(), Mask::from_fn(SIDE, SIDE, ink))
    }

    fn params() -> RegisterParams {
        settings().register
    }

    /// Returns the depth that a metric chooses, as a fraction of the relief.
    fn chosen(depth: &DepthMap, canvas: &HalfCanvas, metric: ThresholdMetric) -> f64 {
        let (all, _) = choose(depth, &RELIEF, canvas, false, &params()).expect("strokes and ink");
        let choice = all
            .iter()
            .map(|chosen| chosen.choice)
            .find(|choice| choice.metric == metric);
        -depth.scale.height(choice.expect("every metric").level)
    }

    #[test]
    fn each_metric_chooses_by_its_formula() {
        let (depth, params) = (bars(0.15), params());
        let canvas = canvas(&depth, 6.0, 20..35);
        let levels = candidate_levels(&depth, &RELIEF, &params);
        let edge = TopsEdge::of(&canvas, &levels, &RELIEF);
        let (tops_end, by_relief) = levels[edge.best()];
        let spread = edge.spread(edge.best());
        let corrected = canvas.edge.corrected(spread);
        let reference = SsimReference::new(&corrected, params.window);
        let structure = |level: u16| reference.nl_ssim(&canvas.mask(level));
        let pixels = || canvas.levels.data().iter().zip(canvas.edge.distances());
        let inside = |distance: &f32| f64::from(*distance) - spread;
        let count = |is_counted: &dyn Fn(u16, f64) -> bool| {
            pixels().filter(|(l, d)| is_counted(**l, inside(d))).count() as f64
        };
        let deepest = levels[levels.len() - 1].1;
        let ink = count(&|l, inside| l >= deepest && inside > 0.0);
        let gap = |level: u16| (count(&|l, i| l >= level && i > -MISSING_PX) / ink - 1.0).abs();
        let weight = |distance: &f32| (inside(distance) / FULL_PX).clamp(-1.0, 1.0);
        let all_ink: f64 = pixels().map(|(_, d)| weight(d).max(0.0)).sum();
        let combined = |(share, level): (f64, u16)| {
            let covered = pixels().filter(|(l, _)| **l >= level);
            let agreement: f64 = covered.map(|(_, d)| weight(d)).sum();
            agreement / all_ink - PRIOR * (share / tops_end).ln().powi(2)
        };
        let best = |score: &dyn Fn((f64, u16)) -> f64| {
            // The first of equals: `max_by` returns the last.
            let order = |a: &&(f64, u16), b: &&(f64, u16)| score(**a).total_cmp(&score(**b));
            levels.iter().rev().max_by(order).expect("levels").1
        };
        let (all, _) = choose(&depth, &RELIEF, &canvas, false, &params).expect("strokes and ink");
        let wanted = [
            best(&|(_, level)| structure(level)),
            best(&|(_, level)| -gap(level)),
            best(&combined),
            by_relief,
        ];
        assert_eq!(
            all.iter().map(|c| c.choice.level).collect::<Vec<_>>(),
            wanted
        );
    }

    #[test]
    fn dry_and_heavy_ink_give_about_the_same_thresholds() {
        let depth = bars(0.0);
        for metric in ThresholdMetric::ALL {
            for ink_px in [3.0, 4.0, 6.0, 8.0] {
                let share = chosen(&depth, &canvas(&depth, ink_px, 0..0), metric);
                assert!(
                    (0.0..0.2).contains(&share),
                    "{metric}: {share} for {ink_px} px"
                );
            }
        }
    }

    #[test]
    fn missing_ink_does_not_change_the_thresholds() {
        let depth = bars(0.0);
        for metric in ThresholdMetric::ALL {
            let [whole, torn] =
                [0..0, 20..70].map(|rows| chosen(&depth, &canvas(&depth, 5.0, rows), metric));
            assert!((whole - torn).abs() < 0.06, "{metric}: {whole}, {torn}");
        }
    }

    #[test]
    fn relief_follows_the_ink_on_a_levelled_map() {
        // A rule that is higher than the bars looks like the only tops.
        let bars = bars(0.0);
        let lower = |x: usize, y: usize| bars.levels.at(x, y) / 5 * 4;
        let level = |x: usize, y: usize| if x < 4 { 65_000 } else { lower(x, y) };
        let levels = Grid::from_fn(SIDE, SIDE, level);
        let depth = DepthMap::of_levels(levels);
        let canvas = canvas(&depth, 5.0, 0..0);
        let relief = ReliefHeights {
            top: depth.scale.height(65_000),
            ..RELIEF
        };
        let iou = |is_levelled| {
            let (all, _) = choose(&depth, &relief, &canvas, is_levelled, &params()).expect("ink");
            let mask = canvas.mask(all[3].choice.level);
            let both = mask.zip_map(&canvas.ink, |a, b| a && b).count() as f64;
            both / mask.zip_map(&canvas.ink, |a, b| a || b).count() as f64
        };
        assert!(iou(false) < 0.3, "{}", iou(false));
        assert!(iou(true) > 0.7, "{}", iou(true));
    }

    #[test]
    fn print_brings_back_a_worn_bar_below_the_ends_of_the_other_tops() {
        let depth = bars(0.1);
        let canvas = canvas(&depth, 5.0, 0..0);
        for metric in ThresholdMetric::ALL {
            let share = chosen(&depth, &canvas, metric);
            assert!((0.09..0.2).contains(&share), "{metric}: {share}");
        }
    }
}
