//! Divides pairs into train, validation and test, so that no group of pairs is in two parts.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde::Serialize;

use super::record::SplitName;
use mocban_catalog::PairAttributes;
use mocban_core::domain::{ContentHash, enum_names};

/// What keeps pairs together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SplitBy {
    /// Pairs of a block stay together. A pair without a block is a group of its own.
    #[default]
    Block,
    /// Pairs of a character stay together. A pair without a character is a group of its own.
    Character,
    /// Every pair is a group of its own.
    Pair,
}

enum_names! {
    pub SplitBy, "a way to group pairs":
    Block = "block", Character = "character", Pair = "pair",
}

/// Shares of train, validation and test in percent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SplitShares(pub [u32; 3]);

/// How pairs are divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SplitSettings {
    /// Share of each part.
    pub shares: SplitShares,
    /// What keeps pairs together.
    pub by: SplitBy,
    /// Seed of the random order of the groups.
    pub seed: u64,
}

impl FromStr for SplitShares {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts: Option<Vec<u32>> = text.split('/').map(|part| part.parse().ok()).collect();
        let shares = match parts.as_deref() {
            Some(&[train, test]) => [train, 0, test],
            Some(&[train, validation, test]) => [train, validation, test],
            _ => [0; 3],
        };
        let sum = shares.iter().map(|share| u64::from(*share)).sum::<u64>();
        if sum == 100 && shares[0] > 0 {
            Ok(Self(shares))
        } else {
            Err(format!(
                "{text:?} is not a split; write percentages that sum to 100, such as 80/10/10 (train, validation, test) or 80/20 (train, test)"
            ))
        }
    }
}

impl SplitBy {
    /// Returns the group of a pair.
    pub(super) fn group(self, pair: &PairAttributes) -> SplitGroup {
        let shared = match self {
            Self::Block => pair.block.as_deref(),
            Self::Character => pair.character.as_deref(),
            Self::Pair => None,
        };
        match shared.filter(|name| !name.is_empty()) {
            Some(name) => (false, name.to_owned()),
            None => (true, pair.name.as_str().to_owned()),
        }
    }
}

/// Difference between the requested and the real share of a part, in percent points, above which a split is uneven.
const UNEVEN: f64 = 10.0;

/// Numbers of pairs in the parts of a split.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SplitCounts {
    wanted: SplitShares,
    /// Pairs in train, validation and test.
    pub pairs: [u64; 3],
}

impl SplitCounts {
    pub(super) const fn new(wanted: SplitShares) -> Self {
        Self {
            wanted,
            pairs: [0; 3],
        }
    }

    pub(super) const fn add(&mut self, part: SplitName) {
        self.pairs[part as usize] += 1;
    }

    /// Returns whether the share of a part differs from the requested one by more than 10 percent points, or a requested
    /// part is empty. Few or large groups are the reason.
    pub fn is_uneven(&self) -> bool {
        let total = self.pairs.iter().sum::<u64>().max(1) as f64;
        let mut parts = self.pairs.into_iter().zip(self.wanted.0);
        parts.any(|(pairs, wanted)| {
            let share = 100.0 * pairs as f64 / total;
            (share - f64::from(wanted)).abs() > UNEVEN || (pairs == 0 && wanted > 0)
        })
    }
}

/// A group of pairs: whether it is a single pair, and its name.
pub(super) type SplitGroup = (bool, String);

/// The part of each group of pairs.
#[derive(Debug, Clone)]
pub(super) struct SplitPlan {
    by: SplitBy,
    parts: BTreeMap<SplitGroup, SplitName>,
}

