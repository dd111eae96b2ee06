//! The relief's strokes at several cuts, and the one between them that fits the print's.

use crate::stages::pose::{Found, Layer, Refiner};

/// Cuts under the tops that are tried, as shares of the relief. The ink of a print spreads; strokes cut too thin or
/// too thick for it would pull the scale.
pub(super) const CUTS: [f64; 5] = [0.05, 0.11, 0.2, 0.32, 0.47];

/// Cuts that are tried while poses are compared.
pub(super) const FEW_CUTS: [f64; 3] = [0.08, 0.2, 0.4];

/// The strokes of each cut, the shallowest first, ready to be laid on the print's ink.
pub(super) struct Cuts<'a> {
    refiners: Vec<Refiner<'a>>,
}

impl<'a> Cuts<'a> {
    /// Of one layer a cut.
    pub(super) fn new(ink: &'a Layer, woods: &'a [Layer]) -> Self {
        Self {
            refiners: woods.iter().map(|wood| Refiner::new(ink, wood)).collect(),
        }
    }

    /// The strokes that fit best at a pose, and the pose with its score there.
    pub(super) fn fitting(&self, pose: &Found) -> Option<(&Refiner<'a>, Found)> {
        let judged = self.refiners.iter().map(|wood| (wood, wood.judged(pose)));
        judged.max_by(|a, b| a.1.score.total_cmp(&b.1.score))
    }

    /// The cut that fits best at a pose, between those that were tried: a choice between cuts that fit alike would
    /// make the answer jump.
    pub(super) fn best_cut(&self, pose: &Found) -> f64 {
        let score = |wood: &Refiner| wood.judged(pose).score;
        let scores: Vec<f64> = self.refiners.iter().map(score).collect();
        let at = summit(&scores);
        let cut = |k: usize| CUTS[k.min(CUTS.len() - 1)];
        let first = at as usize;
        cut(first) + at.fract() * (cut(first + 1) - cut(first))
    }
}

/// Place of the highest value, by a parabola through it and its neighbours, in steps from the first.
fn summit(values: &[f64]) -> f64 {
    let highest = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    let best = (0..values.len()).max_by(highest).unwrap_or(0);
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
    use super::summit;

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
