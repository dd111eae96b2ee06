//! Accuracy against coverage: how right those results are that stay when the least confident are left out.

use super::model::{Basis, RiskCoverage, RiskCoveragePoint};
use super::stats::wilson_95;
use crate::domain::ThresholdMetric;

/// Percent of the results that are kept, the most confident ones.
pub const KEPT_PERCENT: [u64; 7] = [100, 99, 97, 95, 90, 80, 50];
/// Failures are looked for among so many percent, the least confident ones.
pub const LEAST_PERCENT: u64 = 3;

/// Confidences of all metrics with what became of them.
#[derive(Debug, Clone, Default)]
pub(super) struct ConfidenceSamples([ConfidenceOutcomes; ThresholdMetric::ALL.len()]);

/// Confidence and outcome of one metric's results.
#[derive(Debug, Clone, Default)]
struct ConfidenceOutcomes(Vec<(f64, bool)>);

impl ConfidenceSamples {
    /// Counts one pair in; `judged` tells a metric's confidence and whether its result is right, where both are known.
    pub(super) fn add(&mut self, judged: impl Fn(ThresholdMetric) -> Option<(f64, bool)>) {
        for (column, metric) in self.0.iter_mut().zip(ThresholdMetric::ALL) {
            column.0.extend(judged(metric));
        }
    }

    /// The curves of all metrics that have any.
    pub(super) fn finish(self, basis: Basis) -> Vec<RiskCoverage> {
        let columns = self.0.into_iter().zip(ThresholdMetric::ALL);
        columns
            .filter(|(judged, _)| !judged.0.is_empty())
            .map(|(judged, metric)| judged.finish(basis, metric))
            .collect()
    }
}

impl ConfidenceOutcomes {
    fn finish(mut self, basis: Basis, metric: ThresholdMetric) -> RiskCoverage {
        // The sort is stable: of equally confident results the first by name stays the longest.
        self.0.sort_by(|a, b| b.0.total_cmp(&a.0));
        let kept = |percent| self.0.len() * percent as usize / 100;
        let failures = |judged: &[(f64, bool)]| judged.iter().filter(|(_, right)| !right).count();
        let least = &self.0[kept(100 - LEAST_PERCENT)..];
        RiskCoverage {
            basis,
            metric,
            n: self.0.len() as u64,
            failures: failures(&self.0) as u64,
            least_n: least.len() as u64,
            failures_in_least: failures(least) as u64,
            points: KEPT_PERCENT
                .iter()
                .map(|percent| point(*percent, &self.0[..kept(*percent)]))
                .collect(),
        }
    }
}

/// One point of a curve from the results that are kept, the most confident first.
fn point(percent: u64, kept: &[(f64, bool)]) -> RiskCoveragePoint {
    let n = kept.len() as u64;
    let passed = kept.iter().filter(|(_, right)| *right).count() as u64;
    RiskCoveragePoint {
        coverage: percent as f64 / 100.0,
        n,
        passed,
        acc: (n > 0).then(|| passed as f64 / n as f64),
        acc_ci95: wilson_95(passed, n),
        least_confidence: kept.last().map(|(confidence, _)| *confidence),
    }
}

#[cfg(test)]
mod tests {
    use super::{ConfidenceSamples, KEPT_PERCENT};
    use crate::domain::ThresholdMetric;
    use crate::report::model::{Basis, RiskCoverage};
    use crate::report::stats::wilson_95;

    /// The curve of density over results in the order given.
    fn curve(judged: &[(f64, bool)]) -> RiskCoverage {
        let mut confidences = ConfidenceSamples::default();
        for one in judged {
            confidences.add(|metric| (metric == ThresholdMetric::Density).then_some(*one));
        }
        let mut curves = confidences.finish(Basis::Truth);
        assert_eq!(curves.len(), 1);
        curves.remove(0)
    }

    #[test]
    fn leaving_out_the_least_confident_leaves_out_their_failures() {
        // Wrong: the least confident of all, and one in the middle. They come in any order.
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
    fn the_least_confident_and_those_kept_are_all_there_is() {
        for n in [1_usize, 2, 24, 33, 34, 587] {
            let judged: Vec<_> = (0..n).map(|i| (i as f64 / n as f64, true)).collect();
            let found = curve(&judged);
            let kept = found.points[2].n;
            assert_eq!(KEPT_PERCENT[2], 97);
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
