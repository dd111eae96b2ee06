//! Refines the poses of the search, compares them, and refines the best one at full size.

use super::anisotropic_scale::with_anisotropic_scale;
use super::params::RegisterParams;
use super::pose_search::PoseSearch;
use super::soft_thresholds::{FEW_CUTS, SoftThresholds, cuts_near};
use crate::stages::normalize::{PrintMasks, soft_stroke};
use crate::stages::pose::{
    BorderStrokes, ImagePyramid, LevelBuilder, Loss, PoseCandidate, PoseOverlap, PyramidLevel,
    Refiner, SoftMask,
};
use mocban_core::domain::{Affine2, PoseFeatures};

/// An upright pose competes with the best pose only if their angles differ by more than this.
const SAME_POSE_DEG: f64 = 15.0;
/// Number of upright poses that are refined.
const TRIED: usize = 3;
/// Depth range over which soft strokes fall from 1 to 0, as a fraction of the relief's depth.
const SOFTNESS: f64 = 0.1;
/// Poses are compared at this fraction of the working size.
const COMPARED: f64 = 0.42;
/// The threshold of the best pose is chosen at this fraction of the working size.
const CLOSER: f64 = 0.67;
/// If a competitor scores more than this fraction of the best score, both competitors are refined at size `CLOSER` too.
const CLOSE: f64 = 0.75;
/// `fair_share` counts the ratio of the scores on all pixels only up to this value. Competing poses of a symmetric
/// character can reach it.
const SYMMETRIC: f64 = 0.9;
/// The refinement is repeated from the pose scaled down and up by this factor. Ideally, all three end at the same pose.
const OTHER_SIZE: f64 = 1.08;
/// Maximum number of steps of a refinement while poses are compared.
const FEW_STEPS: usize = 8;
/// Maximum number of steps of a refinement of the best pose afterwards.
const MOST_STEPS: usize = 15;

/// The refined pose, which all metrics share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refinement {
    /// Depth-map pixels to print-image pixels.
    pub(super) print_from_depth: Affine2,
    /// Score of the pose minus the score of its best competitor.
    pub(super) margin: f64,
    /// Evidence for and against the pose. If the expected pose is used, its correlation and coverage are those of the best
    /// pose near it, which matches a little better.
    pub(super) features: PoseFeatures,
}

/// Refines the poses of the search and returns the best one, or `None` if print or relief has no data.
///
/// `depths` holds, for each depth-map pixel, the depth below the tops as a fraction of the relief's depth.
pub(super) fn refine(
    depths: &SoftMask,
    print: &PrintMasks,
    search: &PoseSearch,
    params: &RegisterParams,
) -> Option<Refinement> {
    let images = WorkingImages::new(depths, print, params)?;
    let few = images.at(COMPARED);
    let mut poses = CompetingPoses::compare(&few, search)?;
    let cuts = cuts_near(poses.best.cut);
    let closer = images.at(CLOSER);
    let strokes = closer.strokes(&cuts);
    poses.sharpen(&SoftThresholds::new(cuts, &closer.ink, &strokes))?;
    let (refined, spread) = images.refine_fully(&few, &poses.best)?;
    let masks_from_depth = search.expected.unwrap_or(refined);
    Some(Refinement {
        // Poses are found in the frame of the masks.
        print_from_depth: print.print_from_masks().after(&masks_from_depth),
        margin: poses.margin(),
        features: poses.features(spread),
    })
}

/// A refined pose, and the threshold that fits the print best at this pose.
#[derive(Debug, Clone, Copy)]
struct RefinedPose {
    found: PoseCandidate,
    overlap: PoseOverlap,
    cut: f64,
    /// Index of the tried threshold with the highest score.
    nearest: usize,
}

impl RefinedPose {
    /// Returns the score that ranks poses: the correlation times the fraction of the tops that ink covers. The fraction
    /// ignores ink without tops, which is common, because strokes break off the block after a print was made.
    fn score(&self) -> f64 {
        self.found.score * self.overlap.moving_covered
    }
}

/// The best pose and its competitors. At most one of these poses is right.
#[derive(Debug, Clone, Copy)]
struct CompetingPoses {
    best: RefinedPose,
    /// Best pose at another angle, and best pose in mirror writing.
    other_angle: Option<RefinedPose>,
    mirrored: Option<RefinedPose>,
    /// Scores of both competitors divided by the score of the best pose.
    shares: [f64; 2],
}

impl CompetingPoses {
    /// Refines the first few upright poses and the best mirrored pose, and selects the best pose and its competitors.
    fn compare(images: &ScaledImages, search: &PoseSearch) -> Option<Self> {
        let strokes = images.strokes(&FEW_CUTS);
        let thresholds = SoftThresholds::new(FEW_CUTS, &images.ink, &strokes);
        let starts = search.poses.iter().take(TRIED).chain(&search.mirrored);
        let tried: Option<Vec<RefinedPose>> = starts
            .map(|start| refined_twice(&thresholds, start))
            .collect();
        let tried = tried?;
        let best = *best_of(&tried, |pose| !pose.found.mirrored)?;
        let elsewhere = |pose: &RefinedPose| {
            !pose.found.mirrored && pose.found.rotation_to(&best.found) > SAME_POSE_DEG
        };
        let other_angle = best_of(&tried, elsewhere).copied();
        let mirrored = best_of(&tried, |pose| pose.found.mirrored).copied();
        Some(Self {
            best,
            other_angle,
            mirrored,
            shares: [other_angle, mirrored].map(|rival| share(rival, &best)),
        })
    }

