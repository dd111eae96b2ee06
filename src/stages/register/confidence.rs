//! Confidence of an alignment: the product of three logistic models, for the pose, for the mask, and for whether print
//! and relief show the same character.
//!
//! `cargo bench --bench accuracy -- --fit-confidence` fits the weights on generated pairs: matching pairs of the chosen
//! tiers (`--tiers all` for every tier), meshes paired with the print of another or a similar character, mirrored
//! meshes and uncarved plates. It prints the weights, and a reliability table for pairs of other seeds. `POSE` and
//! `MASK` were fitted on 1,010 pairs of two independent generators, and `CHARACTER` on the pairs that its comment
//! describes. Only the last two weights of `MASK` were set manually. They lower the confidence if the pose is a few
//! percent off, or if the threshold cuts through worn or tilted tops.

use crate::domain::{MetricOutcome, PoseFeatures, ThresholdMetric};

/// Number of inputs of the pose model: the constant 1, and the logarithms of the first five pose features.
const POSE_INPUTS: usize = 6;
/// Number of inputs of the mask model, see `mask_inputs`.
const MASK_INPUTS: usize = 8;
/// Number of inputs of the character model, see `character_inputs`.
const CHARACTER_INPUTS: usize = 5;

/// Weights of the pose model's inputs.
const POSE: [f64; POSE_INPUTS] = [2.54, 6.17, 2.67, 1.56, -2.43, -2.41];
/// Weights of the mask model's inputs. The last weight is large, because its input, the square of `Areas::rim`, is
/// small: on hard generated pairs, the median rim is 0.03, and 3 % of the rims are above 0.05.
const MASK: [f64; MASK_INPUTS] = [5.13, -3.54, -3.51, 1.12, -1.79, 3.29, -1.5, -500.0];
/// Weights of the character model's inputs. They were fitted on 1,000 pairs of 22 kinds and 77 prints of similar
/// characters, outside this repository. All kinds had the same weight, except the tier `hard`, which had three times
/// that weight.
const CHARACTER: [f64; CHARACTER_INPUTS] = [4.93, -2.29, 11.84, -3.52, -15.08];
/// An input of the character model for an area without a partner is `ln(1 + area / SMALL_AREA)`. In squares of the
/// stroke width.
const SMALL_AREA: f64 = 0.3;
/// `spread_input` divides the spread by this share of the depth map's longest side. Smaller spreads are invisible.
const UNSEEN_SPREAD: f64 = 0.002;
/// Lower bound of shares before their logarithm is taken.
const FLOOR: f64 = 0.02;
/// Range to which the competitors' scores are clamped, as shares of the best score.
const RATIO: [f64; 2] = [0.2, 1.5];

/// Inputs of the three logistic models. The confidence of an alignment is the product of their probabilities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfidenceInputs {
    /// Inputs of the model for the probability that the pose is right. A pose is right if its rotation is off by at
    /// most 5 degrees, and its landmarks by at most 5 % of the character's height.
    pub pose: [f64; POSE_INPUTS],
    /// Inputs of the model for the probability that the mask is right, given a right pose. A mask is right if its
    /// intersection over union with the true tops is at least 0.7.
    pub mask: [f64; MASK_INPUTS],
    /// Inputs of the model for the probability that print and relief show the same character, given a right pose.
    pub character: [f64; CHARACTER_INPUTS],
}

impl ConfidenceInputs {
    /// Returns the confidence, 0..=1, under the built-in weights.
    pub fn confidence(&self) -> f64 {
        let pose_and_mask = logistic(&POSE, &self.pose) * logistic(&MASK, &self.mask);
        pose_and_mask * logistic(&CHARACTER, &self.character)
    }
}

/// Returns the probability, 0..=1, that the pose is right.
pub(super) fn of_pose(features: &PoseFeatures) -> f64 {
    logistic(&POSE, &pose_inputs(features))
}

