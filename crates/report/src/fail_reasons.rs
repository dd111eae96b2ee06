//! Why reviewers failed results.

use serde::Serialize;

use mocban_catalog::{MetricRecord, ReviewerVerdict};
use mocban_core::domain::{Reason, Verdict};
use mocban_results::consensus::Consensus;

/// The number of failed results for which a reason was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FailReasonCount {
    /// The reason. `None` for results without any.
    pub reason: Option<Reason>,
    /// Number of results.
    pub count: u64,
}

/// Numbers of failed results by reason, in the order of [`Reason::ALL`]. The last number counts results without a
/// reason.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FailReasonSums([u64; Reason::ALL.len() + 1]);

impl FailReasonSums {
    /// Counts one result, if it failed: once for each reason given.
    pub(super) fn add(&mut self, record: &MetricRecord) {
        if Consensus::of(record) != Consensus::Failed {
            return;
        }
        let fails = |given: &&ReviewerVerdict| given.verdict == Verdict::Fail;
        let given = record.verdicts.iter().filter(fails);
        let reasons: Vec<Reason> = given.filter_map(|given| given.reason).collect();
        for (count, reason) in self.0.iter_mut().zip(Reason::ALL) {
            *count += u64::from(reasons.contains(&reason));
        }
        self.0[Reason::ALL.len()] += u64::from(reasons.is_empty());
    }

    /// Returns the counts that are not 0.
    pub(super) fn finish(self) -> Vec<FailReasonCount> {
        let reasons = Reason::ALL.into_iter().map(Some).chain([None]);
        reasons
            .zip(self.0)
            .filter(|(_, count)| *count > 0)
            .map(|(reason, count)| FailReasonCount { reason, count })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{FailReasonCount, FailReasonSums};
    use crate::test_fixtures;
    use mocban_core::domain::Reason::{Angle, Mirrored};
    use mocban_core::domain::Verdict::{Fail, Pass};
    use mocban_core::domain::{Reason, ThresholdMetric};

    #[test]
    fn a_failed_result_counts_once_for_each_reason_and_a_passed_one_not_at_all() {
        let mut reasons = FailReasonSums::default();
        let mut add = |verdicts: &[_], given: &[Option<Reason>]| {
            let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, verdicts);
            for (read, reason) in record.verdicts.iter_mut().zip(given) {
                read.reason = *reason;
            }
            reasons.add(&record);
        };
        add(&[Fail, Fail], &[Some(Angle), Some(Angle)]);
        add(&[Fail, Fail], &[Some(Angle), Some(Mirrored)]);
        add(&[Fail], &[None]);
        add(&[Pass, Fail], &[None, Some(Mirrored)]);
        let count = |reason, count| FailReasonCount { reason, count };
        let wanted = [
            count(Some(Angle), 2),
            count(Some(Mirrored), 1),
            count(None, 1),
        ];
        assert_eq!(reasons.finish(), wanted);
    }
}
