//! The alignment of one metric before it is scored.

use super::params::RegisterError;
use crate::domain::{Affine2, ThresholdMetric};
use crate::stages::normalize::Normalized;

/// A pose with what is known of its certainty.
#[derive(Debug, Clone, Copy)]
pub(in crate::stages) struct Alignment {
    pub(in crate::stages) metric: ThresholdMetric,
    pub(in crate::stages) level: u16,
    pub(in crate::stages) print_from_depth: Affine2,
    pub(in crate::stages) margin: f64,
    pub(in crate::stages) at_bound: bool,
}

impl Alignment {
    /// Whether the same strokes are laid on the same place.
    pub(super) fn is_as(&self, other: &Self) -> bool {
        self.level == other.level && self.print_from_depth == other.print_from_depth
    }
}

/// The level that normalisation chose for a metric, and whether it lay at the end of its range.
pub(in crate::stages) fn chosen(
    normalized: &Normalized,
    metric: ThresholdMetric,
) -> Result<(u16, bool), RegisterError> {
    let mut choices = normalized.outcome.thresholds.iter();
    choices
        .find(|choice| choice.metric == metric)
        .map(|choice| (choice.level, choice.at_bound))
        .ok_or(RegisterError::NoThreshold(metric))
}
