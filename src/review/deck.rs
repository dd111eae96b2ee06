//! The deck: all that a reviewer is to judge, in order, results that look the same as one card.

use std::sync::Arc;

use super::card::{Card, View};
use super::control::{self, Rates};
use super::known::Known;
use super::order;
use crate::catalog::{Catalog, CatalogError, MetricRecord, PairResults};
use crate::domain::{DepthOutcome, ReviewOrder, SeededRandom, Stage, ThresholdMetric, Verdict};
use crate::report::consensus::{is_disputed, partition_verdicts};
use crate::report::pair_artifacts::{PairArtifacts, group_identical};
use crate::store::Project;

/// Pairs in memory at a time.
const PAGE: usize = 256;
/// Confidence from which on a result is good enough to plant a fault in.
const GOOD: f64 = 0.8;

/// What goes into a deck.
#[derive(Debug, Clone, PartialEq)]
pub struct DeckOptions {
    /// Who reads.
    pub reviewer: String,
    /// Only results of these metrics; of all where there is none. A metric that is not asked for gets no verdict, also
    /// where it looks the same: the accuracy of such a choice would stand for nothing.
    pub metrics: Vec<ThresholdMetric>,
    /// What comes first.
    pub order: ReviewOrder,
    /// Another seed, another order.
    pub seed: u64,
    /// Only so many results, the same for all reviewers.
    pub sample: Option<usize>,
    /// How often the reviewer is tested; not when conflicts are settled.
    pub rates: Rates,
}

impl DeckOptions {
    /// Whether some cards are there to test the reviewer. Then no card tells its pair before it is answered: a pair met
    /// twice would give itself away.
    pub(super) fn tests_the_reviewer(&self) -> bool {
        let Rates { controls, repeats } = self.rates;
        self.order != ReviewOrder::Adjudicate && (controls > 0.0 || repeats > 0.0)
    }
}

/// Cards in order, with what the reviewer has done.
#[derive(Debug, Default)]
pub(super) struct Deck {
    pub(super) cards: Vec<Arc<Card>>,
    pub(super) known: Known,
}

impl Deck {
    /// Reads the deck of a reviewer as the catalog stands.
    ///
    /// # Errors
    /// When the catalog refuses, or a thread is lost.
    pub(super) async fn read(
        catalog: &Catalog,
        project: &Project,
        options: &DeckOptions,
    ) -> Result<Self, DeckError> {
        let key = catalog.review_key().await?;
        let lots = SeededRandom::new(options.seed, &options.reviewer);
        let mut cards = all_cards(catalog, options).await?;
        if let Some(most) = options.sample {
            order::sample(&mut cards, options.order, options.seed, most);
        }
        order::sort(&mut cards, options.order, &lots);
        if options.tests_the_reviewer() {
            let chosen = control::chosen(&cards, &options.rates, &lots);
            let faults = faults(catalog, project, chosen, &lots).await?;
            cards = control::mixed(cards, faults, &options.rates, &lots);
        }
        let cards = cards.into_iter();
        let cards = cards.map(|card| Arc::new(card.named(&key, &options.reviewer)));
        Ok(Self {
            cards: cards.collect(),
            known: Known::read(catalog, options).await?,
        })
    }
}

/// Why there is no deck.
#[derive(Debug, thiserror::Error)]
pub(super) enum DeckError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A thread was lost.
    #[error("planting faults stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

async fn all_cards(catalog: &Catalog, options: &DeckOptions) -> Result<Vec<Card>, CatalogError> {
    let mut cards = Vec::new();
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        for pair in &page {
            cards.extend(cards_of(pair, options));
        }
    }
    Ok(cards)
}

/// The cards of one pair: one for each picture that its results make.
fn cards_of(pair: &PairResults, options: &DeckOptions) -> Vec<Card> {
    let (Some(depth), Some(print)) = (pair.stage(Stage::Depth), pair.stage(Stage::Normalize))
    else {
        return Vec::new();
    };
    let (Ok(outcome), Some(print_hash)) = (depth.parse::<DepthOutcome>(), print.print_hash) else {
        return Vec::new();
    };
    let asked = &options.metrics;
    let is_of_metric =
        |record: &&MetricRecord| asked.is_empty() || asked.contains(&record.outcome.metric);
    // What looks the same and nobody contradicts another on gets no word: such a choice would stand for nothing either.
    let is_asked = |record: &&MetricRecord| {
        options.order != ReviewOrder::Adjudicate || is_open_conflict(record, &options.reviewer)
    };
    let groups = group_identical(pair.metrics.iter().filter(is_of_metric).filter(is_asked));
    let card = |group: Vec<&MetricRecord>| {
        let outcome_of_metric = group[0].outcome;
        Card {
            id: String::new(),
            pair: pair.attributes.name.clone(),
            results: group
                .iter()
                .map(|record| (record.outcome.metric, record.result_hash))
                .collect(),
            control: None,
            view: View {
                print_hash,
                depth_hash: depth.result_hash,
                depth_px: View::size(&outcome),
                level: outcome_of_metric.threshold_level,
                print_from_depth: outcome_of_metric.print_from_depth,
            },
            risk: risk(group[0]),
            is_good: group.iter().all(|record| is_good(record)),
        }
    };
    groups.into_iter().map(card).collect()
}

