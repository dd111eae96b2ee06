//! The joint verdict of all reviewers on one result.

use mocban_catalog::{MetricRecord, ReviewerVerdict};
use mocban_core::domain::{ReviewOrder, Verdict};

/// The joint verdict of all reviewers on a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consensus {
    /// Nobody judged this or an earlier result.
    Unjudged,
    /// Only an earlier result was judged.
    Stale,
    /// At least one reviewer passed the result and none failed it, or a conflict was adjudicated as a pass.
    Passed,
    /// At least one reviewer failed the result and none passed it, or a conflict was adjudicated as a fail.
    Failed,
    /// All reviewers were unsure.
    Unsure,
    /// Some reviewers passed the result and some failed it. The result counts as unsure until it is adjudicated.
    Conflict,
}

impl Consensus {
    /// Returns the consensus on a current result.
    pub fn of(record: &MetricRecord) -> Self {
        let (adjudications, independent) = partition_verdicts(record);
        let decides = |verdict: &&ReviewerVerdict| verdict.verdict != Verdict::Unsure;
        let is_settled = is_disputed(&independent) && adjudications.iter().any(decides);
        let deciding: Vec<&ReviewerVerdict> = if is_settled {
            adjudications
        } else {
            record.verdicts.iter().collect()
        };
        let any = |wanted| deciding.iter().any(|verdict| verdict.verdict == wanted);
        match (any(Verdict::Pass), any(Verdict::Fail)) {
            (true, true) => Self::Conflict,
            (true, false) => Self::Passed,
            (false, true) => Self::Failed,
            (false, false) if any(Verdict::Unsure) => Self::Unsure,
            (false, false) if record.older_verdicts > 0 => Self::Stale,
            (false, false) => Self::Unjudged,
        }
    }

    /// Returns the equivalent verdict, or `None` if nobody judged the current result.
    pub const fn verdict(self) -> Option<Verdict> {
        match self {
            Self::Passed => Some(Verdict::Pass),
            Self::Failed => Some(Verdict::Fail),
            Self::Unsure | Self::Conflict => Some(Verdict::Unsure),
            Self::Unjudged | Self::Stale => None,
        }
    }

    /// Returns whether the result passed, or `None` if the reviewers did not decide.
    pub const fn passed(self) -> Option<bool> {
        match self {
            Self::Passed => Some(true),
            Self::Failed => Some(false),
            Self::Unsure | Self::Conflict | Self::Unjudged | Self::Stale => None,
        }
    }
}

/// Splits verdicts into adjudications, made by reviewers who saw the conflicting verdicts, and independent verdicts.
pub fn partition_verdicts(record: &MetricRecord) -> (Vec<&ReviewerVerdict>, Vec<&ReviewerVerdict>) {
    let is_adjudication =
        |verdict: &&ReviewerVerdict| verdict.review_order == Some(ReviewOrder::Adjudicate);
    record.verdicts.iter().partition(is_adjudication)
}

/// Returns whether one reviewer passes what another fails.
fn is_disputed(verdicts: &[&ReviewerVerdict]) -> bool {
    let any = |wanted| verdicts.iter().any(|verdict| verdict.verdict == wanted);
    any(Verdict::Pass) && any(Verdict::Fail)
}

/// Returns whether a result is in conflict and this reviewer may settle it: the reviewer is no party to the conflict, and no
/// other reviewer has settled it.
pub fn is_open_conflict(record: &MetricRecord, reviewer: &str) -> bool {
    let (rulings, verdicts) = partition_verdicts(record);
    let is_party = verdicts.iter().any(|read| read.reviewer == reviewer);
    let is_settled = rulings
        .iter()
        .any(|ruling| ruling.reviewer != reviewer && ruling.verdict != Verdict::Unsure);
    is_disputed(&verdicts) && !is_party && !is_settled
}

#[cfg(test)]
mod tests {
    use super::{Consensus, is_open_conflict};
    use crate::test_fixtures;
    use mocban_catalog::ReviewerVerdict;
    use mocban_core::domain::{ReviewOrder, ThresholdMetric, Verdict};

    fn consensus(verdicts: &[Verdict], older: u64) -> Consensus {
        let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, verdicts);
        record.older_verdicts = older;
        Consensus::of(&record)
    }

    #[test]
    fn unsure_reviewers_leave_the_decision_to_the_others() {
        assert_eq!(
            consensus(&[Verdict::Unsure, Verdict::Pass], 0),
            Consensus::Passed
        );
        assert_eq!(
            consensus(&[Verdict::Fail, Verdict::Unsure], 0),
            Consensus::Failed
        );
        assert_eq!(consensus(&[Verdict::Unsure], 0), Consensus::Unsure);
    }

    #[test]
    fn a_conflict_counts_as_unsure() {
        let both = consensus(&[Verdict::Fail, Verdict::Pass], 0);
        assert_eq!(both, Consensus::Conflict);
        assert_eq!(both.verdict(), Some(Verdict::Unsure));
    }

    #[test]
    fn an_adjudication_settles_a_conflict_unless_it_is_unsure_or_disputed() {
        let settled = |adjudications: &[Verdict]| {
            let verdicts = [&[Verdict::Pass, Verdict::Fail], adjudications].concat();
            let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, &verdicts);
            for adjudication in &mut record.verdicts[2..] {
                adjudication.review_order = Some(ReviewOrder::Adjudicate);
            }
            Consensus::of(&record)
        };
        assert_eq!(settled(&[Verdict::Fail]), Consensus::Failed);
        assert_eq!(
            settled(&[Verdict::Pass, Verdict::Unsure]),
            Consensus::Passed
        );
        assert_eq!(settled(&[Verdict::Unsure]), Consensus::Conflict);
        assert_eq!(
            settled(&[Verdict::Pass, Verdict::Fail]),
            Consensus::Conflict
        );
    }

    #[test]
    fn a_verdict_on_an_older_result_is_no_verdict() {
        assert_eq!(consensus(&[], 2), Consensus::Stale);
        assert_eq!(consensus(&[], 0), Consensus::Unjudged);
        assert_eq!(consensus(&[Verdict::Pass], 2), Consensus::Passed);
        assert_eq!(Consensus::Stale.verdict(), None);
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
    fn a_conflict_is_open_to_third_reviewers_until_one_settles_it() {
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
}
