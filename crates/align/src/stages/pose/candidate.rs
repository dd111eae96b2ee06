//! Candidate poses, the range that is searched, and the beam width.

use mocban_core::domain::Affine2;

/// Refined poses are duplicates only if their rotations differ by less than this, in degrees.
const NEAR_DEG: f64 = 3.0;
/// Refined poses are duplicates only if the natural logarithms of their scales differ by less than this.
const NEAR_RATIO: f64 = 0.04;

/// Numbers of upright and of mirrored candidates to keep. If a number is 0, no such poses are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BeamWidth {
    /// Without reflection.
    pub(crate) upright: usize,
    /// With the moving image mirrored.
    pub(crate) mirrored: usize,
}

impl BeamWidth {
    /// Returns the number of mirrored or of upright candidates to keep.
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
    /// Largest scale between the two levels. The smallest is its inverse.
    pub(crate) max_scale: f64,
    /// Candidates to keep after the search.
    pub(crate) beam_width: BeamWidth,
}

/// A candidate pose with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseCandidate {
    /// Maps moving image pixels to fixed image pixels. The map contains a reflection if `mirrored` is set.
    pub(crate) fixed_from_moving: Affine2,
    /// Normalised correlation of the high-pass filtered images where both are known. It is at most about 1.
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

    /// Returns whether two poses are both upright or both mirrored, and have nearly equal rotations and scales.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        let scale = |pose: &Self| pose.fixed_from_moving.scale();
        let ratio = (scale(self) / scale(other)).ln().abs();
        self.mirrored == other.mirrored && self.rotation_to(other) < NEAR_DEG && ratio < NEAR_RATIO
    }
}

/// Returns the best upright and the best mirrored poses, best first and without duplicates. `rank` returns the score of
/// a pose and whether the pose is mirrored.
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
