//! The review queue: the items that a reviewer judges, in order. Results that look the same form one item.

use std::sync::Arc;

use super::check_items;
use super::history::ReviewerHistory;
use super::item::{ItemView, ReviewItem};
use super::options::QueueOptions;
use super::order;
use super::planted_faults::{FaultPlanter, FaultShortage, QueueError};
use mocban_catalog::{Catalog, CatalogError, MetricRecord, PairResults};
use mocban_core::domain::{DepthOutcome, ReviewOrder, SeededRandom, Stage, Verdict};
use mocban_results::consensus::is_open_conflict;
use mocban_results::pair_artifacts::group_identical;

/// Number of pairs read from the catalog at a time.
const PAGE_PAIRS: usize = 256;
/// Minimum confidence of a result in which a fault may be planted.
const RELIABLE_CONFIDENCE: f64 = 0.8;

/// Items in order, and what the reviewer has done so far.
#[derive(Debug, Default)]
pub(super) struct ReviewQueue {
    pub(super) items: Vec<Arc<ReviewItem>>,
    pub(super) history: ReviewerHistory,
    /// Set if fewer faults could be planted than wanted.
    pub(super) shortage: Option<FaultShortage>,
}

impl ReviewQueue {
    /// Reads the queue of a reviewer from the current state of the catalog.
    pub(super) async fn read(
        catalog: &Catalog,
        planter: &FaultPlanter,
        options: &QueueOptions,
    ) -> Result<Self, QueueError> {
        let key = catalog.review_key().await?;
        let random = SeededRandom::new(options.seed, &options.reviewer);
        let mut items = all_items(catalog, options).await?;
        let others = match options.sample {
            Some(count) => order::sample(&mut items, options.order, options.seed, count),
            None => Vec::new(),
        };
        order::sort(&mut items, options.order, &random);
        let history = ReviewerHistory::read(catalog, options).await?;
        let mut shortage = None;
        if options.has_attention_checks() {
            let answered = history.faulty_results();
            let rates = &options.rates;
            let found = check_items::fault_candidates(&items, &others, answered, rates, &random);
            let faults = planter.plant(found, &random).await?;
            shortage = faults.shortage;
            items = check_items::interleave(items, faults.items, &options.rates, &random);
        }
        let item = |item: ReviewItem| Arc::new(item.with_id(&key, &options.reviewer));
        Ok(Self {
            items: items.into_iter().map(item).collect(),
            history,
            shortage,
        })
    }
}

async fn all_items(
    catalog: &Catalog,
    options: &QueueOptions,
) -> Result<Vec<ReviewItem>, CatalogError> {
    let mut items = Vec::new();
    let mut pages = match options.order {
        // Only results with verdicts are disputed.
        ReviewOrder::Adjudicate => catalog.judged_pages(PAGE_PAIRS).await?,
        ReviewOrder::Random | ReviewOrder::LeastConfident => catalog.result_pages(PAGE_PAIRS),
    };
    while let Some(page) = pages.next().await? {
        let wanted = |pair: &&PairResults| options.has_pair(&pair.attributes.name);
        for pair in page.iter().filter(wanted) {
            items.extend(items_of_pair(pair, options));
        }
    }
    Ok(items)
}

