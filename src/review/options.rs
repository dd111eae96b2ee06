//! Options of the review page: whose queue it shows, in which order, with how many attention checks, and where.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use super::check_items::CheckRates;
use super::i18n::Language;
use crate::domain::{ReviewOrder, ThresholdMetric, UnixMillis};
use crate::raster::ImageLimits;

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

/// Options of the server.
#[derive(Debug, Clone)]
pub struct ReviewOptions {
    /// Whose queue is served, and what it contains.
    pub queue: QueueOptions,
    /// Language of the page.
    pub language: Language,
    /// Physical keys to actions; from [`key_map`](super::key_map).
    pub keys: BTreeMap<String, String>,
    /// Minimum time an image is shown before a verdict is accepted, milliseconds.
    pub min_view_ms: u64,
    /// Address to listen on. Port 0 selects a fixed port for the project and reviewer, or any free port if that one is
    /// taken.
    pub listen: SocketAddr,
    /// Limits on the print images.
    pub limits: ImageLimits,
    /// Clock.
    pub now: fn() -> UnixMillis,
}
