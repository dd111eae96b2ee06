//! Acc under different rules for results on which reviewers disagree.

use serde::Serialize;

use mocban_catalog::MetricRecord;
use mocban_core::domain::Verdict;
use mocban_results::consensus::{Consensus, partition_verdicts};
use mocban_results::stats::{IntervalMethod, Rate};

/// Acc of a metric under three rules for disagreement. Each rule decides which results pass, fail or are left out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct AdjudicationRules {
    /// Results that at least two reviewers independently passed or failed. If there are none, all three rules agree.
    pub double_read: u64,
    /// A result fails if any reviewer fails it.
    pub either_fails: Rate,
    /// A disputed result counts as the adjudicator decided. Undecided results are left out. This rate is
    /// `MetricRow::acc`.
    pub adjudicated: Rate,
    /// A result fails only if every reviewer who decided fails it.
    pub both_fail: Rate,
}

impl AdjudicationRules {
    /// Returns the rates in the order any, adjudicated, all.
    pub const fn rates(&self) -> [Rate; 3] {
        [self.either_fails, self.adjudicated, self.both_fail]
    }

    /// Counts one result.
    pub(super) fn add(&mut self, record: &MetricRecord) {
        let independent = partition_verdicts(record).1;
        let count_of = |wanted| {
            let given = independent.iter().filter(|given| given.verdict == wanted);
            given.count()
        };
        let (passes, fails) = (count_of(Verdict::Pass), count_of(Verdict::Fail));
        self.double_read += u64::from(passes + fails > 1);
        if passes + fails > 0 {
            self.either_fails.add(fails == 0);
            self.both_fail.add(passes > 0);
        }
        if let Some(passed) = Consensus::of(record).passed() {
            self.adjudicated.add(passed);
        }
    }

    /// Computes the intervals by `method`.
    pub(super) fn set_interval(&mut self, method: IntervalMethod) {
        for rate in [
            &mut self.either_fails,
            &mut self.adjudicated,
            &mut self.both_fail,
        ] {
            rate.set_interval(method);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::AdjudicationRules;
    use crate::test_fixtures;
    use mocban_core::domain::Verdict::{self, Fail, Pass, Unsure};
    use mocban_core::domain::{ReviewOrder, ThresholdMetric};

    fn of(results: &[(&[Verdict], Option<Verdict>)]) -> AdjudicationRules {
        let mut rules = AdjudicationRules::default();
        for (own, adjudication) in results {
            let verdicts: Vec<Verdict> = own.iter().copied().chain(*adjudication).collect();
            let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, &verdicts);
            for settled in &mut record.verdicts[own.len()..] {
                settled.review_order = Some(ReviewOrder::Adjudicate);
            }
            rules.add(&record);
        }
        rules
    }

    #[test]
    fn a_settled_conflict_fails_by_any_passes_by_all_and_follows_the_adjudication() {
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
    fn an_open_conflict_is_left_out_of_the_adjudicated_rate_only() {
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
        assert_eq!(found.double_read, 1);
    }

    #[test]
    fn without_verdicts_there_is_no_share() {
        assert_eq!(of(&[(&[], None)]).either_fails.share, None);
    }
}