fn pose_inputs(features: &PoseFeatures) -> [f64; POSE_INPUTS] {
    let share = |value: f64| value.max(FLOOR).ln();
    let ratio = |value: f64| value.clamp(RATIO[0], RATIO[1]).ln();
    [
        1.0,
        share(features.correlation),
        share(features.tops_covered),
        share(features.ink_covered),
        ratio(features.other_angle),
        ratio(features.mirrored),
    ]
}

/// Returns the probability, 0..=1, that print and relief show the same character.
pub(super) fn of_character(features: &PoseFeatures) -> f64 {
    logistic(&CHARACTER, &character_inputs(features))
}

/// Returns the inputs of the character model. With `size(area) = ln(1 + area / SMALL_AREA)`, they are 1, the size of
/// the tops without ink, that size times the edge scatter, the size of the geometric mean of the areas of tops without
/// ink and of ink without wood, and the edge scatter.
///
/// Dry ink leaves tops without ink and rough edges, and lost wood leaves ink without tops. Prints of similar characters
/// often have tops without ink together with ink without tops, or tops without ink together with sharp edges.
fn character_inputs(features: &PoseFeatures) -> [f64; CHARACTER_INPUTS] {
    let (tops, ink) = (features.tops_alone, features.ink_alone);
    let size = |area: f64| (area / SMALL_AREA).ln_1p();
    [
        1.0,
        size(tops),
        size(tops) * features.edge_scatter,
        size((tops * ink).sqrt()),
        features.edge_scatter,
    ]
}

/// Areas that bear on a depth mask, as shares of the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Areas {
    /// Area of the mask.
    mask: f64,
    /// Area of the mask whose threshold was chosen from the relief alone.
    relief: f64,
    /// Area of the print's ink.
    ink: f64,
    /// Width of the rim that a slightly lower threshold would add, `ln(area with rim / area) * sqrt(area)`, but at most
    /// the width for the metric `relief`.
    rim: f64,
}

fn mask_inputs(features: &PoseFeatures, areas: Areas) -> [f64; MASK_INPUTS] {
    let over_relief = |area: f64| (area.max(1e-6) / areas.relief.max(1e-6)).ln();
    let (mask, ink) = (over_relief(areas.mask), over_relief(areas.ink));
    [
        1.0,
        mask,
        mask * mask,
        ink,
        ink * ink,
        features.correlation.max(FLOOR).ln(),
        spread_input(features.spread),
        areas.rim * areas.rim,
    ]
}

/// Returns `ln(1 + spread / UNSEEN_SPREAD)`. It is 0 if all starts of the refinement end at the same pose.
fn spread_input(spread: f64) -> f64 {
    (spread / UNSEEN_SPREAD).ln_1p()
}

fn logistic<const N: usize>(weights: &[f64; N], inputs: &[f64; N]) -> f64 {
    let sum: f64 = weights.iter().zip(inputs).map(|(w, x)| w * x).sum();
    1.0 / (1.0 + (-sum).exp())
}

