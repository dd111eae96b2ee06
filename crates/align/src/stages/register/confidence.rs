//! Confidence of an alignment: the product of three logistic models, for the pose, for the mask, and for whether print
//! and relief show the same character, and of the factor of [`Doubts`].
//!
//! `cargo bench --bench accuracy -- --fit-confidence` fits the weights on generated pairs: matching pairs of the
//! chosen tiers (`--tiers all` for every tier), meshes paired with the print of another or a similar character,
//! mirrored meshes and uncarved plates. It prints the weights, and a reliability table for pairs of other seeds.
//! `POSE` was fitted on 1,010 pairs of two independent generators, and `CHARACTER` on the pairs that its comment
//! describes. `MASK` was set manually, because few masks are wrong. It lowers the confidence if the pose is a few
//! percent off. On generated pairs, the mean confidence is slightly below the fraction that is right.

use super::doubts::{Doubts, of_pixels, of_upright};
use mocban_core::domain::{MetricOutcome, PoseFeatures};

/// Number of inputs of the pose model: the constant 1, and the logarithms of the first five pose features.
const POSE_INPUTS: usize = 6;
/// Index of the logarithm of `mirrored` among the inputs of the pose model, see `pose_inputs`.
const MIRRORED_INPUT: usize = 5;
/// Number of inputs of the mask model, see `mask_inputs`.
const MASK_INPUTS: usize = 4;
/// Number of inputs of the character model, see `character_inputs`.
const CHARACTER_INPUTS: usize = 11;

/// Weights of the pose model's inputs.
const POSE: [f64; POSE_INPUTS] = [2.54, 6.17, 2.67, 1.56, -2.43, -2.41];
/// Weights of the mask model's inputs.
const MASK: [f64; MASK_INPUTS] = [2.5, 1.0, 3.0, -1.2];
/// Weights of the character model's inputs. They were fitted on the right poses of 570 pairs of all tiers and of 590
/// pairs of a generator outside this repository, on 470 prints of similar characters and on 420 random wrong prints.
/// Wrong prints had a fifth of the weight of the pairs. The fitted weights were multiplied by 1.5: fewer wrong prints
/// then have a confidence of 0.5 or more, and hardly fewer pairs.
const CHARACTER: [f64; CHARACTER_INPUTS] = [
    -6.97, -1.28, 4.66, -2.79, -68.3, 3.68, 2.18, -2.79, 4.27, -2.29, -4.47,
];
/// An input of the character model for an area without a partner is `ln(1 + area / SMALL_AREA)`. In squares of the
/// stroke width.
const SMALL_AREA: f64 = 0.3;
/// Edge scatter above which edges are not counted as rougher. Such edges belong to dry ink and to lost wood, which say
/// nothing about the character.
const ROUGHEST: f64 = 0.12;
/// Lower bound of the ink's area before its logarithm is taken. In squares of the stroke width. A character of a single
/// stroke has a larger area.
const LEAST_INK: f64 = 2.0;
/// `spread_input` divides the spread by this fraction of the depth map's longest side. Smaller spreads are invisible.
const UNSEEN_SPREAD: f64 = 0.002;
/// Range to which the probability that a mask is right is clamped.
const PROBABILITY: [f64; 2] = [0.02, 0.995];
/// Lower bound of fractions before their logarithm is taken.
const FLOOR: f64 = 0.02;
/// Range to which the competitors' scores are clamped, as fractions of the best score.
const RATIO: [f64; 2] = [0.2, 1.5];

/// Inputs of the confidence of an alignment: the product of the probabilities of three logistic models and of the factor of
/// its doubts. The block of a pair adds to the probability of the pose only: it knows where a character is, and not whether
/// wood and print show the same one.
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
    /// Logarithm of the odds of the pose that the block gives, 0 for a pair that was not cut from one.
    pub prior: f64,
    /// What lowers the confidence further.
    pub doubts: Doubts,
    /// Side of the pixels of a small print as a fraction of the stroke width, 0 for other prints.
    pub pixel_width: f64,
}

impl ConfidenceInputs {
    /// Returns the confidence, 0..=1, under the built-in weights.
    pub fn confidence(&self) -> f64 {
        let mirrored = self.pose[MIRRORED_INPUT].exp();
        self.of_candidate()
            * self.doubts.of_similar_characters()
            * of_pixels(self.pixel_width, self.prior)
            * of_upright(mirrored, self.prior)
    }

    /// Returns the confidence of a candidate of a fit. It lacks the doubt about the print's pixels, which is the same for
    /// all candidates, and those about a mirrored pair and a similar character, which are for the chosen candidate.
    pub(crate) fn of_candidate(&self) -> f64 {
        pose_probability(&self.pose, self.prior)
            * logistic(&MASK, &self.mask)
            * logistic(&CHARACTER, &self.character)
            * self.doubts.factor()
    }
}

/// Logarithms of the odds that a block gives a pose near the one that it expects, if its own confidence is 0.5 and 1. On
/// generated blocks, all of 2,445 characters lie where the block places them.
const BLOCK_ODDS: [f64; 2] = [2.5, 4.5];

