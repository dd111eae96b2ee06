//! In which order cards come: by lot from a seed and the reviewer's name, or the least confident first.

use crate::domain::{ReviewOrder, SeededRandom};

use super::card::Card;

/// Sorts cards of results into the order in which they are shown.
pub(super) fn sort(cards: &mut [Card], order: ReviewOrder, lots: &SeededRandom) {
    let lot = |card: &Card| lots.draw(&card.view.seen(), "order");
    cards.sort_by_cached_key(|card| OrderKey {
        risk: match order {
            ReviewOrder::Random | ReviewOrder::Adjudicate => 0.0,
            ReviewOrder::LeastConfident => -card.risk,
        },
        lot: lot(card),
    });
}

/// Keeps so many cards, the same whoever reads: what two are given the same number of, both have read.
pub(super) fn sample(cards: &mut Vec<Card>, order: ReviewOrder, seed: u64, most: usize) {
    sort(cards, order, &SeededRandom::new(seed, "sample"));
    cards.truncate(most);
}

/// By risk, then by lot.
#[derive(Debug, PartialEq)]
struct OrderKey {
    risk: f64,
    lot: f64,
}

impl Eq for OrderKey {}

impl PartialOrd for OrderKey {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OrderKey {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let by_risk = self.risk.total_cmp(&other.risk);
        by_risk.then(self.lot.total_cmp(&other.lot))
    }
}

#[cfg(test)]
mod tests {
    use super::{sample, sort};
    use crate::domain::{ReviewOrder, SeededRandom};
    use crate::review::card::test_fixtures::card;

    fn order(order: ReviewOrder, seed: u64, reviewer: &str) -> Vec<String> {
        let mut cards: Vec<_> = (0..50).map(card).collect();
        for (i, card) in cards.iter_mut().enumerate() {
            card.risk = i as f64;
        }
        sort(&mut cards, order, &SeededRandom::new(seed, reviewer));
        cards.iter().map(|card| card.pair.to_string()).collect()
    }

    #[test]
    fn two_reviewers_get_the_same_sample_in_orders_of_their_own() {
        let read = |reviewer: &str| {
            let mut cards: Vec<_> = (0..50).map(card).collect();
            sample(&mut cards, ReviewOrder::Random, 1, 10);
            sort(
                &mut cards,
                ReviewOrder::Random,
                &SeededRandom::new(1, reviewer),
            );
            let names = cards.iter().map(|card| card.pair.to_string());
            names.collect::<Vec<_>>()
        };
        let (mut ana, mut bo) = (read("ana"), read("bo"));
        assert_ne!(ana, bo);
        ana.sort();
        bo.sort();
        assert_eq!(ana, bo);
        assert_eq!(ana.len(), 10);
    }

    #[test]
    fn order_is_by_seed_and_reviewer() {
        let first = order(ReviewOrder::Random, 1, "ana");
        assert_eq!(first, order(ReviewOrder::Random, 1, "ana"));
        assert_ne!(first, order(ReviewOrder::Random, 2, "ana"));
        assert_ne!(first, order(ReviewOrder::Random, 1, "bo"));
        assert_eq!(
            order(ReviewOrder::LeastConfident, 1, "ana")[..2],
            ["p49", "p48"]
        );
    }

    #[test]
    fn a_new_card_leaves_the_order_of_the_others() {
        let lots = SeededRandom::new(1, "ana");
        let names = |count: u16| {
            let mut cards: Vec<_> = (0..count).map(card).collect();
            sort(&mut cards, ReviewOrder::Random, &lots);
            let old = cards.iter().filter(|card| card.pair.as_str() != "p30");
            old.map(|card| card.pair.to_string()).collect::<Vec<_>>()
        };
        assert_eq!(names(30), names(31));
    }
}
