//! Fits different scales along two perpendicular axes, as far as the print shows them: sheets shrink by 1 to 4 % across
//! their grain, and a photograph taken at an angle is foreshortened.

use crate::stages::pose::{Loss, PoseCandidate, Refiner};
use mocban_core::domain::Affine2;

/// Largest number of rounds of scaling and refining.
const MAX_ROUNDS: usize = 6;
/// Number of steps of the refinement in each round.
const STEPS: usize = 6;
/// The score is computed at the current scale, and at scales larger and smaller by this fraction.
const TRIED: f64 = 0.008;
/// Largest relative change of scale in one round, along the axes and along the diagonals.
const MOST: f64 = 0.016;
/// If the first round finds a smaller change, the pose keeps one scale, which saves time. Such a change moves no landmark
/// by more than 0.3 % of the character's height.
const EVIDENT: f64 = 0.004;
/// Least fraction by which the anisotropic scale must bring the correlation closer to 1. On generated pairs, 2 of 48
/// damaged ones exceeded it, and most sheets that shrank and photographs exceeded 0.06.
const LEAST_GAIN: f64 = 0.03;
/// The search ends after a round with a smaller change.
const CONVERGED: f64 = 0.001;

/// Returns the pose with the anisotropic scale that fits best, or `pose` if there is no evidence for such a scale. Tries
/// scales along the axes and along the diagonals. Together, they produce a scale along any two perpendicular directions.
///
/// `middle` is the centre of the scaling, in pixels of the moving image. The score of `pose` must come from `refiner`.
pub(super) fn with_anisotropic_scale(
    refiner: &Refiner,
    pose: &PoseCandidate,
    middle: [f64; 2],
) -> PoseCandidate {
    let mut best = *pose;
    for round in 0..MAX_ROUNDS {
        let (stretched, change) = best_stretch(refiner, &best, middle);
        if round == 0 && change < EVIDENT {
            return *pose;
        }
        best = refiner.refine(&stretched, STEPS, Loss::Tukey);
        if change < CONVERGED {
            break;
        }
    }
    let gain = (best.score - pose.score) / (1.0 - pose.score).max(1e-6);
    if gain > LEAST_GAIN { best } else { *pose }
}

/// Returns a pose with the anisotropic scale at the maximum of the score, and the change of scale.
fn best_stretch(refiner: &Refiner, pose: &PoseCandidate, middle: [f64; 2]) -> (PoseCandidate, f64) {
    let mut best = *pose;
    let changes = [[1.0, 0.0], [0.0, 1.0]].map(|along| {
        let by = |amount: f64| stretch(&best, middle, along.map(|share| share * amount));
        let score = |amount: f64| refiner.evaluate(&by(amount)).score;
        let change = summit(score(-TRIED), score(0.0), score(TRIED)) * TRIED;
        best = by(change);
        change
    });
    (best, changes[0].hypot(changes[1]))
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
    use super::{MOST, TRIED, summit};

    #[test]
    fn summit_is_the_maximum_of_the_parabola_within_the_limits() {
        let at = |x: f64| 3.0 - (x - 0.4).powi(2);
        assert!((summit(at(-1.0), at(0.0), at(1.0)) - 0.4).abs() < 1e-9);
        assert_eq!(summit(0.0, 0.1, 0.9), 0.0);
        assert_eq!(summit(0.0, 1.0, 1.9), MOST / TRIED);
    }
}