/// Returns the logarithm of the odds that a block gives a pose near the one that it expects. A block that is less than
/// half sure says nothing.
pub(super) fn prior_of(confidence: f64) -> f64 {
    let [least, most] = BLOCK_ODDS;
    if confidence < 0.5 {
        return 0.0;
    }
    least + (most - least) * (2.0 * confidence - 1.0).min(1.0)
}

/// Returns the probability, 0..=1, that the pose is right. `prior` is the logarithm of the odds that the block gives.
pub(super) fn of_pose(features: &PoseFeatures, prior: f64) -> f64 {
    pose_probability(&pose_inputs(features), prior)
}

/// Returns the probability that the pose is right by the evidence of the pair alone.
fn of_pair_alone(features: &PoseFeatures) -> f64 {
    of_pose(features, 0.0)
}

/// Returns the probability of a pose. The evidence of the pair or that of the block is enough: a coarse scan or faint ink of
/// one character says nothing against its place.
fn pose_probability(inputs: &[f64; POSE_INPUTS], prior: f64) -> f64 {
    let own = logistic(&POSE, inputs);
    let block = if prior > 0.0 {
        1.0 / (1.0 + (-prior).exp())
    } else {
        0.0
    };
    1.0 - (1.0 - own) * (1.0 - block)
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
/// ink and of ink without wood, the edge scatter, the logarithm of the ink's area, and the inputs of the pose model.
///
/// Dry ink leaves tops without ink and rough edges, and lost wood leaves ink without tops. Prints of similar characters
/// often have tops without ink together with ink without tops, or tops without ink together with sharp edges. A stroke
/// without a partner says less if the character has many strokes.
fn character_inputs(features: &PoseFeatures) -> [f64; CHARACTER_INPUTS] {
    let (tops, ink) = (features.unmatched_tops, features.unmatched_ink);
    let size = |area: f64| (area / SMALL_AREA).ln_1p();
    let scatter = features.edge_scatter.min(ROUGHEST);
    let [one, correlation, tops_covered, ink_covered, other, mirrored] = pose_inputs(features);
    [
        one,
        size(tops),
        size(tops) * scatter,
        size((tops * ink).sqrt()),
        scatter,
        features.ink_area.max(LEAST_INK).ln(),
        correlation,
        tops_covered,
        ink_covered,
        other,
        mirrored,
    ]
}

/// Returns the inputs of the mask model. `probability_right` comes from the candidate thresholds, see `tops_edge`.
fn mask_inputs(features: &PoseFeatures, probability_right: f64) -> [f64; MASK_INPUTS] {
    let [least, most] = PROBABILITY;
    let probability = probability_right.clamp(least, most);
    [
        1.0,
        (probability / (1.0 - probability)).ln(),
        features.correlation.max(FLOOR).ln(),
        spread_input(features.spread),
    ]
}

/// Returns `ln(1 + spread / UNSEEN_SPREAD)`. It is 0 if all starts of the refinement end at the same pose.
fn spread_input(spread: f64) -> f64 {
    (spread / UNSEEN_SPREAD).ln_1p()
}

/// Returns the features with the lower probability.
///
/// The heights of a levelling are chosen from the ink, so that a wrong pose and a wrong print agree better too. A levelling
/// is evidence for the mask, but neither for the pose nor for the character.
fn less_likely(
    probability: fn(&PoseFeatures) -> f64,
    [rendered, levelled]: [&PoseFeatures; 2],
) -> &PoseFeatures {
    if probability(rendered) < probability(levelled) {
        rendered
    } else {
        levelled
    }
}

fn logistic<const N: usize>(weights: &[f64; N], inputs: &[f64; N]) -> f64 {
    let sum: f64 = weights.iter().zip(inputs).map(|(w, x)| w * x).sum();
    1.0 / (1.0 + (-sum).exp())
}

/// Sets the confidence of each metric, and returns each metric's model inputs. `rendered` are the features of the depth
/// map as rendered, which differ from `features` if the map was levelled. `prior` is as in [`of_pose`], `pixel_width` as in
/// [`ConfidenceInputs`]. `probabilities` holds the probability that the mask is right, for each metric.
pub(super) fn set_confidence(
    metrics: &mut [MetricOutcome],
    [features, rendered]: [&PoseFeatures; 2],
    prior: f64,
    doubts: Doubts,
    pixel_width: f64,
    probabilities: impl Iterator<Item = f64>,
) -> Vec<ConfidenceInputs> {
    let pose = pose_inputs(less_likely(of_pair_alone, [rendered, features]));
    let character = character_inputs(less_likely(of_character, [rendered, features]));
    let of_metric = |(outcome, probability): (&mut MetricOutcome, f64)| {
        let inputs = ConfidenceInputs {
            pose,
            mask: mask_inputs(features, probability),
            character,
            prior,
            doubts,
            pixel_width,
        };
        outcome.confidence = Some(inputs.confidence());
        inputs
    };
    metrics
        .iter_mut()
        .zip(probabilities)
        .map(of_metric)
        .collect()
}

#[cfg(test)]
mod tests;