    /// Refines the best pose at a larger size. If a competitor's fraction exceeds `CLOSE`, refines both competitors
    /// too. If the competitor at another angle then scores higher, it becomes the best pose.
    fn sharpen(&mut self, thresholds: &SoftThresholds) -> Option<()> {
        let is_close = self.shares.iter().any(|share| *share > CLOSE);
        self.best = sharpened(thresholds, &self.best.found)?;
        if !is_close {
            return Some(());
        }
        let rivals = [&mut self.other_angle, &mut self.mirrored];
        for rival in rivals.into_iter().flatten() {
            *rival = sharpened(thresholds, &rival.found)?;
        }
        self.shares = self.fair_shares(thresholds);
        if let Some(other) = &mut self.other_angle
            && self.shares[0] > 1.0
        {
            std::mem::swap(&mut self.best, other);
            self.shares = self.fair_shares(thresholds);
        }
        Some(())
    }

    /// Computes the `fair_share` of each competitor, or 0 for a missing competitor. The mirrored pose wins only if it
    /// also wins on all pixels: a symmetric character scores about the same both ways, and damage decides on a part.
    fn fair_shares(&self, thresholds: &SoftThresholds) -> [f64; 2] {
        let fair = |rival: Option<RefinedPose>| {
            rival.map_or(0.0, |rival| fair_share(thresholds, &rival, &self.best))
        };
        let mirrored = fair(self.mirrored);
        let on_all_pixels = share(self.mirrored, &self.best);
        [fair(self.other_angle), mirrored.min(on_all_pixels.max(1.0))]
    }

    /// Returns the score of the best pose minus the score of its best competitor.
    fn margin(&self) -> f64 {
        let [other_angle, mirrored] = self.shares;
        self.best.score() * (1.0 - other_angle.max(mirrored))
    }

    /// Returns the evidence for and against the best pose.
    fn features(&self, spread: f64) -> PoseFeatures {
        let [other_angle, mirrored] = self.shares;
        PoseFeatures {
            correlation: self.best.found.score,
            tops_covered: self.best.overlap.moving_covered,
            ink_covered: self.best.overlap.fixed_covered,
            other_angle,
            mirrored,
            spread,
            // Measured when the thresholds are known.
            unmatched_tops: 0.0,
            unmatched_ink: 0.0,
            edge_scatter: 0.0,
            ink_area: 0.0,
        }
    }
}

/// Returns the score of a competitor divided by the score of the best pose, or 0 if there is no competitor.
fn share(rival: Option<RefinedPose>, best: &RefinedPose) -> f64 {
    rival.map_or(0.0, |rival| rival.score() / best.score().max(1e-6))
}

/// Returns the score of a competitor divided by the score of the best pose, both on the pixels that are valid for both
/// poses. If these pixels are few, the ratio may be too low by chance. The result is therefore at least the smaller of
/// `SYMMETRIC` and the ratio on all pixels.
fn fair_share(thresholds: &SoftThresholds, rival: &RefinedPose, best: &RefinedPose) -> f64 {
    let [score, fair] =
        thresholds.compare_on_common_area([best, rival].map(|pose| (pose.nearest, &pose.found)));
    (fair / score.max(1e-6)).max(share(Some(*rival), best).min(SYMMETRIC))
}

fn best_of(tried: &[RefinedPose], of_kind: impl Fn(&RefinedPose) -> bool) -> Option<&RefinedPose> {
    let among = tried.iter().filter(|pose| of_kind(pose));
    among.max_by(|a, b| a.score().total_cmp(&b.score()))
}

/// Print and relief at working size.
struct WorkingImages<'a> {
    ink: ImagePyramid,
    depths: ImagePyramid,
    params: &'a RegisterParams,
    /// Middle of the depth map, pixels.
    middle: [f64; 2],
    /// Least smoothing, see [`PrintMasks::pixel_sigma`].
    pixel_sigma: f64,
}

impl<'a> WorkingImages<'a> {
    fn new(depths: &SoftMask, print: &PrintMasks, params: &'a RegisterParams) -> Option<Self> {
        let px = params.working_px as usize;
        Some(Self {
            pixel_sigma: print.pixel_sigma(),
            ink: ImagePyramid::new(&print.soft_ink(), px)?,
            depths: ImagePyramid::new(depths, px)?,
            params,
            middle: [depths.known.width(), depths.known.height()].map(|side| side as f64 / 2.0),
        })
    }

