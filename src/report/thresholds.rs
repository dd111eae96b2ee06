//! The distribution of the thresholds that metrics chose.

use serde::Serialize;

use super::stats::{median, quantile};
use crate::catalog::PairResults;
use crate::domain::ThresholdMetric;

/// Equal bins of a distribution.
pub const BINS: usize = 40;
/// Steps between the lowest and the highest level of a depth map.
const LEVELS: f64 = 65_534.0;

/// The thresholds of one metric as relative heights: 0 is the lowest point of a depth map, 1 the highest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ThresholdDistribution {
    /// The metric.
    pub metric: ThresholdMetric,
    /// Number of results.
    pub n: u64,
    /// 5th percentile.
    pub p5: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Results in each of [`BINS`] equal parts of 0..=1, the lowest first.
    pub bins: Vec<u64>,
}

/// Relative heights of the thresholds, by metric.
#[derive(Debug, Clone, Default)]
pub(super) struct ThresholdSamples([Vec<f64>; ThresholdMetric::ALL.len()]);

impl ThresholdSamples {
    /// Counts the results of one pair.
    pub(super) fn add(&mut self, pair: &PairResults) {
        for (heights, metric) in self.0.iter_mut().zip(ThresholdMetric::ALL) {
            let found = pair.metric(metric);
            heights.extend(found.map(|record| height(record.outcome.threshold_level)));
        }
    }

    /// Returns the distribution of every metric that has results.
    pub(super) fn finish(self) -> Vec<ThresholdDistribution> {
        let by_metric = ThresholdMetric::ALL.into_iter().zip(self.0);
        by_metric
            .filter_map(|(metric, mut heights)| {
                Some(ThresholdDistribution {
                    metric,
                    n: heights.len() as u64,
                    p5: quantile(&mut heights, 0.05)?,
                    median: median(&mut heights)?,
                    p95: quantile(&mut heights, 0.95)?,
                    bins: histogram(&heights),
                })
            })
            .collect()
    }
}

/// Returns the relative height of a depth-map level; level 1 is the lowest, 0 holds no data.
fn height(level: u16) -> f64 {
    f64::from(level.saturating_sub(1)) / LEVELS
}

fn histogram(heights: &[f64]) -> Vec<u64> {
    let mut bins = vec![0; BINS];
    for height in heights {
        bins[((height * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::{ThresholdSamples, height};
    use crate::domain::ThresholdMetric;
    use crate::report::test_fixtures;

    #[test]
    fn levels_span_the_heights_of_a_map() {
        assert_eq!([1, 65_535].map(height), [0.0, 1.0]);
    }

    #[test]
    fn every_threshold_is_in_one_bin_even_at_the_ends() {
        let mut samples = ThresholdSamples::default();
        for (name, level) in [("a", 1), ("b", 32_768), ("c", 65_535)] {
            let mut pair = test_fixtures::done(name, 0.8, &[]);
            pair.metrics.truncate(1);
            pair.metrics[0].outcome.threshold_level = level;
            samples.add(&pair);
        }
        let found = samples.finish();
        assert_eq!(found.len(), 1, "only one metric has results");
        assert_eq!((found[0].metric, found[0].n), (ThresholdMetric::NlSsim, 3));
        assert_eq!(found[0].median, 0.5);
        let filled = found[0].bins.iter().enumerate().filter(|(_, n)| **n > 0);
        assert_eq!(filled.collect::<Vec<_>>(), [(0, &1), (20, &1), (39, &1)]);
    }
}
