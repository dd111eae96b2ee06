//! Why pairs are left out of an export.

use std::collections::BTreeMap;

use mocban_core::domain::enum_names;

/// Why the options of an export leave out a pair. The order is that of how near a pair came to the export: of the reasons of
/// several metrics, the last one counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum OmissionReason {
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
    pub OmissionReason, "a reason to leave out a pair":
    NotChosen = "not_chosen", WithoutResult = "without_result", WithoutVerdict = "without_verdict",
    EarlierVerdict = "earlier_verdict", Unsure = "unsure", Failed = "failed",
    WithoutConfidence = "without_confidence", LowConfidence = "low_confidence",
}

/// How many pairs were left out, by reason.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OmissionCounts(BTreeMap<OmissionReason, u64>);

impl OmissionCounts {
    /// Counts a pair.
    pub fn add(&mut self, reason: OmissionReason) {
        *self.0.entry(reason).or_default() += 1;
    }

    /// Returns each reason with the number of its pairs, which is not 0.
    pub fn iter(&self) -> impl Iterator<Item = (OmissionReason, u64)> {
        self.0.iter().map(|(reason, number)| (*reason, *number))
    }

    /// Returns the reasons other than that other pairs were chosen.
    fn refusals(&self) -> impl Iterator<Item = (OmissionReason, u64)> {
        self.iter()
            .filter(|(reason, _)| *reason != OmissionReason::NotChosen)
    }

    /// Returns the number of chosen pairs that were left out.
    pub fn refused(&self) -> u64 {
        self.refusals().map(|(_, number)| number).sum()
    }

    /// Returns whether chosen pairs were left out, and all of them only because they have no result.
    pub fn all_lack_results(&self) -> bool {
        self.refused() > 0
            && self
                .refusals()
                .all(|(reason, _)| reason == OmissionReason::WithoutResult)
    }

    /// Returns the reasons for which chosen pairs were left out with their numbers, such as `12 without a verdict, 3 below
    /// confidence 0.5`. `least` is the lowest confidence that is exported.
    pub fn text(&self, least: Option<f64>) -> String {
        let reasons = self.refusals().map(|(reason, number)| {
            let why = match reason {
                OmissionReason::NotChosen => "not chosen",
                OmissionReason::WithoutResult => "without a result",
                OmissionReason::WithoutVerdict => "without a verdict",
                OmissionReason::EarlierVerdict => "judged only on an earlier result",
                OmissionReason::Unsure => "unsure or in conflict",
                OmissionReason::Failed => "failed by reviewers",
                OmissionReason::WithoutConfidence => "without a confidence",
                OmissionReason::LowConfidence => "below confidence",
            };
            match least.filter(|_| reason == OmissionReason::LowConfidence) {
                Some(least) => format!("{number} {why} {least}"),
                None => format!("{number} {why}"),
            }
        });
        reasons.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::{OmissionCounts, OmissionReason};

    #[test]
    fn reasons_are_listed_with_their_numbers() {
        let mut counts = OmissionCounts::default();
        assert_eq!((counts.text(None), counts.refused()), (String::new(), 0));
        assert!(!counts.all_lack_results());
        counts.add(OmissionReason::WithoutResult);
        assert!(counts.all_lack_results());
        for reason in [
            OmissionReason::LowConfidence,
            OmissionReason::WithoutVerdict,
            OmissionReason::NotChosen,
            OmissionReason::WithoutVerdict,
        ] {
            counts.add(reason);
        }
        let text = "1 without a result, 2 without a verdict, 1 below confidence 0.5";
        assert_eq!(counts.text(Some(0.5)), text);
        assert_eq!(counts.refused(), 4);
        assert!(!counts.all_lack_results());
    }
}
