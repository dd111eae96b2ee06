//! Risk-coverage curves: the accuracy of the results that remain if the least confident results are left out.

use serde::Serialize;

use super::comparison::Basis;
use mocban_core::domain::ThresholdMetric;
use mocban_results::stats::Rate;

/// Coverages of a curve, in percent of the results. At each coverage, the most confident results are kept.
pub const COVERAGE_PERCENT: [u64; 7] = [100, 99, 97, 95, 90, 80, 50];
/// Percentage of the results that count as the least confident. The curve states how many of these are wrong.
pub const LEAST_CONFIDENT_PERCENT: u64 = 3;

/// The risk-coverage curve of one metric.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RiskCoverageCurve {
    /// What decides whether a result is right.
    pub basis: Basis,
    /// The metric.
    pub metric: ThresholdMetric,
    /// Results that have a confidence and are known to be right or wrong.
    pub n: u64,
    /// Number of wrong results.
    pub failures: u64,
    /// Number of the least confident 3 %, rounded up.
    pub least_n: u64,
    /// Number of wrong results among the least confident 3 %.
    pub failures_in_least: u64,
    /// From full coverage down to half.
    pub points: Vec<RiskCoveragePoint>,
}

/// The results kept at one coverage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RiskCoveragePoint {
    /// Share of the results that is kept, 0..=1.
    pub coverage: f64,
    /// Number of results kept, rounded down.
    pub n: u64,
    /// Number of right results among those kept.
    pub passed: u64,
    /// `passed / n`. `None` if nothing is kept.
    pub acc: Option<f64>,
    /// The 95 % interval of `acc`, by the report's method.
    pub acc_ci95: Option<[f64; 2]>,
    /// The lowest confidence that is kept.
    pub least_confidence: Option<f64>,
}

impl RiskCoverageCurve {
    /// Returns the curve of a metric, or `None` without results. `samples` holds the confidence of each result, and
    /// whether the result is right, in the order of the pairs' names.
    pub(super) fn of(
        basis: Basis,
        metric: ThresholdMetric,
        samples: &mut [(f64, bool)],
    ) -> Option<Self> {
        // The sort is stable. If confidences are equal, the result whose pair comes first by name is kept longer.
        samples.sort_by(|a, b| b.0.total_cmp(&a.0));
        let kept = |percent| samples.len() * percent as usize / 100;
        let failures =
            |samples: &[(f64, bool)]| samples.iter().filter(|(_, right)| !right).count() as u64;
        let least = &samples[kept(100 - LEAST_CONFIDENT_PERCENT)..];
        let points = COVERAGE_PERCENT.iter();
        (!samples.is_empty()).then(|| Self {
            basis,
            metric,
            n: samples.len() as u64,
            failures: failures(samples),
            least_n: least.len() as u64,
            failures_in_least: failures(least),
            points: points
                .map(|percent| point(*percent, &samples[..kept(*percent)]))
                .collect(),
        })
    }
}

/// Returns one point of a curve from the results that are kept, sorted with the most confident first.
fn point(percent: u64, kept: &[(f64, bool)]) -> RiskCoveragePoint {
    let acc = Rate::of(kept.iter().map(|(_, right)| *right));
    RiskCoveragePoint {
        coverage: percent as f64 / 100.0,
        n: acc.n,
        passed: acc.count,
        acc: acc.share,
        acc_ci95: acc.ci95,
        least_confidence: kept.last().map(|(confidence, _)| *confidence),
    }
}

#[cfg(test)]
mod tests {
    use super::{COVERAGE_PERCENT, RiskCoverageCurve};
    use crate::comparison::Basis;
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::stats::wilson_95;

    /// The curve of density over results in the order given.
    fn curve(judged: &[(f64, bool)]) -> RiskCoverageCurve {
        let found =
            RiskCoverageCurve::of(Basis::Truth, ThresholdMetric::Density, &mut judged.to_vec());
        found.expect("there are results")
    }

    #[test]
    fn leaving_out_the_least_confident_leaves_out_their_failures() {
        // Only the least confident result and one in the middle are wrong. The results are not sorted by confidence.
        let judged: Vec<_> = (0..100)
            .map(|i| (i * 37) % 100)
            .map(|rank| (f64::from(rank) / 100.0, rank != 0 && rank != 40))
            .collect();
        let found = curve(&judged);
        assert_eq!((found.metric, found.n), (ThresholdMetric::Density, 100));
        assert_eq!((found.failures, found.least_n), (2, 3));
        assert_eq!(found.failures_in_least, 1);
        let kept: Vec<_> = found.points.iter().map(|p| (p.n, p.passed)).collect();
        let wanted = [
            (100, 98),
            (99, 98),
            (97, 96),
            (95, 94),
            (90, 89),
            (80, 79),
            (50, 50),
        ];
        assert_eq!(kept, wanted);
        let last = found.points.last().expect("seven points");
        assert_eq!((last.acc, last.least_confidence), (Some(1.0), Some(0.5)));
        assert_eq!(found.points[1].acc_ci95, wilson_95(98, 99));
        assert_eq!(found.points[1].coverage, 0.99);
    }

    #[test]
    fn kept_results_and_the_least_confident_add_up_to_all() {
        for n in [1_usize, 2, 24, 33, 34, 587] {
            let judged: Vec<_> = (0..n).map(|i| (i as f64 / n as f64, true)).collect();
            let found = curve(&judged);
            let kept = found.points[2].n;
            assert_eq!(COVERAGE_PERCENT[2], 97);
            assert_eq!(kept + found.least_n, n as u64);
            assert_eq!(found.least_n, (n as u64 * 3).div_ceil(100));
        }
    }

    #[test]
    fn nothing_kept_has_no_accuracy() {
        let found = curve(&[(0.9, true)]);
        assert_eq!(found.points[0].acc, Some(1.0));
        let half = found.points.last().expect("seven points");
        assert_eq!((half.n, half.acc, half.acc_ci95), (0, None, None));
        assert_eq!(half.least_confidence, None);
    }
}
