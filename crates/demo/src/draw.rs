//! Draws of numbers and choices.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::kind::NumberRange;

/// Draws a number from a range.
pub(super) fn within([low, high]: NumberRange, rng: &mut ChaCha8Rng) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// Draws a whole number from a range that includes both ends.
pub(super) fn number_within([low, high]: NumberRange, rng: &mut ChaCha8Rng) -> u32 {
    (low + (high - low + 1.0) * rng.random::<f64>()) as u32
}

pub(super) fn one_of<'a, T>(choices: &'a [T], rng: &mut ChaCha8Rng) -> &'a T {
    &choices[rng.random_range(0..choices.len())]
}
