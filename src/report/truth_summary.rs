//! One metric's errors against ground truth, summed up.

use serde::Serialize;

use super::ground_truth::{MAX_ANGLE_DEG, TruthErrors};
use super::stats::{IntervalMethod, median, ratio};

/// A metric's errors against ground truth; never mixed with verdicts.
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
    /// Median angle error, degrees.
    pub angle_median_deg: Option<f64>,
    /// Median landmark error, percent of the character's height.
    pub tre_median_pct: Option<f64>,
    /// Median intersection over union with the true stroke tops, where there are masks of these.
    pub mask_iou_median: Option<f64>,
    /// Mirrored results.
    pub mirrored: u64,
}

/// The errors of one metric's results.
#[derive(Debug, Clone, Default)]
pub(super) struct TruthSums(Vec<TruthErrors>);

impl TruthSums {
    /// Counts one result.
    pub(super) fn add(&mut self, errors: &TruthErrors) {
        self.0.push(*errors);
    }

    /// Returns the summary; `None` without any result.
    pub(super) fn finish(self) -> Option<TruthSummary> {
        let n = self.0.len() as u64;
        let count = |is: fn(&TruthErrors) -> bool| {
            let found = self.0.iter().filter(|errors| is(errors));
            found.count() as u64
        };
        let median_of = |value: fn(&TruthErrors) -> Option<f64>| {
            median(&mut self.0.iter().filter_map(value).collect::<Vec<_>>())
        };
        let passed = count(TruthErrors::pass);
        let angle_right = count(|errors| errors.angle_deg <= MAX_ANGLE_DEG);
        (n > 0).then(|| TruthSummary {
            n,
            passed,
            acc: ratio(passed as f64, n),
            acc_ci95: IntervalMethod::Wilson.interval_95(passed, n),
            angle_le_5deg: ratio(angle_right as f64, n),
            angle_median_deg: median_of(|errors| Some(errors.angle_deg)),
            tre_median_pct: median_of(|errors| Some(errors.tre_pct)),
            mask_iou_median: median_of(|errors| errors.mask_iou),
            mirrored: count(|errors| errors.mirrored),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{TruthErrors, TruthSums};

    #[test]
    fn summary_has_shares_and_medians() {
        let errors = |angle_deg, tre_pct, mask_iou| TruthErrors {
            angle_deg,
            mirrored: false,
            tre_pct,
            mask_iou: Some(mask_iou),
        };
        let mut sums = TruthSums::default();
        for result in [
            errors(1.0, 2.0, 0.9),
            errors(9.0, 2.0, 0.9),
            errors(3.0, 4.0, 0.6),
        ] {
            sums.add(&result);
        }
        let found = sums.finish().expect("three results");
        assert_eq!((found.n, found.passed, found.mirrored), (3, 1, 0));
        assert_eq!(found.angle_le_5deg, Some(2.0 / 3.0));
        assert_eq!(found.angle_median_deg, Some(3.0));
        assert_eq!(found.tre_median_pct, Some(2.0));
        assert_eq!(found.mask_iou_median, Some(0.9));
        assert_eq!(TruthSums::default().finish(), None);
    }
}
