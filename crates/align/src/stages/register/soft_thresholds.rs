//! Soft strokes of the relief at several thresholds, and the search for the threshold that fits the print best.

use crate::stages::pose::{PoseCandidate, PyramidLevel, Refiner};

/// Thresholds to try: depths below the tops, as fractions of the relief's depth. Several are tried, because a print's
/// ink spread is unknown, and strokes thinner or thicker than the ink would bias the scale.
const CUTS: [f64; 5] = [0.05, 0.11, 0.2, 0.32, 0.47];
/// Number of thresholds that are tried around an approximate one.
const NEAR: usize = 3;

/// Thresholds that are tried while poses are compared.
pub(super) const FEW_CUTS: [f64; NEAR] = [0.08, 0.2, 0.4];

/// Returns the thresholds of `CUTS` that are nearest to `cut`.
pub(super) fn cuts_near(cut: f64) -> [f64; NEAR] {
    let cut = cut.max(f64::MIN_POSITIVE);
    let far = |at: usize| (CUTS[at + NEAR / 2] / cut).ln().abs();
    let nearest = |a: &usize, b: &usize| far(*a).total_cmp(&far(*b));
    let first = (0..=CUTS.len() - NEAR).min_by(nearest).unwrap_or(0);
    std::array::from_fn(|k| CUTS[first + k])
}

/// One refiner for each threshold, the shallowest first. It aligns the strokes at the threshold with the print's ink.
pub(super) struct SoftThresholds<'a> {
    cuts: [f64; NEAR],
    refiners: Vec<Refiner<'a>>,
}

/// The threshold whose strokes fit best at a pose.
pub(super) struct BestThreshold<'a, 'b> {
    /// Its strokes, ready to be refined against the ink.
    pub(super) strokes: &'b Refiner<'a>,
    /// The pose with its score.
    pub(super) found: PoseCandidate,
    /// Best threshold, interpolated between the tried thresholds so that it changes continuously with the pose.
    pub(super) cut: f64,
    /// Index of the tried threshold with the highest score.
    pub(super) nearest: usize,
}

impl<'a> SoftThresholds<'a> {
    /// Prepares one level of strokes for each threshold.
    pub(super) fn new(
        cuts: [f64; NEAR],
        ink: &'a PyramidLevel,
        strokes: &'a [PyramidLevel],
    ) -> Self {
        Self {
            cuts,
            refiners: Refiner::for_levels(ink, strokes),
        }
    }

    /// Finds the threshold that fits best at a pose.
    pub(super) fn best_at<'b>(&'b self, pose: &PoseCandidate) -> Option<BestThreshold<'a, 'b>> {
        let scores = Refiner::scores(self.refiners.first_chunk::<NEAR>()?, pose);
        let best = highest(&scores);
        let at = summit(&scores);
        let cut = |k: usize| self.cuts[k.min(self.cuts.len() - 1)];
        let first = at as usize;
        Some(BestThreshold {
            strokes: self.refiners.get(best)?,
            found: PoseCandidate {
                score: scores[best],
                ..*pose
            },
            cut: cut(first) + at.fract() * (cut(first + 1) - cut(first)),
            nearest: best,
        })
    }

    /// Scores two poses, each given with the index of its threshold, on the pixels that are valid for both poses.
    pub(super) fn compare_on_common_area(
        &self,
        [one, two]: [(usize, &PoseCandidate); 2],
    ) -> [f64; 2] {
        self.refiners[one.0].tiebreak_scores(one.1, &self.refiners[two.0], two.1)
    }
}

/// Returns the index of the highest value.
fn highest(values: &[f64]) -> usize {
    let order = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    (0..values.len()).max_by(order).unwrap_or(0)
}

/// Returns the maximum's position as a fractional index, from a parabola through the highest value and its neighbours.
fn summit(values: &[f64]) -> f64 {
    let best = highest(values);
    let last = values.len().saturating_sub(1);
    let middle = best.clamp(1, last.saturating_sub(1).max(1));
    let Some([a, b, c]) = values.get(middle - 1..middle + 2) else {
        return best as f64;
    };
    let bend = a - 2.0 * b + c;
    if bend >= 0.0 {
        return best as f64;
    }
    (middle as f64 + 0.5 * (a - c) / bend).clamp(0.0, last as f64)
}

#[cfg(test)]
mod tests {
    use super::{CUTS, cuts_near, summit};

    #[test]
    fn thresholds_near_one_lie_around_it() {
        assert_eq!(cuts_near(0.01), CUTS[..3]);
        assert_eq!(cuts_near(0.2), CUTS[1..4]);
        assert_eq!(cuts_near(0.4), CUTS[2..]);
    }

    #[test]
    fn summit_lies_between_the_values_and_does_not_jump() {
        let parabola: Vec<f64> = (0..6).map(|k| -(f64::from(k) - 2.3).powi(2)).collect();
        assert!((summit(&parabola) - 2.3).abs() < 1e-9);
        for scores in [
            [0.1, 0.5, 0.5, 0.2],
            [0.5, 0.5, 0.3, 0.1],
            [0.0, 0.1, 0.5, 0.5],
        ] {
            let nudged = |by: f64| {
                let mut other = scores;
                let k = other.iter().position(|s| *s == 0.5).expect("a tie");
                other[k] += by;
                summit(&other)
            };
            assert!((nudged(1e-9) - nudged(-1e-9)).abs() < 1e-6, "{scores:?}");
        }
        assert_eq!(summit(&[0.3, 0.2, 0.1, 0.0]), 0.0);
        assert_eq!(summit(&[0.4]), 0.0);
    }
}
