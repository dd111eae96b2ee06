//! One metric's errors against ground truth, summed up.

use serde::Serialize;

use mocban_results::ground_truth::{MAX_ANGLE_DEG, TruthErrors};
use mocban_results::stats::{Rate, median};

/// A metric's errors against ground truth. Verdicts are not part of these numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TruthSummary {
    /// Results with usable ground truth.
    pub n: u64,
    /// Results with angle, landmarks and mask all within their limits.
    pub passed: u64,
    /// `passed / n`.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, by the report's method.
    pub acc_ci95: Option<[f64; 2]>,
    /// Share with an angle error of at most 5 degrees.
    pub angle_le_5deg: Option<f64>,
    /// Median angle error, in degrees.
    pub angle_median_deg: Option<f64>,
    /// Median landmark error, in percent of the character's height.
    pub tre_median_pct: Option<f64>,
    /// Median `mask_iou` of the results that have a tops mask. `None` if no result has a tops mask.
    pub mask_iou_median: Option<f64>,
    /// Mirrored results.
    pub mirrored: u64,
}

impl TruthSummary {
    /// Returns the summary of one metric's errors, or `None` if there are no errors.
    pub(super) fn of(found: &[TruthErrors]) -> Option<Self> {
        let rate = |is: fn(&TruthErrors) -> bool| Rate::of(found.iter().map(is));
        let median_of = |value: fn(&TruthErrors) -> Option<f64>| {
            median(&mut found.iter().filter_map(value).collect::<Vec<_>>())
        };
        let acc = rate(TruthErrors::pass);
        (acc.n > 0).then(|| Self {
            n: acc.n,
            passed: acc.count,
            acc: acc.share,
            acc_ci95: acc.ci95,
            angle_le_5deg: rate(|errors| errors.angle_deg <= MAX_ANGLE_DEG).share,
            angle_median_deg: median_of(|errors| Some(errors.angle_deg)),
            tre_median_pct: median_of(|errors| Some(errors.tre_pct)),
            mask_iou_median: median_of(|errors| errors.mask_iou),
            mirrored: rate(|errors| errors.mirrored).count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{TruthErrors, TruthSummary};

    #[test]
    fn summary_has_shares_and_medians() {
        let errors = |angle_deg, tre_pct, mask_iou| TruthErrors {
            angle_deg,
            mirrored: false,
            tre_pct,
            mask_iou: Some(mask_iou),
        };
        let results = [
            errors(1.0, 2.0, 0.9),
            errors(9.0, 2.0, 0.9),
            errors(3.0, 4.0, 0.6),
        ];
        let found = TruthSummary::of(&results).expect("three results");
        assert_eq!((found.n, found.passed, found.mirrored), (3, 1, 0));
        assert_eq!(found.angle_le_5deg, Some(2.0 / 3.0));
        assert_eq!(found.angle_median_deg, Some(3.0));
        assert_eq!(found.tre_median_pct, Some(2.0));
        assert_eq!(found.mask_iou_median, Some(0.9));
        assert_eq!(TruthSummary::of(&[]), None);
    }
}
