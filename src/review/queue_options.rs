//! What a reviewer is shown: whose queue, which results, in which order, with how many attention checks.

use super::check_items::CheckRates;
use crate::domain::{ReviewOrder, ThresholdMetric};

/// Options of a review queue.
#[derive(Debug, Clone, PartialEq)]
pub struct QueueOptions {
    /// Name of the reviewer.
    pub reviewer: String,
    /// Metrics whose results are reviewed; all if empty. Results of other metrics get no verdict, even where they look
    /// the same, because such a selection would bias their accuracy.
    pub metrics: Vec<ThresholdMetric>,
    /// Order of the results.
    pub order: ReviewOrder,
    /// Seed of the shuffle and of the attention checks.
    pub seed: u64,
    /// Maximum number of results; the same sample for every reviewer.
    pub sample: Option<usize>,
    /// Rates of attention checks; ignored when adjudicating.
    pub rates: CheckRates,
}

impl QueueOptions {
    /// Returns whether some items are attention checks. If so, an item does not reveal its pair before it is answered,
    /// because a pair that appears twice would give the check away.
    pub(super) fn has_attention_checks(&self) -> bool {
        let CheckRates { faults, duplicates } = self.rates;
        self.order != ReviewOrder::Adjudicate && (faults > 0.0 || duplicates > 0.0)
    }
}
