//! Where the metrics cut the relief: the distribution of their thresholds.

use serde::Serialize;

use super::stats::{median, quantile};
use crate::catalog::PairResults;
use crate::domain::ThresholdMetric;

/// Bins of a distribution, each as wide as the others.
pub const BINS: usize = 40;
/// Levels of a depth map, from the lowest point to the highest.
const LEVELS: f64 = 65_534.0;

/// The cuts of one metric as heights in the depth maps: 0 is the lowest point of a map, 1 the highest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ThresholdDistribution {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// Results.
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

/// The cuts so far, by metric.
#[derive(Debug, Clone, Default)]
pub(super) struct ThresholdSamples([Vec<f64>; ThresholdMetric::ALL.len()]);

impl ThresholdSamples {
    /// Counts the results of one pair in.
    pub(super) fn add(&mut self, pair: &PairResults) {
        for (cuts, metric) in self.0.iter_mut().zip(ThresholdMetric::ALL) {
            let found = pair.metric(metric);
            cuts.extend(found.map(|record| height(record.outcome.threshold_level)));
        }
    }

    /// The distribution of every metric that has results.
    pub(super) fn finish(self) -> Vec<ThresholdDistribution> {
        let by_metric = ThresholdMetric::ALL.into_iter().zip(self.0);
        by_metric
            .filter_map(|(metric, mut cuts)| {
                Some(ThresholdDistribution {
                    metric,
                    n: cuts.len() as u64,
                    p5: quantile(&mut cuts, 0.05)?,
                    median: median(&mut cuts)?,
                    p95: quantile(&mut cuts, 0.95)?,
                    bins: bins(&cuts),
                })
            })
            .collect()
    }
}

/// A level of a depth map as a share of its heights; level 1 is the lowest, 0 holds no data.
fn height(level: u16) -> f64 {
    f64::from(level.saturating_sub(1)) / LEVELS
}

fn bins(cuts: &[f64]) -> Vec<u64> {
    let mut bins = vec![0; BINS];
    for cut in cuts {
        bins[((cut * BINS as f64) as usize).min(BINS - 1)] += 1;
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
    fn every_cut_is_in_one_bin_the_ends_too() {
        let mut cuts = ThresholdSamples::default();
        for (name, level) in [("a", 1), ("b", 32_768), ("c", 65_535)] {
            let mut pair = test_fixtures::done(name, 0.8, &[]);
            pair.metrics.truncate(1);
            pair.metrics[0].outcome.threshold_level = level;
            cuts.add(&pair);
        }
        let found = cuts.finish();
        assert_eq!(found.len(), 1, "only one metric has results");
        assert_eq!((found[0].metric, found[0].n), (ThresholdMetric::NlSsim, 3));
        assert_eq!(found[0].median, 0.5);
        let filled = found[0].bins.iter().enumerate().filter(|(_, n)| **n > 0);
        assert_eq!(filled.collect::<Vec<_>>(), [(0, &1), (20, &1), (39, &1)]);
    }
}
