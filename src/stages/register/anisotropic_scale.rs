//! Fits different scales along two perpendicular axes, because a sheet shrinks by about 1 % across its grain.

use crate::domain::Affine2;
use crate::stages::pose::{Loss, PoseCandidate, Refiner};

/// Number of rounds of scaling and refining.
const ROUNDS: usize = 2;
/// Maximum number of steps of the refinement in each round.
const STEPS: usize = 6;
/// The score is computed at the current scale, and at scales larger and smaller by this share.
const TRIED: f64 = 0.008;
/// Largest relative change of scale in one round, along the axes and along the diagonals.
const MOST: f64 = 0.012;

/// Returns the pose with the anisotropic scale that fits best, or `pose` if no scale improves the score. Tries scales
/// along the axes and along the diagonals. Together, they produce a scale along any two perpendicular directions.
///
/// `middle` is the centre of the scaling, in pixels of the moving image. The score of `pose` must come from `refiner`.
pub(super) fn with_anisotropic_scale(
    refiner: &Refiner,
    pose: &PoseCandidate,
    middle: [f64; 2],
) -> PoseCandidate {
    let mut best = *pose;
    for _ in 0..ROUNDS {
        let mut is_judged = true;
        for along in [[1.0, 0.0], [0.0, 1.0]] {
            let by = |amount: f64| stretch(&best, middle, along.map(|share| share * amount));
            let score = |amount: f64| refiner.evaluate(&by(amount)).score;
            let at = if is_judged { best.score } else { score(0.0) };
            best = by(summit(score(-TRIED), at, score(TRIED)) * TRIED);
            is_judged = false;
        }
        best = refiner.refine(&best, STEPS, Loss::Tukey);
    }
    if best.score > pose.score { best } else { *pose }
}

/// Returns the position of the maximum of the parabola through the values at -1, 0 and 1, clamped to `MOST / TRIED` on
/// either side. Returns 0 if the parabola has no maximum.
fn summit(before: f64, at: f64, after: f64) -> f64 {
    let bend = before - 2.0 * at + after;
    if bend >= 0.0 {
        return 0.0;
    }
    (0.5 * (before - after) / bend).clamp(-MOST / TRIED, MOST / TRIED)
}

/// Applies an anisotropic scale about `middle` after a pose. The factors are `1 + e` along x, `1 - e` along y, and
/// `1 + f` and `1 - f` along the two diagonals.
fn stretch(pose: &PoseCandidate, middle: [f64; 2], [e, f]: [f64; 2]) -> PoseCandidate {
    let [x, y] = pose.fixed_from_moving.apply(middle);
    let about = Affine2([[1.0 + e, f, -e * x - f * y], [f, 1.0 - e, e * y - f * x]]);
    PoseCandidate {
        fixed_from_moving: about.after(&pose.fixed_from_moving),
        ..*pose
    }
}

#[cfg(test)]
mod tests {
    use super::summit;

    #[test]
    fn summit_is_the_maximum_of_the_parabola_within_the_limits() {
        let at = |x: f64| 3.0 - (x - 0.4).powi(2);
        assert!((summit(at(-1.0), at(0.0), at(1.0)) - 0.4).abs() < 1e-9);
        assert_eq!(summit(0.0, 0.1, 0.9), 0.0);
        assert_eq!(summit(0.0, 1.0, 1.9), 1.5);
    }
}
