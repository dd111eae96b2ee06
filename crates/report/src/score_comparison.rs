//! Metrics compared by their scores on the same pairs.

use serde::Serialize;

use super::comparison::versus;
use mocban_core::domain::{Scores, ThresholdMetric};
use mocban_results::stats::{ResamplingUnit, SIGNIFICANCE_LEVEL, holm_of_known};

/// A score of the paper's table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Score {
    /// Structural similarity.
    Ssim,
    /// Intersection over union by pixel.
    Iou,
    /// Intersection over union of the bounding boxes.
    IouBox,
    /// Dice coefficient by pixel.
    Dice,
}

impl Score {
    /// Every score, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Ssim, Self::Iou, Self::IouBox, Self::Dice];
    /// The scores by which metrics are compared.
    pub const COMPARED: [Self; 3] = [Self::Ssim, Self::Iou, Self::Dice];

    /// Returns the header of its column.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Ssim => "SSIM",
            Self::Iou => "IoU",
            Self::IouBox => "IoU box",
            Self::Dice => "Dice",
        }
    }

    /// Returns its value: 0..=1, except SSIM, which may be negative.
    pub const fn of(self, scores: &Scores) -> f64 {
        match self {
            Self::Ssim => scores.ssim,
            Self::Iou => scores.iou,
            Self::IouBox => scores.iou_box,
            Self::Dice => scores.dice,
        }
    }
}

/// Two metrics by one score on the same pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreComparison {
    /// The score.
    pub score: Score,
    /// The first metric.
    pub a: ThresholdMetric,
    /// The second metric.
    pub b: ThresholdMetric,
    /// Pairs with results of both.
    pub n: u64,
    /// Mean of the first minus mean of the second.
    pub difference: f64,
    /// The 95 % interval of the difference. `None` if there are too few pairs or blocks to resample.
    pub ci95: Option<[f64; 2]>,
    /// Name of the test that gave interval and `p`.
    pub test: &'static str,
    /// Two-sided p-value of the test. `None` if there are too few units.
    pub p: Option<f64>,
    /// `p` after Holm's correction over the comparisons by this score.
    pub p_holm: Option<f64>,
    /// The conclusion, a sentence without its full stop.
    pub conclusion: String,
}

/// Sets `p_holm` and `conclusion` of every comparison. Holm's correction is applied to each score separately.
/// Comparisons of the same score must be adjacent.
pub(super) fn conclude(comparisons: &mut [ScoreComparison], unit: ResamplingUnit) {
    for family in comparisons.chunk_by_mut(|a, b| a.score == b.score) {
        let p_values: Vec<Option<f64>> = family.iter().map(|one| one.p).collect();
        for (one, p_holm) in family.iter_mut().zip(holm_of_known(&p_values)) {
            one.p_holm = p_holm;
            one.conclusion = one.conclusion(unit);
        }
    }
}

impl ScoreComparison {
    /// Name of the test.
    pub(super) const TEST: &str = "paired bootstrap, percentile, two-sided";

    fn conclusion(&self, unit: ResamplingUnit) -> String {
        let higher = if self.difference > 0.0 {
            self.a
        } else {
            self.b
        }
        .title();
        match self.p.zip(self.p_holm) {
            None => format!("too few {} for a test", unit.plural()),
            Some(_) if self.ci95 == Some([0.0; 2]) => "equal on all pairs".to_owned(),
            Some((_, p_holm)) if p_holm < SIGNIFICANCE_LEVEL => {
                format!("{higher} is significantly higher")
            }
            Some((p, _)) if p < SIGNIFICANCE_LEVEL => {
                format!(
                    "{higher} is higher, but not significantly after correction for several comparisons"
                )
            }
            Some(_) => "no significant difference".to_owned(),
        }
    }
}

