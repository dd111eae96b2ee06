//! Options of the review page: the reviewer, the order of the queue, and the attention checks.

use std::collections::BTreeMap;
use std::path::Path;

use super::check_items::CheckRates;
use super::i18n::Language;
use mocban_catalog::CatalogError;
use mocban_core::InputLimits;
use mocban_core::domain::{ReviewOrder, ThresholdMetric, UnixMillis};

/// Options of a review queue.
#[derive(Debug, Clone, PartialEq)]
pub struct QueueOptions {
    /// Name of the reviewer.
    pub reviewer: String,
    /// Metrics whose results are reviewed. If empty, the results of all metrics are reviewed. A result of another
    /// metric gets no verdict, even if it looks the same as a reviewed one.
    pub metrics: Vec<ThresholdMetric>,
    /// Order of the results.
    pub order: ReviewOrder,
    /// Seed of the shuffle and of the attention checks.
    pub seed: u64,
    /// Maximum number of results. The sample is the same for every reviewer.
    pub sample: Option<usize>,
    /// Rates of attention checks. Ignored in adjudication.
    pub rates: CheckRates,
}

impl QueueOptions {
    /// Seed if none is given.
    pub const DEFAULT_SEED: u64 = 1;

    /// Returns the arguments with which `review` shows the same results to another person, such as `review --reviewer NAME
    /// --metric relief --sample 50`. What has its default value is left out.
    pub fn for_another_reviewer(&self) -> String {
        let metrics = self.metrics.iter();
        let mut words: Vec<String> = metrics.map(|metric| format!("--metric {metric}")).collect();
        if let Some(sample) = self.sample {
            words.push(format!("--sample {sample}"));
            // The order and the seed decide which results are in the sample.
            if self.order == ReviewOrder::LeastConfident {
                words.push("--order least-confident".to_owned());
            }
            if self.seed != Self::DEFAULT_SEED {
                words.push(format!("--seed {}", self.seed));
            }
        }
        words.insert(0, "review --reviewer NAME".to_owned());
        words.join(" ")
    }

    /// Returns whether the queue can have attention checks. If so, the page shows the pair of an item only after the
    /// answer, because the reviewer would recognise a pair that appears twice.
    pub(super) fn has_attention_checks(&self) -> bool {
        let CheckRates { faults, duplicates } = self.rates;
        self.order != ReviewOrder::Adjudicate && (faults > 0.0 || duplicates > 0.0)
    }
}

/// Options of the pages.
#[derive(Debug, Clone)]
pub struct ReviewOptions {
    /// Whose queue is served, and what it contains.
    pub queue: QueueOptions,
    /// The command line that names this project, such as `mocban -C blocks`. The last page shows the next commands.
    pub command: String,
    /// Relative address of the pages of the project in the app, if the review is part of it. The last page then links there
    /// instead of showing commands.
    pub project_page: Option<&'static str>,
    /// Language of the page; `None` for that of the browser.
    pub language: Option<Language>,
    /// Map of physical keys to actions, from [`key_map`](super::key_map).
    pub keys: BTreeMap<String, String>,
    /// Minimum time in milliseconds that an image must be shown before the page accepts a verdict.
    pub min_view_ms: u64,
    /// Whether the page opens the guide when a reviewer starts for the first time.
    pub opens_guide: bool,
    /// Limits on the input files.
    pub limits: InputLimits,
    /// Returns the sentence that explains an error of the catalog of the project in a folder.
    pub explain: fn(&CatalogError, &Path) -> String,
    /// Clock.
    pub now: fn() -> UnixMillis,
}

#[cfg(test)]
mod tests {
    use super::{CheckRates, QueueOptions};
    use mocban_core::domain::{ReviewOrder, ThresholdMetric};

    #[test]
    fn another_reviewer_gets_the_same_results() {
        let all = QueueOptions {
            reviewer: "lan".to_owned(),
            metrics: Vec::new(),
            order: ReviewOrder::Random,
            seed: QueueOptions::DEFAULT_SEED,
            sample: None,
            rates: CheckRates {
                faults: 0.0,
                duplicates: 0.0,
            },
        };
        assert_eq!(all.for_another_reviewer(), "review --reviewer NAME");
        let some = QueueOptions {
            metrics: vec![ThresholdMetric::Relief, ThresholdMetric::Ensemble],
            order: ReviewOrder::LeastConfident,
            seed: 7,
            sample: Some(50),
            ..all
        };
        assert_eq!(
            some.for_another_reviewer(),
            "review --reviewer NAME --metric relief --metric ensemble --sample 50 --order least-confident --seed 7"
        );
    }
}