    /// Scales print and relief to a fraction of the working size.
    fn at(&self, share: f64) -> ScaledImages<'_> {
        let px = (f64::from(self.params.working_px) * share).round() as usize;
        let sigma = (self.params.smoothing_px * share.sqrt()).max(self.pixel_sigma * px as f64);
        ScaledImages {
            ink: self.ink.level(px, sigma),
            depths: self.depths.level_builder(px, sigma),
        }
    }

    /// Refines a pose with the strokes of its threshold. Returns the refined pose and its spread, see
    /// [`Self::refine_at_three_sizes`]. Border strokes (walls, frame lines, neighbouring characters) are masked,
    /// because they may be cut off differently in print and relief. If they overlap well at the pose found without
    /// them, they are unmasked for the last refinement.
    fn refine_fully(&self, few: &ScaledImages, best: &RefinedPose) -> Option<(Affine2, f64)> {
        let strokes = few.stroke(best.cut);
        let both = [&few.ink, &strokes];
        let around = BorderStrokes::find(both, &best.found.fixed_from_moving)?;
        let [ink, strokes] = around.levels_without();
        let (closer, spread) =
            self.refine_at_three_sizes(&Refiner::new(&ink, &strokes), &best.found);
        let agree = BorderStrokes::find(both, &closer.fixed_from_moving)?.agree();
        let full = self.at(1.0);
        let strokes = full.stroke(best.cut);
        let both = [&full.ink, &strokes];
        let alone = if agree {
            None
        } else {
            Some(BorderStrokes::find(both, &closer.fixed_from_moving)?.levels_without())
        };
        let [ink, strokes] = alone.as_ref().map_or(both, |[ink, strokes]| [ink, strokes]);
        let refiner = Refiner::new(ink, strokes);
        let refined = refiner.refine(&closer, MOST_STEPS, Loss::Tukey);
        let last = if self.params.anisotropic_scale {
            with_anisotropic_scale(&refiner, &refined, self.middle)
        } else {
            refined
        };
        Some((last.fixed_from_moving, spread))
    }

    /// Refines a pose from three starts: the pose, a smaller one and a larger one. Returns the best result, and the
    /// spread: the largest distance between the best result and another result, see `apart`. If strokes are few or
    /// broken, a refinement stays near its start, and the spread is large.
    fn refine_at_three_sizes(
        &self,
        refiner: &Refiner,
        pose: &PoseCandidate,
    ) -> (PoseCandidate, f64) {
        let answer = |k: f64| {
            let [x, y] = pose.fixed_from_moving.apply(self.middle);
            let resize = Affine2::scale_shift(k, [x - k * x, y - k * y]);
            let start = PoseCandidate {
                fixed_from_moving: resize.after(&pose.fixed_from_moving),
                ..*pose
            };
            refiner.refine(&start, MOST_STEPS, Loss::Tukey)
        };
        let answers = [1.0, 1.0 / OTHER_SIZE, OTHER_SIZE].map(answer);
        let better = |a: PoseCandidate, b: PoseCandidate| if b.score > a.score { b } else { a };
        let best = answers.into_iter().fold(answers[0], better);
        let apart = answers.iter().map(|other| self.apart(&best, other));
        (best, apart.fold(0.0, f64::max))
    }

    /// Maps the depth map's corners by both poses. Returns the mean distance between the two images of a corner, as a
    /// fraction of the map's longest side.
    fn apart(&self, one: &PoseCandidate, other: &PoseCandidate) -> f64 {
        let [width, height] = self.middle.map(|middle| 2.0 * middle);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        let distance = |corner: [f64; 2]| {
            let [a, b] = [one, other].map(|pose| pose.fixed_from_moving.apply(corner));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        let side = width.max(height) * one.fixed_from_moving.scale();
        corners.map(distance).iter().sum::<f64>() / 4.0 / side.max(1e-9)
    }
}

/// Print and relief at one size.
struct ScaledImages<'a> {
    ink: PyramidLevel,
    depths: LevelBuilder<'a>,
}

impl ScaledImages<'_> {
    /// Computes the soft strokes of a threshold below the tops.
    fn stroke(&self, cut: f64) -> PyramidLevel {
        self.depths.mapped_level(|d| soft_stroke(d, cut, SOFTNESS))
    }

    fn strokes(&self, cuts: &[f64]) -> Vec<PyramidLevel> {
        cuts.iter().map(|cut| self.stroke(*cut)).collect()
    }
}

/// Refines a pose twice, each time with the threshold that fits best: first with Huber's loss for a distant start, then
/// with Tukey's loss for a close start.
fn refined_twice(thresholds: &SoftThresholds, start: &PoseCandidate) -> Option<RefinedPose> {
    let strokes = thresholds.best_at(start)?.strokes;
    sharpened(thresholds, &strokes.refine(start, FEW_STEPS, Loss::Huber))
}

/// Refines a nearly right pose, using the threshold that fits best.
fn sharpened(thresholds: &SoftThresholds, start: &PoseCandidate) -> Option<RefinedPose> {
    let strokes = thresholds.best_at(start)?.strokes;
    let pose = strokes.refine(start, FEW_STEPS, Loss::Tukey);
    let fitting = thresholds.best_at(&pose)?;
    Some(RefinedPose {
        found: fitting.found,
        overlap: fitting.strokes.overlap(&pose),
        cut: fitting.cut,
        nearest: fitting.nearest,
    })
}