impl SplitPlan {
    /// Assigns groups, given with their numbers of pairs, to parts.
    ///
    /// Takes the groups in random order, and gives each to the part that lacks the most pairs. A part with a share stays
    /// empty only if there are fewer groups than such parts.
    pub(super) fn new(settings: &SplitSettings, groups: &BTreeMap<SplitGroup, u64>) -> Self {
        const NAMES: [SplitName; 3] = [SplitName::Train, SplitName::Validation, SplitName::Test];
        let mut order: Vec<_> = groups.iter().collect();
        order.sort_by_cached_key(|(group, _)| {
            let text = format!("{}\n{}\n{}", settings.seed, group.0, group.1);
            ContentHash::of(text.as_bytes())
        });
        let total = groups.values().sum::<u64>() as f64;
        let mut lacking = settings
            .shares
            .0
            .map(|share| total * f64::from(share) / 100.0);
        let mut is_empty = settings.shares.0.map(|share| share > 0);
        let mut parts = BTreeMap::new();
        for (i, (group, size)) in order.iter().enumerate() {
            let left = order.len() - i;
            let must_fill = is_empty.iter().filter(|empty| **empty).count() >= left;
            let candidates =
                (0..3).filter(|k| settings.shares.0[*k] > 0 && (!must_fill || is_empty[*k]));
            let part = candidates
                .reduce(|best, k| if lacking[k] > lacking[best] { k } else { best })
                .expect("the first part has a share");
            lacking[part] -= **size as f64;
            is_empty[part] = false;
            parts.insert((*group).clone(), NAMES[part]);
        }
        Self {
            by: settings.by,
            parts,
        }
    }

    /// Returns the part of a pair. A pair that was imported after the plan was made belongs to none.
    pub(super) fn part(&self, pair: &PairAttributes) -> Option<SplitName> {
        self.parts.get(&self.by.group(pair)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::{SplitBy, SplitCounts, SplitName, SplitPlan, SplitSettings, SplitShares};
    use mocban_results::test_fixtures;
    use std::collections::BTreeMap;

    fn settings(shares: &str, seed: u64) -> SplitSettings {
        SplitSettings {
            shares: shares.parse().expect("shares"),
            by: SplitBy::Block,
            seed,
        }
    }

    fn blocks(count: usize) -> BTreeMap<(bool, String), u64> {
        (0..count)
            .map(|i| ((false, format!("b{i:02}")), 10))
            .collect()
    }

    fn sizes(plan: &SplitPlan) -> [usize; 3] {
        [SplitName::Train, SplitName::Validation, SplitName::Test]
            .map(|name| plan.parts.values().filter(|part| **part == name).count())
    }

    #[test]
    fn blocks_are_divided_by_their_shares_and_the_seed() {
        let plan = SplitPlan::new(&settings("80/10/10", 7), &blocks(20));
        assert_eq!(sizes(&plan), [16, 2, 2]);
        let same = SplitPlan::new(&settings("80/10/10", 7), &blocks(20));
        assert_eq!(plan.parts, same.parts);
        let other = SplitPlan::new(&settings("80/10/10", 8), &blocks(20));
        assert_ne!(plan.parts, other.parts);
        assert_eq!(
            sizes(&SplitPlan::new(&settings("50/50", 0), &blocks(8))),
            [4, 0, 4]
        );
    }

    #[test]
    fn few_blocks_still_fill_every_part() {
        assert_eq!(
            sizes(&SplitPlan::new(&settings("80/10/10", 1), &blocks(3))),
            [1; 3]
        );
        assert_eq!(
            sizes(&SplitPlan::new(&settings("80/10/10", 1), &blocks(1))),
            [1, 0, 0]
        );
    }

    #[test]
    fn pairs_of_a_block_are_in_the_same_part_and_others_alone() {
        let mut pair = test_fixtures::pending("a").attributes;
        assert_eq!(SplitBy::Block.group(&pair), (true, "a".to_owned()));
        pair.block = Some("a".to_owned());
        assert_eq!(SplitBy::Block.group(&pair), (false, "a".to_owned()));
        assert_eq!(SplitBy::Character.group(&pair), (true, "a".to_owned()));
    }

    #[test]
    fn a_split_is_uneven_if_a_part_is_empty_or_far_from_its_share() {
        let of = |pairs| SplitCounts {
            wanted: SplitShares([80, 10, 10]),
            pairs,
        };
        assert!(!of([80, 10, 10]).is_uneven());
        assert!(!of([71, 19, 10]).is_uneven());
        assert!(of([69, 21, 10]).is_uneven());
        assert!(of([90, 10, 0]).is_uneven());
        assert!(of([5, 5, 0]).is_uneven());
    }

    #[test]
    fn shares_must_sum_to_100() {
        assert_eq!("80/20".parse(), Ok(SplitShares([80, 0, 20])));
        for text in ["80/10", "0/50/50", "80-20", "50/25/25/0", "", "-1/101"] {
            assert!(text.parse::<SplitShares>().is_err(), "{text}");
        }
    }
}