/// Returns one text for every two compared metrics. Scores with the same conclusion are listed together, as in
/// `Ensemble v. Relief: Ensemble is significantly higher (SSIM, IoU). No significant difference (Dice).`
pub(super) fn conclusions(found: &[ScoreComparison]) -> Vec<String> {
    let mut compared: Vec<(ThresholdMetric, ThresholdMetric)> = Vec::new();
    for one in found {
        if !compared.contains(&(one.a, one.b)) {
            compared.push((one.a, one.b));
        }
    }
    let sentences = |(a, b): (ThresholdMetric, ThresholdMetric)| {
        let mut scores_by_conclusion: Vec<(&str, Vec<&str>)> = Vec::new();
        for one in found.iter().filter(|one| (one.a, one.b) == (a, b)) {
            let mut known = scores_by_conclusion.iter_mut();
            match known.find(|(conclusion, _)| *conclusion == one.conclusion) {
                Some((_, scores)) => scores.push(one.score.title()),
                None => scores_by_conclusion.push((&one.conclusion, vec![one.score.title()])),
            }
        }
        let parts = scores_by_conclusion.iter().enumerate();
        let parts = parts.map(|(i, (conclusion, scores))| {
            let scores = scores.join(", ");
            match i {
                0 => format!("{}: {conclusion} ({scores}).", versus(a, b)),
                _ => format!(" {} ({scores}).", capitalized(conclusion)),
            }
        });
        parts.collect::<String>()
    };
    compared.into_iter().map(sentences).collect()
}

/// Returns a text whose first letter is a capital.
fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::{Score, ScoreComparison, conclude, conclusions};
    use mocban_core::domain::ThresholdMetric::{Density, Ensemble, NlSsim, Relief};
    use mocban_results::stats::ResamplingUnit;

    fn difference(score: Score, difference: f64, p: Option<f64>) -> ScoreComparison {
        ScoreComparison {
            score,
            a: Ensemble,
            b: Density,
            n: 587,
            difference,
            ci95: p.map(|_| [difference - 0.01, difference + 0.01]),
            test: ScoreComparison::TEST,
            p,
            p_holm: None,
            conclusion: String::new(),
        }
    }

    #[test]
    fn holm_is_applied_within_each_score() {
        let mut found = vec![
            difference(Score::Ssim, 0.1, Some(0.01)),
            difference(Score::Ssim, 0.1, Some(0.03)),
            difference(Score::Ssim, 0.0, Some(0.5)),
            difference(Score::Iou, -0.1, Some(0.04)),
        ];
        (found[1].b, found[2].a) = (NlSsim, Relief);
        conclude(&mut found, ResamplingUnit::Pair);
        // statsmodels 0.15.0 `multipletests([0.01, 0.03, 0.5], method="holm")`.
        let wanted = [0.03, 0.06, 0.5, 0.04];
        for (one, wanted) in found.iter().zip(wanted) {
            assert!((one.p_holm.expect("a p") - wanted).abs() < 1e-12);
        }
        let said: Vec<&str> = found.iter().map(|one| one.conclusion.as_str()).collect();
        assert_eq!(said[0], "Ensemble is significantly higher");
        assert!(said[1].starts_with("Ensemble is higher, but not significantly after"));
        let last = [
            "no significant difference",
            "Pixel density is significantly higher",
        ];
        assert_eq!(said[2..], last);
    }

    #[test]
    fn scores_with_the_same_conclusion_share_a_sentence() {
        let mut found = [
            difference(Score::Ssim, 0.1, Some(0.001)),
            difference(Score::Iou, 0.01, Some(0.3)),
            difference(Score::Dice, 0.1, Some(0.001)),
        ];
        conclude(&mut found, ResamplingUnit::Pair);
        assert_eq!(
            conclusions(&found),
            [
                "Ensemble v. Pixel density: Ensemble is significantly higher (SSIM, Dice). No significant difference \
                 (IoU)."
            ]
        );
        let mut few = [difference(Score::Iou, 0.1, None)];
        conclude(&mut few, ResamplingUnit::Block);
        assert_eq!(few[0].p_holm, None);
        assert_eq!(few[0].conclusion, "too few blocks for a test");
    }

    #[test]
    fn equal_scores_are_called_equal() {
        let mut same = [difference(Score::Dice, 0.0, Some(1.0))];
        same[0].ci95 = Some([0.0; 2]);
        conclude(&mut same, ResamplingUnit::Pair);
        assert_eq!(same[0].conclusion, "equal on all pairs");
    }
}