/// How much speaks against a result: little confidence, little likeness, a search that ended at a bound.
fn risk(record: &MetricRecord) -> f64 {
    let outcome = &record.outcome;
    let doubt = 1.0 - outcome.confidence.unwrap_or(0.5);
    let unlike = 1.0 - outcome.scores.nl_ssim;
    doubt + 0.5 * unlike + if outcome.at_bound { 0.25 } else { 0.0 }
}

/// Whether a fault can be planted in it: nobody failed it and it is sure of itself.
fn is_good(record: &MetricRecord) -> bool {
    let outcome = &record.outcome;
    let mut verdicts = record.verdicts.iter().map(|read| read.verdict);
    outcome
        .confidence
        .is_none_or(|confidence| confidence >= GOOD)
        && !outcome.at_bound
        && verdicts.all(|verdict| verdict == Verdict::Pass)
}

/// Whether others contradict each other on it and nobody else has settled it. Who is party to it cannot settle it.
fn is_open_conflict(record: &MetricRecord, reviewer: &str) -> bool {
    let (words, read) = partition_verdicts(record);
    let is_party = read.iter().any(|read| read.reviewer == reviewer);
    let is_settled = words
        .iter()
        .any(|word| word.reviewer != reviewer && word.verdict != Verdict::Unsure);
    is_disputed(&read) && !is_party && !is_settled
}

/// Faults made from these cards. A pair whose files cannot be read gets none.
async fn faults(
    catalog: &Catalog,
    project: &Project,
    chosen: Vec<&Card>,
    lots: &SeededRandom,
) -> Result<Vec<Card>, DeckError> {
    let mut faults = Vec::with_capacity(chosen.len());
    for card in chosen {
        let Some(detail) = catalog.pair(&card.pair).await? else {
            continue;
        };
        let (project, card, lots) = (project.clone(), card.clone(), lots.clone());
        let fault = tokio::task::spawn_blocking(move || {
            let depth = PairArtifacts::new(&project, &detail.results).depth().ok()?;
            Some(control::plant(&card, &depth, &lots))
        });
        faults.extend(fault.await?);
    }
    Ok(faults)
}

#[cfg(test)]
mod tests {
    use super::{DeckOptions, Rates, cards_of, is_good, is_open_conflict};
    use crate::catalog::ReviewerVerdict;
    use crate::domain::{ReviewOrder, ThresholdMetric, Verdict};
    use crate::report::test_fixtures;

    fn options(order: ReviewOrder, controls: f64, repeats: f64) -> DeckOptions {
        DeckOptions {
            reviewer: "ana".to_owned(),
            metrics: Vec::new(),
            order,
            seed: 1,
            sample: None,
            rates: Rates { controls, repeats },
        }
    }

    fn read(reviewer: &str, verdict: Verdict, order: ReviewOrder) -> ReviewerVerdict {
        ReviewerVerdict {
            reviewer: reviewer.to_owned(),
            verdict,
            reason: None,
            review_order: Some(order),
        }
    }

    #[test]
    fn a_conflict_is_for_a_third_reviewer_until_one_has_settled_it() {
        let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]);
        record.verdicts = vec![read("ana", Verdict::Pass, ReviewOrder::Random)];
        assert!(!is_open_conflict(&record, "chi"));
        record
            .verdicts
            .push(read("bo", Verdict::Fail, ReviewOrder::Random));
        assert!(is_open_conflict(&record, "chi"));
        assert!(!is_open_conflict(&record, "ana"));
        record
            .verdicts
            .push(read("chi", Verdict::Fail, ReviewOrder::Adjudicate));
        assert!(
            is_open_conflict(&record, "chi"),
            "it stays with its adjudicator"
        );
        assert!(!is_open_conflict(&record, "dung"));
    }

    #[test]
    fn no_fault_is_planted_in_what_somebody_failed() {
        let record =
            |verdicts: &[Verdict]| test_fixtures::metric(ThresholdMetric::Density, 0.8, verdicts);
        assert!(is_good(&record(&[])) && is_good(&record(&[Verdict::Pass])));
        assert!(!is_good(&record(&[Verdict::Pass, Verdict::Fail])));
    }

    #[test]
    fn a_pair_without_results_has_no_card() {
        let options = options(ReviewOrder::Random, 0.0, 0.0);
        assert_eq!(cards_of(&test_fixtures::pending("a"), &options), []);
    }

    #[test]
    fn a_deck_tests_the_reviewer_by_faults_or_repeats_but_not_over_conflicts() {
        let tests =
            |order, controls, repeats| options(order, controls, repeats).tests_the_reviewer();
        assert!(
            tests(ReviewOrder::Random, 0.04, 0.0) && tests(ReviewOrder::LeastConfident, 0.0, 0.05)
        );
        assert!(!tests(ReviewOrder::Random, 0.0, 0.0));
        assert!(!tests(ReviewOrder::Adjudicate, 0.04, 0.05));
    }
}
