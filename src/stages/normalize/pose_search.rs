//! Our method: the pose first, from soft relief and soft ink; thresholds afterwards, in the aligned frame.

use super::Search;
use super::params::{NormalizeError, NormalizeParams};
use super::relief::Relief;
use super::relief::soft_stroke;
use super::threshold::{self, Canvas};
use crate::domain::{Affine2, Pose, ThresholdChoice};
use crate::raster::DepthMap;
use crate::stages::binarize::InkMask;
use crate::stages::pose::{
    BeamWidth, ImagePyramid, PoseCandidate, RefinementPass, SearchRange, SoftMask,
    search_coarse_to_fine,
};

/// The passes that follow the search.
const PASSES: [RefinementPass; 2] = [
    RefinementPass {
        size_px: 36,
        sigma_px: 0.8,
        max_steps: 7,
        beam_width: keep(4, 2),
    },
    RefinementPass {
        size_px: 60,
        sigma_px: 1.0,
        max_steps: 6,
        beam_width: keep(3, 1),
    },
];

const fn keep(upright: usize, mirrored: usize) -> BeamWidth {
    BeamWidth { upright, mirrored }
}
/// Working size of print and relief.
const BASE_PX: usize = 72;
/// The search looks at relief that fades out from the tops to half-way down: it need not know the right cut, nor
/// that the plane is quite right.
const SEARCH_CUT: f64 = 0.25;
const SEARCH_SOFTNESS: f64 = 0.5;
/// Poses that the search hands on.
const KEEP: BeamWidth = keep(9, 3);
/// A relief that correlates less than this matches nothing.
const LEAST_SCORE: f64 = 0.12;
/// Mirrored must win by this factor before the pair is refused: symmetric characters score alike both ways.
const MIRROR_WINS: f64 = 1.3;
/// A scale whose logarithm is this close to the band's end is at the bound.
const BOUND: f64 = 0.02;

/// Finds the poses of the reading of the print that the relief agrees with best.
pub(super) fn search(
    depth: &DepthMap,
    relief: &Relief,
    hypotheses: Vec<InkMask>,
    params: &NormalizeParams,
) -> Result<(InkMask, Search), NormalizeError> {
    let depths = relief.depths(depth);
    let mut best: Option<(InkMask, Search)> = None;
    // Which failure is told: that of the likelier reading, which comes first.
    let mut failure = None;
    for ink in hypotheses {
        match find_poses(&depths, &ink, params) {
            Ok(search) => {
                let score = |(_, search): &(InkMask, Search)| search.score();
                if best.as_ref().map(score).is_none_or(|s| search.score() > s) {
                    best = Some((ink, search));
                }
            }
            Err(error) => {
                failure.get_or_insert(error);
            }
        }
    }
    best.ok_or(failure.unwrap_or(NormalizeError::NoStrokes))
}

/// Chooses the thresholds at the best pose.
pub(super) fn thresholds(
    depth: &DepthMap,
    relief: &Relief,
    print: &InkMask,
    canvas_from_print: &Affine2,
    search: &Search,
    params: &NormalizeParams,
) -> Result<Vec<ThresholdChoice>, NormalizeError> {
    let best = search.poses.first().ok_or(NormalizeError::NoMatch {
        best: 0.0,
        needs: LEAST_SCORE,
    })?;
    let canvas = Canvas::new(
        depth,
        print,
        canvas_from_print,
        &best.print_from_depth,
        params,
    );
    threshold::choose(depth, relief, &canvas, params)
}

/// Poses as read, best first, at least one.
fn find_poses(
    depths: &SoftMask,
    print: &InkMask,
    params: &NormalizeParams,
) -> Result<Search, NormalizeError> {
    let (ink, wood) = ImagePyramid::new(&print.soft, BASE_PX)
        .zip(ImagePyramid::new(depths, BASE_PX))
        .ok_or(NormalizeError::NoStrokes)?;
    let wood = wood.map(|d| soft_stroke(d, SEARCH_CUT, SEARCH_SOFTNESS));
    let limits = SearchRange {
        max_scale: params.scale_band,
        beam_width: KEEP,
    };
    let found = search_coarse_to_fine(&ink, &wood, limits, &PASSES);
    let ratio = |pose: &PoseCandidate| {
        let (ink, wood) = (longest(&print.soft), longest(depths));
        pose.fixed_from_moving.scale() * wood / ink
    };
    judge(&found, |pose| {
        let ratio = ratio(pose);
        params.scale_band > 1.0 && ratio.ln().abs() > params.scale_band.ln() - BOUND
    })
}

/// Longest side of what a soft picture knows, pixels.
fn longest(soft: &SoftMask) -> f64 {
    soft.bounds()
        .map_or(1.0, |b| b.width().max(b.height()) as f64)
}

/// Refuses mirror writing and relief that matches nothing.
fn judge(
    found: &[PoseCandidate],
    at_bound: impl Fn(&PoseCandidate) -> bool,
) -> Result<Search, NormalizeError> {
    let best = |mirrored: bool| {
        let of_kind = found.iter().filter(|pose| pose.mirrored == mirrored);
        of_kind.map(|pose| pose.score).fold(0.0, f64::max)
    };
    let (upright, mirrored) = (best(false), best(true));
    if mirrored > upright * MIRROR_WINS && mirrored > LEAST_SCORE {
        return Err(NormalizeError::Mirrored { mirrored, upright });
    }
    if upright < LEAST_SCORE {
        return Err(NormalizeError::NoMatch {
            best: upright,
            needs: LEAST_SCORE,
        });
    }
    let upright = || found.iter().filter(|pose| !pose.mirrored);
    let pose = |found: &PoseCandidate| Pose {
        print_from_depth: found.fixed_from_moving,
        score: found.score,
    };
    Ok(Search {
        poses: upright().map(pose).collect(),
        mirrored: found.iter().find(|found| found.mirrored).map(pose),
        at_bound: upright().next().is_some_and(at_bound),
    })
}
