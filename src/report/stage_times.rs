//! Computing times of the stages, over the pairs whose current results they made.

use serde::Serialize;

use super::stats::{median, quantile};
use crate::catalog::StageRecord;
use crate::domain::Stage;

/// Computing times of one stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StageTimes {
    /// The stage.
    pub stage: Stage,
    /// Pairs that have a result of it.
    pub n: u64,
    /// Median, milliseconds.
    pub median_ms: f64,
    /// 95th percentile, milliseconds.
    pub p95_ms: f64,
    /// Sum, seconds.
    pub total_s: f64,
}

/// Computing times by stage, milliseconds.
#[derive(Debug, Clone, Default)]
pub(super) struct StageTimeSamples([Vec<f64>; Stage::ALL.len()]);

impl StageTimeSamples {
    /// Counts the stages of one pair.
    pub(super) fn add(&mut self, stages: &[StageRecord]) {
        for record in stages {
            self.0[record.stage.index()].push(record.ms as f64);
        }
    }

    /// Returns the times of every stage that has results, in order.
    pub(super) fn finish(self) -> Vec<StageTimes> {
        let by_stage = Stage::ALL.into_iter().zip(self.0);
        by_stage
            .filter_map(|(stage, mut ms)| {
                Some(StageTimes {
                    stage,
                    n: ms.len() as u64,
                    median_ms: median(&mut ms)?,
                    p95_ms: quantile(&mut ms, 0.95)?,
                    total_s: ms.iter().sum::<f64>() / 1000.0,
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::StageTimeSamples;
    use crate::domain::Stage;
    use crate::report::test_fixtures;

    #[test]
    fn a_stage_has_its_median_its_tail_and_its_sum() {
        let mut times = StageTimeSamples::default();
        for ms in [10, 20, 30, 40, 100] {
            times.add(&[test_fixtures::stage(Stage::Depth, ms)]);
        }
        times.add(&[]);
        let found = times.finish();
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].stage, found[0].n), (Stage::Depth, 5));
        assert_eq!((found[0].median_ms, found[0].total_s), (30.0, 0.2));
        // NumPy 2 `quantile([10, 20, 30, 40, 100], 0.95)`.
        assert!((found[0].p95_ms - 88.0).abs() < 1e-9, "{}", found[0].p95_ms);
    }
}
