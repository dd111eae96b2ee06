//! The last few parts in a thousand: relief stretched along one axis, as paper shrinks across its grain.

use crate::domain::Affine2;
use crate::stages::pose::{Loss, PoseCandidate, Refiner};

/// Rounds of stretching and refining; each is a fraction of the last.
const ROUNDS: usize = 2;
/// Steps of a refinement between two rounds.
const STEPS: usize = 6;
/// Stretch that is tried to either side, and the most that a round takes.
const TRIED: f64 = 0.008;
const MOST: f64 = 0.012;

/// The pose with the stretch that fits best, in two directions that make any: along an axis, and along a diagonal.
///
/// `middle` is that of the relief, in the moving image's pixels; the pose's score is the refiner's.
pub(super) fn stretched(
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

/// Place of the top of a parabola through values at -1, 0 and 1, within the most that a round takes.
fn summit(before: f64, at: f64, after: f64) -> f64 {
    let bend = before - 2.0 * at + after;
    if bend >= 0.0 {
        return 0.0;
    }
    (0.5 * (before - after) / bend).clamp(-MOST / TRIED, MOST / TRIED)
}

/// Stretches about the middle by `1 + e` along x and `1 - e` along y, and likewise along the diagonals, so that areas
/// hardly change.
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
    fn summit_is_the_top_of_the_parabola_within_reach() {
        let at = |x: f64| 3.0 - (x - 0.4).powi(2);
        assert!((summit(at(-1.0), at(0.0), at(1.0)) - 0.4).abs() < 1e-9);
        assert_eq!(summit(0.0, 0.1, 0.9), 0.0);
        assert_eq!(summit(0.0, 1.0, 1.9), 1.5);
    }
}
