//! What all reviewers together say of results, as a condition of lists of pairs.

use mocban_core::domain::{Verdict, enum_names};

/// What all reviewers together say of the current result of a metric, as a report counts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointVerdict {
    /// Somebody passed the result and nobody failed it, or a conflict was adjudicated as a pass.
    Passed,
    /// Somebody failed the result and nobody passed it, or a conflict was adjudicated as a fail.
    Failed,
    /// Passed or failed.
    Decided,
    /// Some passed the result, others failed it, and no adjudication has settled that.
    Conflict,
    /// All were unsure.
    Unsure,
    /// Nobody judged this result, but an earlier one.
    Stale,
}

enum_names! { pub JointVerdict, "a joint verdict":
Passed = "joint-pass", Failed = "joint-fail", Decided = "decided", Conflict = "conflict", Unsure = "joint-unsure", Stale = "stale" }

impl JointVerdict {
    /// Returns a verdict that somebody gave on each of these results, if there is one.
    pub(super) const fn given(self) -> Option<Verdict> {
        match self {
            Self::Passed => Some(Verdict::Pass),
            Self::Failed | Self::Conflict => Some(Verdict::Fail),
            Self::Unsure => Some(Verdict::Unsure),
            Self::Decided | Self::Stale => None,
        }
    }

    /// Returns one bit for each number that `standing_of_verdicts` gives to these results.
    pub(super) const fn standings(self) -> i64 {
        match self {
            Self::Passed => 1 << 1,
            Self::Failed => 1 << 2,
            Self::Decided => (1 << 1) | (1 << 2),
            Self::Conflict => 1 << 3,
            Self::Unsure => 1 << 4,
            Self::Stale => 1,
        }
    }
}

/// Selects what the verdicts on the current result of the pair `c` and the metric `?5` say together: 0 if there are none, 1
/// for a pass, 2 for a fail, 3 for a conflict and 4 if all were unsure.
macro_rules! standing_of_verdicts {
    () => {
        concat!(
            "SELECT CASE WHEN count(*) = 0 THEN 0
            WHEN count(CASE WHEN v.verdict = 'pass' AND coalesce(v.review_order, '') <> 'adjudicate' THEN 1 END) > 0
                AND count(CASE WHEN v.verdict = 'fail' AND coalesce(v.review_order, '') <> 'adjudicate' THEN 1 END) > 0
                AND count(CASE WHEN v.verdict <> 'unsure' AND v.review_order = 'adjudicate' THEN 1 END) > 0
            THEN CASE WHEN count(CASE WHEN v.verdict = 'fail' AND v.review_order = 'adjudicate' THEN 1 END) = 0 THEN 1
                WHEN count(CASE WHEN v.verdict = 'pass' AND v.review_order = 'adjudicate' THEN 1 END) = 0 THEN 2 ELSE 3 END
            WHEN count(CASE WHEN v.verdict = 'pass' THEN 1 END) = 0 THEN
                CASE WHEN count(CASE WHEN v.verdict = 'fail' THEN 1 END) = 0 THEN 4 ELSE 2 END
            WHEN count(CASE WHEN v.verdict = 'fail' THEN 1 END) = 0 THEN 1 ELSE 3 END ",
            $crate::records::status::from_current_verdicts!(),
            " AND v.pair = c.id AND v.metric = ?5"
        )
    };
}

/// Selects verdicts on earlier results of the pair `c` and the metric `?5`, whose current result is `m`.
macro_rules! earlier_verdicts {
    () => {
        concat!(
            "SELECT 1 FROM verdict AS e WHERE e.pair = c.id AND e.metric = ?5 AND e.result_hash <> m.result_hash
        AND ",
            $crate::records::status::in_force!("e")
        )
    };
}
pub(super) use {earlier_verdicts, standing_of_verdicts};
