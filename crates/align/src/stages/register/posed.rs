//! A refined pose with its canvas and thresholds, for the depth map as rendered or for a levelled one.

use super::confidence;
use super::half_canvas::{HalfCanvas, to_half};
use super::ink_edge::InkEdge;
use super::levelling;
use super::metric_thresholds::{self, ChosenThreshold};
use super::observation::Observation;
use super::params::{RegisterError, RegisterParams};
use super::pose_search::PoseSearch;
use super::refine::{self, Refinement};
use super::unmatched::{self, Unmatched};
use crate::stages::normalize::{Normalized, relative_depths, relief_heights};
use crate::stages::pose::SoftMask;
use mocban_core::domain::{Affine2, Levelling, PoseFeatures, ReliefHeights, ThresholdMetric};
use mocban_core::raster::{DepthMap, warp_depth};

/// A pair is refused as mirrored if its mirrored score, after the refinement, is more than this many times its upright
/// score. The factor is above 1 because a symmetric character scores about the same both ways.
const MIRROR_WINS: f64 = 1.06;

/// A levelled depth map is used only if the edges of ink and strokes scatter by at most this share of what they scatter
/// on the map as rendered. It is 0.3 to 0.85 where a levelling is needed, and about 1 where strokes are lost.
const LESS_SCATTER: f64 = 0.85;
/// A levelled depth map is registered only if the edges scatter by at most this share at the pose of the map as rendered.
/// The registration costs as much as that of the map as rendered. On generated pairs of all kinds, this share was at most
/// 0.82 for the maps that were used.
const LESS_SCATTER_BEFORE: f64 = 0.85;

/// A refined pose, the print and the depth map at it, and the thresholds.
pub(super) struct Posed {
    pub(super) refined: Refinement,
    pub(super) canvas: HalfCanvas,
    pub(super) thresholds: Vec<ChosenThreshold>,
    /// Evidence for and against the pose.
    pub(super) features: PoseFeatures,
    /// Displacement of whole strokes of the ink, see `misfit`, as a fraction of the stroke width.
    pub(super) smooth_misfit: f64,
    /// How surely one of print and relief has a whole stroke that the other one lacks, 0..=1, see `lone_stroke`.
    pub(super) lone_stroke: f64,
    /// Heights of the relief.
    relief: ReliefHeights,
    /// Distance by which the ink spreads over the strokes, in pixels of the half canvas.
    spread: f64,
}

impl Posed {
    /// Refines the poses of a search, and chooses the thresholds. `depths` are the depths of `depth` below the tops.
    /// `is_levelled` is whether `depth` was levelled.
    ///
    /// # Errors
    /// Returns an error if print, relief or strokes are empty, or if the pose is too unlikely.
    pub(super) fn new(
        depth: &DepthMap,
        depths: &SoftMask,
        relief: &ReliefHeights,
        normalized: &Normalized,
        search: &PoseSearch,
        is_levelled: bool,
        params: &RegisterParams,
    ) -> Result<Self, RegisterError> {
        let print = &normalized.prints[search.ink];
        let refined = refine::refine(depths, print, search, params).ok_or(RegisterError::NoPose)?;
        let canvas_from_print = normalized.outcome.inks[search.ink].canvas_from_print;
        let canvas = || {
            let (pose, side) = (&refined.print_from_depth, normalized.outcome.canvas_px);
            HalfCanvas::new(depth, print, &canvas_from_print, pose, side)
        };
        require_match(&refined.features, search.prior, params)
            .map_err(|error| error.with(|| observe(depth, relief, &canvas())))?;
        let canvas = canvas();
        let (thresholds, spread) =
            metric_thresholds::choose(depth, relief, &canvas, is_levelled, params)?;
        let levels = || thresholds.iter().map(|chosen| chosen.choice.level);
        let range = [levels().max(), levels().min()].map(|level| level.unwrap_or(1));
        let relief_levels = relief.depth() / depth.scale.height_per_level;
        let unmatched = Unmatched::of(&canvas, range, relief_levels);
        Ok(Self {
            features: with_unmatched(refined.features, &unmatched),
            smooth_misfit: unmatched.smooth_misfit,
            lone_stroke: unmatched.lone_strokes[0].max(unmatched.lone_strokes[1]),
            refined,
            canvas,
            thresholds,
            relief: *relief,
            spread,
        })
    }

    /// Returns the levels of all metrics.
    fn levels(&self) -> impl Iterator<Item = u16> {
        self.thresholds.iter().map(|chosen| chosen.choice.level)
    }

    /// Compares the two parts of a torn print with the relief, each at its pose. This is the pose of the larger part.
    /// `canvas` shows the smaller one, with levels of the depth map `depth`.
    pub(super) fn with_smaller(&self, canvas: &HalfCanvas, depth: &DepthMap) -> TornParts {
        let levels: Vec<u16> = self.levels().collect();
        let range = [levels.iter().max(), levels.iter().min()].map(|level| *level.unwrap_or(&1));
        let relief_levels = self.relief.depth() / depth.scale.height_per_level;
        // Wood near the line without ink was printed on the larger part, or is hidden.
        let unmatched = Unmatched::of(canvas, range, relief_levels);
        let overlaps = [&self.canvas, canvas].map(|part| part.best_iou(levels.iter().copied()));
        TornParts {
            overlap: overlaps[0] * overlaps[1],
            lone_stroke: unmatched.lone_strokes[0],
        }
    }

