//! The distribution of the thresholds that metrics chose.

use serde::Serialize;

use mocban_core::domain::ThresholdMetric;
use mocban_results::stats::{median, quantile};

/// Equal bins of a distribution.
pub const BINS: usize = 40;
/// Steps between the lowest and the highest level of a depth map.
const LEVELS: f64 = 65_534.0;

/// The distribution of one metric's thresholds as relative heights. 0 is the lowest point of a depth map and 1 the
/// highest.
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

impl ThresholdDistribution {
    /// Returns the distribution of a metric's thresholds from their relative heights, or `None` if `heights` is empty.
    pub(super) fn of(metric: ThresholdMetric, heights: &mut [f64]) -> Option<Self> {
        let mut bins = vec![0; BINS];
        for height in heights.iter() {
            bins[((height * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
        Some(Self {
            metric,
            n: heights.len() as u64,
            p5: quantile(heights, 0.05)?,
            median: median(heights)?,
            p95: quantile(heights, 0.95)?,
            bins,
        })
    }
}

/// Returns the relative height of a depth-map level. Level 1 is the lowest height, and level 0 marks missing data.
pub(super) fn relative_height(level: u16) -> f64 {
    f64::from(level.saturating_sub(1)) / LEVELS
}

#[cfg(test)]
mod tests {
    use super::{ThresholdDistribution, relative_height};
    use mocban_core::domain::ThresholdMetric;

    #[test]
    fn levels_span_the_heights_of_a_map() {
        assert_eq!([1, 65_535].map(relative_height), [0.0, 1.0]);
    }

    #[test]
    fn every_threshold_is_in_one_bin_even_at_the_ends() {
        let mut heights = [32_768, 1, 65_535].map(relative_height);
        let found = ThresholdDistribution::of(ThresholdMetric::NlSsim, &mut heights);
        let found = found.expect("three thresholds");
        assert_eq!((found.metric, found.n), (ThresholdMetric::NlSsim, 3));
        assert_eq!(found.median, 0.5);
        let filled = found.bins.iter().enumerate().filter(|(_, n)| **n > 0);
        assert_eq!(filled.collect::<Vec<_>>(), [(0, &1), (20, &1), (39, &1)]);
    }
}
