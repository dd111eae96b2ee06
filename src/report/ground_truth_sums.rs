//! One metric's results against the truth, added up.

use super::accumulate::share;
use super::ground_truth::{MAX_ANGLE_DEG, TruthErrors};
use super::model::TruthSummary;
use super::stats::{median, wilson_95};

/// The sums so far.
#[derive(Debug, Clone, Default)]
pub(super) struct TruthSums {
    passed: u64,
    angle_right: u64,
    mirrored: u64,
    angles_deg: Vec<f64>,
    tres_pct: Vec<f64>,
    mask_ious: Vec<f64>,
}

impl TruthSums {
    /// Counts one result in.
    pub(super) fn add(&mut self, errors: &TruthErrors) {
        self.passed += u64::from(errors.pass());
        self.angle_right += u64::from(errors.angle_deg <= MAX_ANGLE_DEG);
        self.mirrored += u64::from(errors.mirrored);
        self.angles_deg.push(errors.angle_deg);
        self.tres_pct.push(errors.tre_pct);
        self.mask_ious.extend(errors.mask_iou);
    }

    /// The block that follows; `None` without any truth.
    pub(super) fn finish(mut self) -> Option<TruthSummary> {
        let n = self.angles_deg.len() as u64;
        (n > 0).then(|| TruthSummary {
            n,
            passed: self.passed,
            acc: share(self.passed as f64, n),
            acc_ci95: wilson_95(self.passed, n),
            angle_le_5deg: share(self.angle_right as f64, n),
            angle_median_deg: median(&mut self.angles_deg),
            tre_median_pct: median(&mut self.tres_pct),
            mask_iou_median: median(&mut self.mask_ious),
            mirrored: self.mirrored,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::domain::ThresholdMetric;
    use crate::report::{ReportAccumulator, test_fixtures};

    #[test]
    fn truth_is_counted_apart_from_verdicts() {
        let mut tally = ReportAccumulator::default();
        tally.add(
            &test_fixtures::done("a", 0.8, &[]),
            &test_fixtures::truth(1.0, 2.0, 0.9),
        );
        tally.add(
            &test_fixtures::done("b", 0.8, &[]),
            &test_fixtures::truth(9.0, 2.0, 0.9),
        );
        tally.add(
            &test_fixtures::done("c", 0.8, &[]),
            &test_fixtures::truth(3.0, 4.0, 0.6),
        );
        let report = tally.finish();
        let row = report
            .row(ThresholdMetric::Ensemble)
            .expect("every metric has a row");
        let truth = row.truth.as_ref().expect("all pairs have truth");
        assert_eq!((row.acc, truth.n, truth.passed), (None, 3, 1));
        assert_eq!(truth.angle_le_5deg, Some(2.0 / 3.0));
        assert_eq!(truth.angle_median_deg, Some(3.0));
        assert_eq!(truth.tre_median_pct, Some(2.0));
        assert_eq!(truth.mask_iou_median, Some(0.9));
    }
}