/// Returns the items of one pair, one for each group of results that look the same.
fn items_of_pair(pair: &PairResults, options: &QueueOptions) -> Vec<ReviewItem> {
    let (Some(depth), Some(print)) = (pair.stage(Stage::Depth), pair.stage(Stage::Normalize))
    else {
        return Vec::new();
    };
    let (Ok(outcome), Some(print_hash)) = (depth.parse::<DepthOutcome>(), print.print_hash) else {
        return Vec::new();
    };
    let wanted = &options.metrics;
    let is_of_metric =
        |record: &&MetricRecord| wanted.is_empty() || wanted.contains(&record.outcome.metric);
    // In adjudication, only disputed results get a verdict, even if an undisputed result looks the same. Verdicts on
    // such undisputed results would bias the measured accuracy, because these results are not a random sample.
    let is_wanted = |record: &&MetricRecord| {
        options.order != ReviewOrder::Adjudicate || is_open_conflict(record, &options.reviewer)
    };
    let groups = group_identical(pair.metrics.iter().filter(is_of_metric).filter(is_wanted));
    let item = |group: Vec<&MetricRecord>| {
        let first = group[0].outcome;
        ReviewItem {
            id: String::new(),
            pair: pair.attributes.name.clone(),
            results: group
                .iter()
                .map(|record| (record.outcome.metric, record.result_hash))
                .collect(),
            check: None,
            view: ItemView {
                print_hash,
                depth_hash: depth.result_hash,
                depth_px: [outcome.width, outcome.height],
                level: first.threshold_level,
                print_from_depth: first.print_from_depth,
            },
            uncertainty: uncertainty(group[0]),
            is_reliable: group
                .iter()
                .all(|record| is_reliable(record, &options.reviewer)),
        }
    };
    groups.into_iter().map(item).collect()
}

/// Returns a number that is higher for less certain results: those with a low confidence, a low similarity, or a search
/// that ended at a bound.
fn uncertainty(record: &MetricRecord) -> f64 {
    let outcome = &record.outcome;
    let doubt = 1.0 - outcome.confidence.unwrap_or(0.5);
    let dissimilarity = 1.0 - outcome.scores.nl_ssim;
    doubt + 0.5 * dissimilarity + if outcome.at_bound { 0.25 } else { 0.0 }
}

/// Returns whether a fault may be planted in a result. The confidence must be high or unknown, the search must not have
/// ended at a bound, and all verdicts of others must be passes. The reviewer's own verdicts are ignored, so that the
/// queue does not change while it is reviewed.
fn is_reliable(record: &MetricRecord, reviewer: &str) -> bool {
    let outcome = &record.outcome;
    let mut verdicts = record.verdicts.iter();
    outcome
        .confidence
        .is_none_or(|confidence| confidence >= RELIABLE_CONFIDENCE)
        && !outcome.at_bound
        && verdicts.all(|read| read.reviewer == reviewer || read.verdict == Verdict::Pass)
}

#[cfg(test)]
mod tests {
    use super::{is_reliable, items_of_pair};
    use crate::review::{CheckRates, QueueOptions};
    use mocban_core::domain::{ReviewOrder, ThresholdMetric, Verdict};
    use mocban_results::test_fixtures;

    fn options(order: ReviewOrder, faults: f64, duplicates: f64) -> QueueOptions {
        QueueOptions {
            reviewer: "ana".to_owned(),
            metrics: Vec::new(),
            order,
            pairs: None,
            seed: 1,
            sample: None,
            rates: CheckRates { faults, duplicates },
        }
    }

    #[test]
    fn no_fault_is_planted_in_a_failed_result() {
        let record =
            |verdicts: &[Verdict]| test_fixtures::metric(ThresholdMetric::Density, 0.8, verdicts);
        let reliable = |verdicts: &[Verdict]| is_reliable(&record(verdicts), "ana");
        assert!(reliable(&[]) && reliable(&[Verdict::Pass]));
        assert!(!reliable(&[Verdict::Pass, Verdict::Fail]));
        let own = &record(&[Verdict::Fail]).verdicts[0].reviewer.clone();
        assert!(is_reliable(&record(&[Verdict::Fail]), own));
    }

    #[test]
    fn a_pair_without_results_has_no_item() {
        let options = options(ReviewOrder::Random, 0.0, 0.0);
        assert_eq!(items_of_pair(&test_fixtures::pending("a"), &options), []);
    }

    #[test]
    fn a_queue_has_attention_checks_unless_it_adjudicates() {
        let checks =
            |order, faults, duplicates| options(order, faults, duplicates).has_attention_checks();
        assert!(
            checks(ReviewOrder::Random, 0.04, 0.0)
                && checks(ReviewOrder::LeastConfident, 0.0, 0.05)
        );
        assert!(!checks(ReviewOrder::Random, 0.0, 0.0));
        assert!(!checks(ReviewOrder::Adjudicate, 0.04, 0.05));
    }
}
