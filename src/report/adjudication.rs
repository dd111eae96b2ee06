//! What becomes of Acc when reviewers contradict each other: three ways to count, side by side.

use serde::Serialize;

use super::consensus::{Consensus, split};
use super::interval::IntervalMethod;
use super::rate::Rate;
use crate::catalog::MetricRecord;
use crate::domain::Verdict;

/// Passed results under each rule, of those that passed or failed under it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AdjudicationRules {
    /// Results that two reviewers or more have passed or failed by themselves; where there are none, all rules say the
    /// same.
    pub told_twice: u64,
    /// One reviewer who fails it is enough.
    pub either_fails: Rate,
    /// Reviewers agree, or somebody settled it; a conflict that waits is left out. This is the Acc of the table.
    pub adjudicated: Rate,
    /// All reviewers who could tell fail it.
    pub both_fail: Rate,
}

impl AdjudicationRules {
    /// Names of the rules, in their order.
    pub const NAMES: [&str; 3] = ["either_fails", "adjudicated", "both_fail"];

    /// What follows from each rule, in the order of [`Self::NAMES`].
    pub const fn rates(&self) -> [Rate; 3] {
        [self.either_fails, self.adjudicated, self.both_fail]
    }

    /// The same with another interval.
    pub(super) fn with_interval(self, interval: IntervalMethod) -> Self {
        Self {
            told_twice: self.told_twice,
            either_fails: self.either_fails.with_interval(interval),
            adjudicated: self.adjudicated.with_interval(interval),
            both_fail: self.both_fail.with_interval(interval),
        }
    }
}

/// The sums so far: passed and told under each rule.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AdjudicationSums {
    told_twice: u64,
    either_fails: [u64; 2],
    adjudicated: [u64; 2],
    both_fail: [u64; 2],
}

impl AdjudicationSums {
    /// Counts one result in.
    pub(super) fn add(&mut self, record: &MetricRecord) {
        let own = split(record).1;
        let said = |wanted| own.iter().filter(|read| read.verdict == wanted).count();
        let (passes, fails) = (said(Verdict::Pass), said(Verdict::Fail));
        self.told_twice += u64::from(passes + fails > 1);
        if passes + fails > 0 {
            count(&mut self.either_fails, fails == 0);
            count(&mut self.both_fail, passes > 0);
        }
        if let Some(passed) = Consensus::of(record).told() {
            count(&mut self.adjudicated, passed);
        }
    }

    /// The shares that follow.
    pub(super) fn finish(self) -> AdjudicationRules {
        let rate = |[passed, told]: [u64; 2]| Rate::new(passed, told);
        AdjudicationRules {
            told_twice: self.told_twice,
            either_fails: rate(self.either_fails),
            adjudicated: rate(self.adjudicated),
            both_fail: rate(self.both_fail),
        }
    }
}

fn count([passed, told]: &mut [u64; 2], is_passed: bool) {
    *passed += u64::from(is_passed);
    *told += 1;
}

#[cfg(test)]
mod tests {
    use super::{AdjudicationRules, AdjudicationSums};
    use crate::domain::Verdict::{self, Fail, Pass, Unsure};
    use crate::domain::{ReviewOrder, ThresholdMetric};
    use crate::report::test_fixtures;

    fn of(results: &[(&[Verdict], Option<Verdict>)]) -> AdjudicationRules {
        let mut sums = AdjudicationSums::default();
        for (own, word) in results {
            let verdicts: Vec<Verdict> = own.iter().copied().chain(*word).collect();
            let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, &verdicts);
            for settled in &mut record.verdicts[own.len()..] {
                settled.review_order = Some(ReviewOrder::Adjudicate);
            }
            sums.add(&record);
        }
        sums.finish()
    }

    #[test]
    fn a_settled_conflict_fails_for_either_passes_for_both_and_follows_the_word() {
        let found = of(&[
            (&[Pass, Pass], None),
            (&[Pass, Fail], Some(Fail)),
            (&[Fail, Fail], None),
        ]);
        let counts = [found.either_fails, found.adjudicated, found.both_fail];
        assert_eq!(
            counts.map(|rate| (rate.count, rate.n)),
            [(1, 3), (1, 3), (2, 3)]
        );
        let passed = of(&[(&[Pass, Fail], Some(Pass))]);
        assert_eq!(passed.adjudicated.count, 1);
        assert_eq!(passed.either_fails.count, 0);
    }

    #[test]
    fn a_conflict_that_waits_is_left_out_of_the_adjudicated_only() {
        let found = of(&[
            (&[Pass, Fail], None),
            (&[Pass, Unsure], None),
            (&[Unsure], None),
        ]);
        let counts = [found.either_fails, found.adjudicated, found.both_fail];
        assert_eq!(
            counts.map(|rate| (rate.count, rate.n)),
            [(1, 2), (1, 1), (2, 2)]
        );
        assert_eq!(found.told_twice, 1);
    }

    #[test]
    fn without_verdicts_there_is_no_share() {
        assert_eq!(of(&[(&[], None)]).either_fails.share, None);
    }
}
