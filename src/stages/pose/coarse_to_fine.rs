//! The search for a pose from coarse to fine: every angle and scale at little size, the best few closer and closer.

use super::search::{BeamWidth, PoseCandidate, SEARCH_PX, SearchRange, search};
use super::{ImagePyramid, Loss, Refiner};

/// Smoothing of the search's layers, working pixels.
const SEARCH_SIGMA: f64 = 0.5;

/// One pass after the search: working size, smoothing, steps, and how many poses go on.
#[derive(Debug, Clone, Copy)]
pub(in crate::stages) struct RefinementPass {
    pub(in crate::stages) size_px: usize,
    pub(in crate::stages) sigma_px: f64,
    pub(in crate::stages) max_steps: usize,
    pub(in crate::stages) beam_width: BeamWidth,
}

/// The best poses of the moving picture on the fixed one, as read and mirrored, best first.
pub(in crate::stages) fn search_coarse_to_fine(
    fixed: &ImagePyramid,
    moving: &ImagePyramid,
    limits: SearchRange,
    passes: &[RefinementPass],
) -> Vec<PoseCandidate> {
    let layers = |px, sigma| (fixed.layer(px, sigma), moving.layer(px, sigma));
    let (a, b) = layers(SEARCH_PX, SEARCH_SIGMA);
    let mut found = search(&a, &b, limits);
    for pass in passes {
        let (a, b) = layers(pass.size_px, pass.sigma_px);
        let refiner = Refiner::new(&a, &b);
        for pose in &mut found {
            *pose = refiner.refine(pose, pass.max_steps, Loss::Huber);
        }
        found = best_of_each(found, pass.beam_width);
    }
    found
}

/// The best few of each reading, best first, none of them twice.
fn best_of_each(mut found: Vec<PoseCandidate>, keep: BeamWidth) -> Vec<PoseCandidate> {
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<PoseCandidate> = Vec::new();
    for pose in found {
        let of_kind = kept.iter().filter(|k| k.mirrored == pose.mirrored).count();
        let room = keep.of(pose.mirrored);
        if of_kind < room && !kept.iter().any(|other| other.is_near(&pose)) {
            kept.push(pose);
        }
    }
    kept
}
