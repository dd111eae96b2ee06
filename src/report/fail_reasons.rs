//! Why reviewers failed results.

use serde::Serialize;

use super::consensus::{Consensus, split};
use crate::catalog::{MetricRecord, ReviewerVerdict};
use crate::domain::{Reason, Verdict};

/// Failed results for which a reason was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FailReasonCount {
    /// The reason; `None` where nobody gave one.
    pub reason: Option<Reason>,
    /// How many.
    pub count: u64,
}

/// The counts so far: the reasons in their order, then those without.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FailReasonSums([u64; Reason::ALL.len() + 1]);

impl FailReasonSums {
    /// Counts one result in, if it failed: once for each reason that was given.
    pub(super) fn add(&mut self, record: &MetricRecord) {
        if Consensus::of(record) != Consensus::Failed {
            return;
        }
        let (words, own) = split(record);
        let failing = |read: &&ReviewerVerdict| read.verdict == Verdict::Fail;
        let given: Vec<Reason> = words
            .into_iter()
            .chain(own)
            .filter(failing)
            .filter_map(|read| read.reason)
            .collect();
        for (count, reason) in self.0.iter_mut().zip(Reason::ALL) {
            *count += u64::from(given.contains(&reason));
        }
        self.0[Reason::ALL.len()] += u64::from(given.is_empty());
    }

    /// The reasons that were given, in their order; those without last.
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
    use crate::domain::Reason::{Angle, Mirrored};
    use crate::domain::Verdict::{Fail, Pass};
    use crate::domain::{Reason, ThresholdMetric};
    use crate::report::test_fixtures;

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