    /// Returns what is unusual about the pair, if it does not match. `depth` is the map that this pose places.
    pub(super) fn observe(&self, depth: &DepthMap) -> Observation {
        observe(depth, &self.relief, &self.canvas)
    }
}

/// How well the two parts of a torn print agree with the relief, each at its pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct TornParts {
    /// Product of the parts' intersections over union of ink and strokes, 0..=1.
    pub(super) overlap: f64,
    /// How surely the smaller part has a whole stroke that was not carved, 0..=1.
    pub(super) lone_stroke: f64,
}

/// A depth map that the ink shows to need a levelling.
pub(super) struct Levelled {
    pub(super) map: DepthMap,
    pub(super) levelling: Levelling,
    pub(super) posed: Posed,
}

impl Levelled {
    /// Levels the depth map and registers it once more, if one threshold fits the ink badly. Returns `None` if the map as
    /// rendered fits about as well: its edges scatter hardly more, or it correlates better.
    pub(super) fn try_new(
        depth: &DepthMap,
        relief: &ReliefHeights,
        single: &Posed,
        normalized: &Normalized,
        search: &PoseSearch,
        params: &RegisterParams,
    ) -> Option<Self> {
        let of_ensemble =
            |chosen: &&ChosenThreshold| chosen.choice.metric == ThresholdMetric::Ensemble;
        let level = single.thresholds.iter().find(of_ensemble)?.choice.level;
        let canvas_from_print = normalized.outcome.inks[search.ink].canvas_from_print;
        let canvas_from_depth = canvas_from_print.after(&single.refined.print_from_depth);
        let levelling = levelling::fit(
            depth,
            &single.canvas,
            &canvas_from_depth,
            relief,
            level,
            single.spread,
        )?;
        let map = depth.levelled(&levelling);
        if !scatters_less(&map, &canvas_from_depth, &single.canvas, level) {
            return None;
        }
        let relief = relief_heights(&map)?;
        let depths = relative_depths(&map, &relief);
        let posed = Posed::new(&map, &depths, &relief, normalized, search, true, params).ok()?;
        let [after, before] = [&posed, single].map(|posed| posed.features);
        let is_better = after.edge_scatter <= LESS_SCATTER * before.edge_scatter
            && after.correlation > before.correlation;
        is_better.then_some(Self {
            map,
            levelling,
            posed,
        })
    }
}

/// Returns whether the edges of ink and strokes scatter less on a levelled depth map, at the pose and the threshold of the
/// map as rendered. `canvas` shows the map as rendered.
fn scatters_less(
    levelled: &DepthMap,
    canvas_from_depth: &Affine2,
    canvas: &HalfCanvas,
    level: u16,
) -> bool {
    let (width, height) = (canvas.levels.width(), canvas.levels.height());
    let half_from_depth = to_half(canvas_from_depth);
    let levels = warp_depth(levelled, &half_from_depth, width, height);
    let strokes = levels.zip_map(&canvas.levels, |found, known| known > 0 && found >= level);
    let [after, before] = [strokes, canvas.mask(level)]
        .map(|strokes| unmatched::edge_scatter(canvas, &InkEdge::of(&strokes)));
    after <= LESS_SCATTER_BEFORE * before
}

/// Adds the strokes without a partner to the evidence for the pose.
fn with_unmatched(features: PoseFeatures, unmatched: &Unmatched) -> PoseFeatures {
    PoseFeatures {
        unmatched_tops: unmatched.tops,
        unmatched_ink: unmatched.ink,
        edge_scatter: unmatched.edge_scatter,
        ink_area: unmatched.ink_area,
        ..features
    }
}

/// Depths to which ink may reach, as fractions of the relief's depth.
const INK_DEPTHS: [f64; 6] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5];

/// Returns what is unusual about a pair that does not match.
fn observe(depth: &DepthMap, relief: &ReliefHeights, canvas: &HalfCanvas) -> Observation {
    let halves = || {
        let levels = INK_DEPTHS.map(|share| relief.level_at(&depth.scale, share));
        Observation::of_halves(canvas, levels)
    };
    Observation::of_scan(depth, relief).or(halves)
}

/// Refuses pairs that are mirrored or whose pose is too unlikely. `prior` is what the block knows.
pub(super) fn require_match(
    features: &PoseFeatures,
    prior: f64,
    params: &RegisterParams,
) -> Result<(), RegisterError> {
    let confidence = confidence::of_pose(features, prior);
    if features.mirrored > MIRROR_WINS && params.min_confidence > 0.0 {
        Err(RegisterError::Mirrored {
            times: features.mirrored,
        })
    } else if confidence >= params.min_confidence {
        Ok(())
    } else {
        Err(RegisterError::NoMatch {
            confidence,
            needs: params.min_confidence,
            seen: Observation::Nothing,
        })
    }
}
