//! Order of the items: a seeded shuffle per reviewer, or the least confident items first.

use std::cmp::Reverse;

use super::item::ReviewItem;
use mocban_core::domain::{ReviewOrder, SeededRandom};

/// Sorts items into the order in which they are shown.
pub(super) fn sort(items: &mut [ReviewItem], order: ReviewOrder, random: &SeededRandom) {
    items.sort_by_cached_key(|item| {
        let uncertainty = match order {
            ReviewOrder::Random | ReviewOrder::Adjudicate => 0.0,
            ReviewOrder::LeastConfident => item.uncertainty,
        };
        let number = random.draw(&item.view.hash(), "order");
        // The bits of non-negative numbers sort like the numbers.
        (Reverse(uncertainty.max(0.0).to_bits()), number.to_bits())
    });
}

/// Keeps the first `count` items of an order that is the same for all reviewers, so that all judge the same items.
/// Returns the other items.
pub(super) fn sample(
    items: &mut Vec<ReviewItem>,
    order: ReviewOrder,
    seed: u64,
    count: usize,
) -> Vec<ReviewItem> {
    sort(items, order, &SeededRandom::new(seed, "sample"));
    items.split_off(count.min(items.len()))
}

#[cfg(test)]
mod tests {
    use super::{sample, sort};
    use crate::review::item::test_fixtures::item;
    use mocban_core::domain::{ReviewOrder, SeededRandom};

    fn order(order: ReviewOrder, seed: u64, reviewer: &str) -> Vec<String> {
        let mut items: Vec<_> = (0..50).map(item).collect();
        for (i, item) in items.iter_mut().enumerate() {
            item.uncertainty = i as f64;
        }
        sort(&mut items, order, &SeededRandom::new(seed, reviewer));
        items.iter().map(|item| item.pair.to_string()).collect()
    }

    #[test]
    fn two_reviewers_get_the_same_sample_in_different_orders() {
        let sampled = |reviewer: &str| {
            let mut items: Vec<_> = (0..50).map(item).collect();
            let others = sample(&mut items, ReviewOrder::Random, 1, 10);
            assert_eq!(others.len(), 40);
            sort(
                &mut items,
                ReviewOrder::Random,
                &SeededRandom::new(1, reviewer),
            );
            let names = items.iter().map(|item| item.pair.to_string());
            names.collect::<Vec<_>>()
        };
        let (mut ana, mut bo) = (sampled("ana"), sampled("bo"));
        assert_ne!(ana, bo);
        ana.sort();
        bo.sort();
        assert_eq!(ana, bo);
        assert_eq!(ana.len(), 10);
    }

    #[test]
    fn order_depends_on_seed_and_reviewer() {
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
    fn a_new_item_does_not_change_the_order_of_the_others() {
        let random = SeededRandom::new(1, "ana");
        let names = |count: u16| {
            let mut items: Vec<_> = (0..count).map(item).collect();
            sort(&mut items, ReviewOrder::Random, &random);
            let old = items.iter().filter(|item| item.pair.as_str() != "p30");
            old.map(|item| item.pair.to_string()).collect::<Vec<_>>()
        };
        assert_eq!(names(30), names(31));
    }
}
