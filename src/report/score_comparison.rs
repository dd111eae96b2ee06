//! Metrics against each other by their scores on the same pairs.

use serde::Serialize;

use super::comparison::{LEVEL, after_holm};
use super::score::Score;
use super::score_bootstrap::ResamplingUnit;
use crate::domain::ThresholdMetric;

/// A score's mean difference between two metrics, and what drawing anew says of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Difference {
    pub(super) score: Score,
    pub(super) a: ThresholdMetric,
    pub(super) b: ThresholdMetric,
    pub(super) n: u64,
    pub(super) mean: f64,
    pub(super) ci95: Option<[f64; 2]>,
    pub(super) p: Option<f64>,
}

/// Two metrics by one score on the same pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreComparison {
    /// Which score.
    pub score: Score,
    /// The first metric.
    pub a: ThresholdMetric,
    /// The second.
    pub b: ThresholdMetric,
    /// Pairs with results of both.
    pub n: u64,
    /// Mean of the first less mean of the second.
    pub difference: f64,
    /// The 95 % interval of it; `None` where there are too few units.
    pub ci95: Option<[f64; 2]>,
    /// Name of the test that gave interval and `p`.
    pub test: &'static str,
    /// Its two-sided p; `None` as the interval.
    pub p: Option<f64>,
    /// The same after Holm's correction over the comparisons by this score.
    pub p_holm: Option<f64>,
    /// What follows, in words.
    pub words: String,
}

/// Name of the test, with what makes it that one.
const TEST: &str = "paired bootstrap, percentile, two-sided";

/// The comparisons that follow, Holm's correction done for each score by itself.
pub(super) fn compared(found: &[Difference], by: ResamplingUnit) -> Vec<ScoreComparison> {
    let of_one_score = found.chunk_by(|a, b| a.score == b.score);
    of_one_score
        .flat_map(|family| {
            let ps: Vec<Option<f64>> = family.iter().map(|one| one.p).collect();
            let corrected = after_holm(&ps);
            let both = family.iter().zip(corrected);
            both.map(|(one, p_holm)| one.finish(p_holm, by))
                .collect::<Vec<_>>()
        })
        .collect()
}

impl Difference {
    fn finish(&self, p_holm: Option<f64>, by: ResamplingUnit) -> ScoreComparison {
        ScoreComparison {
            score: self.score,
            a: self.a,
            b: self.b,
            n: self.n,
            difference: self.mean,
            ci95: self.ci95,
            test: TEST,
            p: self.p,
            p_holm,
            words: self.words(self.p.zip(p_holm), by),
        }
    }

    fn words(&self, p: Option<(f64, f64)>, by: ResamplingUnit) -> String {
        let higher = if self.mean > 0.0 { self.a } else { self.b }.title();
        match p {
            None => format!("too few {} to tell", by.plural()),
            Some(_) if self.ci95 == Some([0.0; 2]) => "the same on all pairs".to_owned(),
            Some((_, p_holm)) if p_holm < LEVEL => format!("{higher} is higher"),
            Some((p, _)) if p < LEVEL => {
                format!("{higher} looks higher, but not after correction for several comparisons")
            }
            Some(_) => "cannot tell them apart".to_owned(),
        }
    }
}

/// What follows for every two metrics, the scores of the same words together, such as
/// `Ensemble v. Relief: Ensemble is higher (SSIM, IoU); cannot tell them apart (Dice)`.
pub(super) fn in_words(found: &[ScoreComparison]) -> Vec<String> {
    let mut pairs: Vec<(ThresholdMetric, ThresholdMetric)> = Vec::new();
    for one in found {
        if !pairs.contains(&(one.a, one.b)) {
            pairs.push((one.a, one.b));
        }
    }
    pairs
        .into_iter()
        .map(|(a, b)| {
            let mut said: Vec<(&str, Vec<&str>)> = Vec::new();
            for one in found.iter().filter(|one| (one.a, one.b) == (a, b)) {
                match said.iter_mut().find(|(words, _)| *words == one.words) {
                    Some((_, scores)) => scores.push(one.score.title()),
                    None => said.push((&one.words, vec![one.score.title()])),
                }
            }
            let parts: Vec<String> = said
                .iter()
                .map(|(words, scores)| format!("{words} ({})", scores.join(", ")))
                .collect();
            format!("{} v. {}: {}", a.title(), b.title(), parts.join("; "))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Difference, compared, in_words};
    use crate::domain::ThresholdMetric::{Density, Ensemble, NlSsim, Relief};
    use crate::report::score::Score;
    use crate::report::score_bootstrap::ResamplingUnit;

    fn difference(score: Score, difference: f64, p: Option<f64>) -> Difference {
        Difference {
            score,
            a: Ensemble,
            b: Density,
            n: 587,
            mean: difference,
            ci95: p.map(|_| [difference - 0.01, difference + 0.01]),
            p,
        }
    }

    #[test]
    fn holm_is_over_the_comparisons_of_one_score() {
        let mut found = vec![
            difference(Score::Ssim, 0.1, Some(0.01)),
            difference(Score::Ssim, 0.1, Some(0.03)),
            difference(Score::Ssim, 0.0, Some(0.5)),
            difference(Score::Iou, -0.1, Some(0.04)),
        ];
        (found[1].b, found[2].a) = (NlSsim, Relief);
        let found = compared(&found, ResamplingUnit::Pair);
        // statsmodels 0.15.0 `multipletests([0.01, 0.03, 0.5], method="holm")`.
        let wanted = [0.03, 0.06, 0.5, 0.04];
        for (one, wanted) in found.iter().zip(wanted) {
            assert!((one.p_holm.expect("a p") - wanted).abs() < 1e-12);
        }
        let words: Vec<&str> = found.iter().map(|one| one.words.as_str()).collect();
        assert_eq!(words[0], "Ensemble is higher");
        assert!(words[1].starts_with("Ensemble looks higher, but not after"));
        assert_eq!(
            words[2..],
            ["cannot tell them apart", "Pixel density is higher"]
        );
    }

    #[test]
    fn scores_of_the_same_words_are_told_together() {
        let found = [
            difference(Score::Ssim, 0.1, Some(0.001)),
            difference(Score::Iou, 0.01, Some(0.3)),
            difference(Score::Dice, 0.1, Some(0.001)),
        ];
        assert_eq!(
            in_words(&compared(&found, ResamplingUnit::Pair)),
            [
                "Ensemble v. Pixel density: Ensemble is higher (SSIM, Dice); cannot tell them apart (IoU)"
            ]
        );
        let few = compared(&[difference(Score::Iou, 0.1, None)], ResamplingUnit::Block);
        assert_eq!(
            (few[0].p_holm, few[0].words.as_str()),
            (None, "too few blocks to tell")
        );
    }

    #[test]
    fn equal_scores_are_said_to_be_the_same() {
        let mut same = difference(Score::Dice, 0.0, Some(1.0));
        same.ci95 = Some([0.0; 2]);
        assert_eq!(
            compared(&[same], ResamplingUnit::Pair)[0].words,
            "the same on all pairs"
        );
    }
}
