//! Candidate poses, the range that is searched, and the beam width.

use crate::domain::Affine2;

/// Two refined poses are duplicates if they differ by less than `NEAR_DEG` degrees in rotation and by less than
/// `NEAR_RATIO` in the natural logarithm of the scale.
const NEAR_DEG: f64 = 3.0;
const NEAR_RATIO: f64 = 0.04;

/// Number of candidates to keep for each reading: upright or mirrored. A reading with zero candidates is not searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BeamWidth {
    /// Without reflection.
    pub(crate) upright: usize,
    /// With the moving image mirrored.
    pub(crate) mirrored: usize,
}

impl BeamWidth {
    /// Returns the number to keep for one reading.
    pub(super) const fn of_reading(self, mirrored: bool) -> usize {
        if mirrored {
            self.mirrored
        } else {
            self.upright
        }
    }
}

/// The range of poses to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchRange {
    /// Largest ratio between the two sizes, up or down.
    pub(crate) max_scale: f64,
    /// Candidates to keep after the search.
    pub(crate) beam_width: BeamWidth,
}

/// A candidate pose with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseCandidate {
    /// Maps moving image pixels to fixed image pixels. Contains a reflection if `mirrored` is set.
    pub(crate) fixed_from_moving: Affine2,
    /// Correlation of the two images where both are known, normalised by the energy of each image; at most 1.
    pub(crate) score: f64,
    /// Whether the moving image is mirrored.
    pub(crate) mirrored: bool,
}

impl PoseCandidate {
    /// Returns the absolute rotation between two poses, degrees in 0..=180.
    pub(crate) fn rotation_to(&self, other: &Self) -> f64 {
        let angle = |pose: &Self| pose.fixed_from_moving.angle_deg();
        let turn = (angle(self) - angle(other)).rem_euclid(360.0);
        turn.min(360.0 - turn)
    }

    /// Returns whether two poses have the same reading and nearly equal rotation and scale. Ignores the shift.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        let scale = |pose: &Self| pose.fixed_from_moving.scale();
        let ratio = (scale(self) / scale(other)).ln().abs();
        self.mirrored == other.mirrored && self.rotation_to(other) < NEAR_DEG && ratio < NEAR_RATIO
    }
}

/// Returns the best poses of each reading (upright or mirrored), best first and without duplicates. `rank` returns the
/// score of a pose and whether the pose is mirrored.
pub(super) fn prune<T: Copy>(
    mut found: Vec<T>,
    beam_width: BeamWidth,
    rank: impl Fn(&T) -> (f64, bool),
    is_duplicate: impl Fn(&T, &T) -> bool,
) -> Vec<T> {
    found.sort_by(|a, b| rank(b).0.total_cmp(&rank(a).0));
    let mut accepted: Vec<T> = Vec::new();
    for pose in found {
        let (_, mirrored) = rank(&pose);
        let same_reading = accepted.iter().filter(|other| rank(other).1 == mirrored);
        if same_reading.count() < beam_width.of_reading(mirrored)
            && !accepted.iter().any(|other| is_duplicate(&pose, other))
        {
            accepted.push(pose);
        }
    }
    accepted
}
