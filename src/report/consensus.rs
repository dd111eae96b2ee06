//! What all reviewers together say of one result.

use crate::catalog::{MetricRecord, ReviewerVerdict};
use crate::domain::{ReviewOrder, Verdict};

/// Where a result stands with its reviewers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consensus {
    /// Nobody has read it or an earlier result.
    Unread,
    /// An earlier result was read, this one was not.
    Stale,
    /// Every reviewer who could tell passed it, or who settled what they contradict each other on.
    Passed,
    /// Every reviewer who could tell failed it, or who settled what they contradict each other on.
    Failed,
    /// No reviewer could tell.
    Unsure,
    /// Some passed it and some failed it; it counts as unsure until they agree or somebody has settled it.
    Conflict,
}

impl Consensus {
    /// The standing of a current result.
    pub fn of(record: &MetricRecord) -> Self {
        let (words, read) = split(record);
        let all = || record.verdicts.iter().collect();
        let is_settled =
            contradict(&read) && words.iter().any(|word| word.verdict != Verdict::Unsure);
        let deciding: Vec<&ReviewerVerdict> = if is_settled { words } else { all() };
        let says = |verdict| deciding.iter().any(|read| read.verdict == verdict);
        match (says(Verdict::Pass), says(Verdict::Fail)) {
            (true, true) => Self::Conflict,
            (true, false) => Self::Passed,
            (false, true) => Self::Failed,
            (false, false) if says(Verdict::Unsure) => Self::Unsure,
            (false, false) if record.older_verdicts > 0 => Self::Stale,
            (false, false) => Self::Unread,
        }
    }

    /// The verdict it amounts to; `None` where nobody has read the current result.
    pub const fn verdict(self) -> Option<Verdict> {
        match self {
            Self::Passed => Some(Verdict::Pass),
            Self::Failed => Some(Verdict::Fail),
            Self::Unsure | Self::Conflict => Some(Verdict::Unsure),
            Self::Unread | Self::Stale => None,
        }
    }

    /// Right or wrong, where reviewers have told.
    pub const fn told(self) -> Option<bool> {
        match self {
            Self::Passed => Some(true),
            Self::Failed => Some(false),
            Self::Unsure | Self::Conflict | Self::Unread | Self::Stale => None,
        }
    }
}

/// The words of those who were shown a conflict to settle it, and the verdicts of those who read by themselves.
pub(crate) fn split(record: &MetricRecord) -> (Vec<&ReviewerVerdict>, Vec<&ReviewerVerdict>) {
    let is_word = |read: &&ReviewerVerdict| read.review_order == Some(ReviewOrder::Adjudicate);
    record.verdicts.iter().partition(is_word)
}

/// Whether one passes what another fails.
pub(crate) fn contradict(verdicts: &[&ReviewerVerdict]) -> bool {
    let says = |verdict| verdicts.iter().any(|read| read.verdict == verdict);
    says(Verdict::Pass) && says(Verdict::Fail)
}

#[cfg(test)]
mod tests {
    use super::Consensus;
    use crate::domain::{ReviewOrder, ThresholdMetric, Verdict};
    use crate::report::test_fixtures;

    fn standing(verdicts: &[Verdict], older: u64) -> Consensus {
        let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, verdicts);
        record.older_verdicts = older;
        Consensus::of(&record)
    }

    #[test]
    fn reviewers_who_cannot_tell_leave_the_word_to_those_who_can() {
        assert_eq!(
            standing(&[Verdict::Unsure, Verdict::Pass], 0),
            Consensus::Passed
        );
        assert_eq!(
            standing(&[Verdict::Fail, Verdict::Unsure], 0),
            Consensus::Failed
        );
        assert_eq!(standing(&[Verdict::Unsure], 0), Consensus::Unsure);
    }

    #[test]
    fn contradiction_counts_as_unsure() {
        let both = standing(&[Verdict::Fail, Verdict::Pass], 0);
        assert_eq!(both, Consensus::Conflict);
        assert_eq!(both.verdict(), Some(Verdict::Unsure));
    }

    #[test]
    fn the_word_on_a_conflict_settles_it_unless_it_is_unsure_or_contradicted() {
        let settled = |words: &[Verdict]| {
            let verdicts = [&[Verdict::Pass, Verdict::Fail], words].concat();
            let mut record = test_fixtures::metric(ThresholdMetric::Density, 0.8, &verdicts);
            for word in &mut record.verdicts[2..] {
                word.review_order = Some(ReviewOrder::Adjudicate);
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
    fn verdict_on_an_older_result_is_no_verdict() {
        assert_eq!(standing(&[], 2), Consensus::Stale);
        assert_eq!(standing(&[], 0), Consensus::Unread);
        assert_eq!(standing(&[Verdict::Pass], 2), Consensus::Passed);
        assert_eq!(Consensus::Stale.verdict(), None);
    }
}