/// Sets the confidence of each metric, and returns each metric's model inputs. `growth` computes
/// `normalize::stroke_growth` at a threshold level.
pub(super) fn set_confidence(
    metrics: &mut [MetricOutcome],
    features: &PoseFeatures,
    growth: impl Fn(u16) -> f64,
) -> Vec<ConfidenceInputs> {
    let rim = |outcome: &MetricOutcome| {
        growth(outcome.threshold_level) * outcome.scores.density_depth.sqrt()
    };
    let by_relief = metrics
        .iter()
        .find(|outcome| outcome.metric == ThresholdMetric::Relief);
    let by_relief = by_relief.map(|outcome| (outcome.scores.density_depth, rim(outcome)));
    let pose = pose_inputs(features);
    let character = character_inputs(features);
    let mut all = Vec::new();
    for outcome in metrics {
        let scores = outcome.scores;
        let (relief, relief_rim) = by_relief.unwrap_or((scores.density_depth, f64::INFINITY));
        let areas = Areas {
            mask: scores.density_depth,
            relief,
            ink: scores.density_print,
            rim: rim(outcome).min(relief_rim),
        };
        let inputs = ConfidenceInputs {
            pose,
            mask: mask_inputs(features, areas),
            character,
        };
        outcome.confidence = Some(inputs.confidence());
        all.push(inputs);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{Areas, MASK, logistic, mask_inputs, of_character, of_pose};
    use crate::domain::PoseFeatures;

    fn of_mask(features: &PoseFeatures, areas: Areas) -> f64 {
        logistic(&MASK, &mask_inputs(features, areas))
    }

    const PLAIN: PoseFeatures = PoseFeatures {
        correlation: 0.88,
        tops_covered: 0.94,
        ink_covered: 0.91,
        other_angle: 0.3,
        mirrored: 0.4,
        spread: 0.0,
        tops_alone: 0.0,
        ink_alone: 0.0,
        edge_scatter: 0.03,
    };

    #[test]
    fn each_feature_moves_the_probability_its_way() {
        let plain = of_pose(&PLAIN);
        assert!(plain > 0.99);
        let worse = [
            PoseFeatures {
                correlation: 0.4,
                ..PLAIN
            },
            PoseFeatures {
                tops_covered: 0.5,
                ..PLAIN
            },
            PoseFeatures {
                ink_covered: 0.4,
                ..PLAIN
            },
            PoseFeatures {
                other_angle: 0.95,
                ..PLAIN
            },
            PoseFeatures {
                mirrored: 1.1,
                ..PLAIN
            },
        ];
        for features in worse {
            assert!(of_pose(&features) < plain, "{features:?}");
        }
    }

    const LIKE: Areas = Areas {
        mask: 0.2,
        relief: 0.2,
        ink: 0.25,
        rim: 0.03,
    };

    #[test]
    fn a_mask_far_from_the_mask_by_relief_is_trusted_less() {
        let probability = |mask, ink| of_mask(&PLAIN, Areas { mask, ink, ..LIKE });
        assert!(probability(0.2, 0.25) > 0.95);
        assert!(probability(0.5, 0.25) < probability(0.25, 0.25));
        assert!(probability(0.2, 0.08) < probability(0.2, 0.25));
    }

    #[test]
    fn a_pose_that_depends_on_its_start_is_trusted_less() {
        let probability = |spread| of_mask(&PoseFeatures { spread, ..PLAIN }, LIKE);
        assert!(probability(0.0005) > 0.95);
        assert!(probability(0.02) < 0.7);
    }

    #[test]
    fn a_threshold_through_tops_is_trusted_less() {
        let probability = |rim| of_mask(&PLAIN, Areas { rim, ..LIKE });
        assert!(probability(0.04) > 0.95);
        assert!(probability(0.1) < 0.6);
    }

    #[test]
    fn strokes_without_a_partner_are_evidence_against_the_character() {
        let probability = |tops_alone, ink_alone, edge_scatter| {
            of_character(&PoseFeatures {
                tops_alone,
                ink_alone,
                edge_scatter,
                ..PLAIN
            })
        };
        assert!(probability(0.0, 0.0, 0.03) > 0.98);
        // Dry ink, and lost wood.
        assert!(probability(3.0, 0.0, 0.2) > 0.8);
        assert!(probability(0.0, 6.0, 0.08) > 0.9);
        // Strokes in other places.
        assert!(probability(1.0, 1.0, 0.1) < 0.3);
        // A stroke without ink in a sharp print.
        assert!(probability(3.0, 0.0, 0.04) < probability(3.0, 0.0, 0.2));
    }

    #[test]
    fn another_characters_print_has_a_low_confidence() {
        let wrong = PoseFeatures {
            correlation: 0.34,
            tops_covered: 0.65,
            ink_covered: 0.68,
            other_angle: 0.88,
            mirrored: 0.94,
            spread: 0.0,
            ..PLAIN
        };
        assert!(of_pose(&wrong) < 0.05);
    }
}
