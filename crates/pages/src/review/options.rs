//! Options of the review page: the reviewer, the order of the queue, and the attention checks.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::check_items::CheckRates;
use super::i18n::Language;
use mocban_catalog::CatalogError;
use mocban_core::InputLimits;
use mocban_core::domain::{PairName, ReviewOrder, ThresholdMetric, UnixMillis};

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
    /// Only the results of these pairs are reviewed. `None` for those of all pairs.
    pub pairs: Option<BTreeSet<PairName>>,
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
        let mut words = vec!["review --reviewer NAME".to_owned()];
        words.extend(self.metric_words());
        if let Some(sample) = self.sample {
            words.push(format!("--sample {sample}"));
            // The order and the seed decide which results are in the sample.
            words.extend(self.order_words());
        }
        words.join(" ")
    }

    /// Returns the arguments with which `review` continues this queue. `name` is the reviewer, quoted for a shell. Options with
    /// their default values are left out.
    pub fn to_continue(&self, name: &str) -> String {
        let mut words = vec![format!("review --reviewer {name}")];
        words.extend(self.metric_words());
        words.extend(self.sample.map(|sample| format!("--sample {sample}")));
        words.extend(self.order_words());
        if self.order == ReviewOrder::Adjudicate {
            words.push("--adjudicate".to_owned());
        }
        let CheckRates { faults, duplicates } = self.rates;
        let plain = CheckRates::default();
        for (option, rate, plain) in [
            ("--attention-checks", faults, plain.faults),
            ("--duplicates", duplicates, plain.duplicates),
        ] {
            if rate != plain {
                // A fraction such as 0.07 has no exact percentage.
                words.push(format!("{option} {}", (1e6 * rate).round() / 1e4));
            }
        }
        words.join(" ")
    }

    fn metric_words(&self) -> impl Iterator<Item = String> {
        let metrics = self.metrics.iter();
        metrics.map(|metric| format!("--metric {metric}"))
    }

    /// Returns the arguments of the order and the seed, except those of adjudication.
    fn order_words(&self) -> impl Iterator<Item = String> + use<> {
        let is_by_confidence = self.order == ReviewOrder::LeastConfident;
        let order = is_by_confidence.then(|| "--order least-confident".to_owned());
        let seed = (self.seed != Self::DEFAULT_SEED).then(|| format!("--seed {}", self.seed));
        order.into_iter().chain(seed)
    }

    /// Returns whether the results of a pair are reviewed.
    pub(super) fn has_pair(&self, name: &PairName) -> bool {
        (self.pairs.as_ref()).is_none_or(|pairs| pairs.contains(name))
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
    /// The command line that names this project, such as `mocban -C blocks`. The last page shows the next commands. `None` if
    /// the reviewer was invited and uses none.
    pub command: Option<String>,
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
            pairs: None,
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
        assert_eq!(
            some.to_continue("lan"),
            "review --reviewer lan --metric relief --metric ensemble --sample 50 --order least-confident --seed 7 \
             --attention-checks 0 --duplicates 0"
        );
        let settling = QueueOptions {
            order: ReviewOrder::Adjudicate,
            sample: None,
            metrics: Vec::new(),
            rates: CheckRates::default(),
            seed: QueueOptions::DEFAULT_SEED,
            ..some
        };
        assert_eq!(
            settling.to_continue("lan"),
            "review --reviewer lan --adjudicate"
        );
    }
}
