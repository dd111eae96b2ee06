//! Refines poses on pictures that were scaled unequally along their sides.

use crate::stages::pose::{ImagePyramid, Loss, PoseCandidate, RefinementPass, Refiner};
use mocban_core::domain::Affine2;

/// Scales along the rows of the print relative to those along its columns that are tried, if no pose fits well: a picture
/// may have been scaled unequally.
const ASPECTS: [f64; 4] = [1.16, 1.32, 1.0 / 1.16, 1.0 / 1.32];
/// Unequal scales are used if they bring the best upright score closer to 1 by at least this fraction.
const LEAST_GAIN: f64 = 0.4;
/// Whether unequal scales gain enough is decided without starts that score less than this fraction of the needed score.
/// On generated pairs, starts that reached the needed score had at least 0.66 of it.
const PROMISING: f64 = 0.55;

/// Replaces each pose by the best of those with unequal scales that are refined from it, if the best upright pose gains
/// much by this. `middle` is the centre of the scaling, in pixels of the depth map.
pub(super) fn stretch(
    found: &mut [PoseCandidate],
    print: &ImagePyramid,
    wood: &ImagePyramid,
    middle: [f64; 2],
    pass: RefinementPass,
) {
    let (size, sigma) = (pass.size_px, pass.sigma_px);
    let (fixed, moving) = (print.level(size, sigma), wood.level(size, sigma));
    let refiner = Refiner::new(&fixed, &moving);
    let start = |pose: &PoseCandidate, aspect: f64| {
        let [x, y] = pose.fixed_from_moving.apply(middle);
        let [across, down] = [aspect.sqrt(), 1.0 / aspect.sqrt()];
        let about = Affine2([[across, 0.0, x - across * x], [0.0, down, y - down * y]]);
        PoseCandidate {
            fixed_from_moving: about.after(&pose.fixed_from_moving),
            ..*pose
        }
    };
    let refined = |start: &PoseCandidate| refiner.refine(start, pass.max_steps, Loss::Huber);
    let upright = |poses: &[PoseCandidate]| best_score(poses.iter().filter(|pose| !pose.mirrored));
    let before = upright(found);
    let needed = before + LEAST_GAIN * (1.0 - before);
    // Nearly all pairs gain nothing. Most starts are far from any match, which their score shows without a refinement.
    let gains = |pose: &PoseCandidate| {
        let mut starts = ASPECTS.iter().map(|aspect| start(pose, *aspect));
        starts.any(|start| {
            let is_promising = refiner.evaluate(&start).score >= PROMISING * needed;
            is_promising && refined(&start).score >= needed
        })
    };
    if !found.iter().any(|pose| !pose.mirrored && gains(pose)) {
        return;
    }
    let stretched = found.iter().map(|pose| {
        let poses = ASPECTS.iter().map(|aspect| refined(&start(pose, *aspect)));
        poses.fold(*pose, |best, other| {
            if other.score > best.score {
                other
            } else {
                best
            }
        })
    });
    let mut stretched: Vec<PoseCandidate> = stretched.collect();
    stretched.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.copy_from_slice(&stretched);
}

/// Returns the best score of some poses, 0 if there is none.
pub(super) fn best_score<'a>(poses: impl IntoIterator<Item = &'a PoseCandidate>) -> f64 {
    let scores = poses.into_iter().map(|pose| pose.score);
    scores.fold(0.0, f64::max)
}
