//! Why pairs are left out of an export.

use std::collections::BTreeMap;

use mocban_core::domain::enum_names;

/// Why the options of an export leave out a pair. The order is that of how near a pair came to the export: of the reasons of
/// several metrics, the last one counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LeftOutReason {
    /// Other pairs were chosen.
    NotChosen,
    /// It has no result of the exported metrics.
    WithoutResult,
    /// Nobody judged its result.
    WithoutVerdict,
    /// Only an earlier result was judged.
    EarlierVerdict,
    /// Reviewers were unsure, or disagree.
    Unsure,
    /// Reviewers failed its result.
    Failed,
    /// Its result has no confidence.
    WithoutConfidence,
    /// Its confidence is too low.
    LowConfidence,
}

enum_names! {
    pub LeftOutReason, "a reason to leave out a pair":
    NotChosen = "not_chosen", WithoutResult = "without_result", WithoutVerdict = "without_verdict",
    EarlierVerdict = "earlier_verdict", Unsure = "unsure", Failed = "failed",
    WithoutConfidence = "without_confidence", LowConfidence = "low_confidence",
}

/// How many pairs were left out, by reason.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LeftOutCounts(BTreeMap<LeftOutReason, u64>);

impl LeftOutCounts {
    /// Counts a pair.
    pub fn add(&mut self, reason: LeftOutReason) {
        *self.0.entry(reason).or_default() += 1;
    }

    /// Returns each reason with the number of its pairs, which is not 0.
    pub fn iter(&self) -> impl Iterator<Item = (LeftOutReason, u64)> {
        self.0.iter().map(|(reason, number)| (*reason, *number))
    }

    /// Returns the reasons other than that other pairs were chosen.
    fn refusals(&self) -> impl Iterator<Item = (LeftOutReason, u64)> {
        self.iter()
            .filter(|(reason, _)| *reason != LeftOutReason::NotChosen)
    }

    /// Returns the number of chosen pairs that were left out.
    pub fn refused(&self) -> u64 {
        self.refusals().map(|(_, number)| number).sum()
    }

    /// Returns the reasons for which chosen pairs were left out with their numbers, such as `12 without a verdict, 3 below
    /// confidence 0.5`. `least` is the lowest confidence that is exported.
    pub fn text(&self, least: Option<f64>) -> String {
        let reasons = self.refusals().map(|(reason, number)| {
            let why = match reason {
                LeftOutReason::NotChosen => "not chosen",
                LeftOutReason::WithoutResult => "without a result",
                LeftOutReason::WithoutVerdict => "without a verdict",
                LeftOutReason::EarlierVerdict => "judged only on an earlier result",
                LeftOutReason::Unsure => "unsure or in conflict",
                LeftOutReason::Failed => "failed by reviewers",
                LeftOutReason::WithoutConfidence => "without a confidence",
                LeftOutReason::LowConfidence => "below confidence",
            };
            match least.filter(|_| reason == LeftOutReason::LowConfidence) {
                Some(least) => format!("{number} {why} {least}"),
                None => format!("{number} {why}"),
            }
        });
        reasons.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::{LeftOutCounts, LeftOutReason};

    #[test]
    fn reasons_are_listed_with_their_numbers() {
        let mut counts = LeftOutCounts::default();
        assert_eq!((counts.text(None), counts.refused()), (String::new(), 0));
        for reason in [
            LeftOutReason::LowConfidence,
            LeftOutReason::WithoutVerdict,
            LeftOutReason::NotChosen,
            LeftOutReason::WithoutVerdict,
        ] {
            counts.add(reason);
        }
        let text = "2 without a verdict, 1 below confidence 0.5";
        assert_eq!(counts.text(Some(0.5)), text);
        assert_eq!(counts.refused(), 3);
    }
}
