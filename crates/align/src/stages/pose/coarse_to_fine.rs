//! Coarse-to-fine pose search: exhaustive on the coarsest level, then Gauss-Newton refinement on finer levels.

use super::candidate::{BeamWidth, PoseCandidate, SearchRange, prune};
use super::search::{SEARCH_PX, search};
use super::{ImagePyramid, Loss, Refiner};

/// Sigma of the Gaussian that smooths the coarsest level, in working pixels.
const SEARCH_SIGMA: f64 = 0.5;

/// Parameters of a refinement pass. Size and smoothing of the levels are in working pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefinementPass {
    pub(crate) size_px: usize,
    pub(crate) sigma_px: f64,
    pub(crate) max_steps: usize,
    pub(crate) beam_width: BeamWidth,
}

impl RefinementPass {
    /// Returns the pass with a least smoothing, as a fraction of the level's size.
    pub(crate) fn smoothed(self, least: f64) -> Self {
        Self {
            sigma_px: self.sigma_px.max(least * self.size_px as f64),
            ..self
        }
    }
}

/// Searches for poses of the moving image on the fixed image. Returns upright and mirrored candidates, best first.
pub(crate) fn search_coarse_to_fine(
    fixed: &ImagePyramid,
    moving: &ImagePyramid,
    range: SearchRange,
    passes: &[RefinementPass],
) -> Vec<PoseCandidate> {
    let levels = |px, sigma| (fixed.level(px, sigma), moving.level(px, sigma));
    let (a, b) = levels(SEARCH_PX, SEARCH_SIGMA);
    let mut found = search(&a, &b, range);
    for pass in passes {
        let (a, b) = levels(pass.size_px, pass.sigma_px);
        let refiner = Refiner::new(&a, &b);
        for pose in &mut found {
            *pose = refiner.refine(pose, pass.max_steps, Loss::Huber);
        }
        let rank = |pose: &PoseCandidate| (pose.score, pose.mirrored);
        found = prune(found, pass.beam_width, rank, PoseCandidate::is_near);
    }
    found
}
