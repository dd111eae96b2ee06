//! Computing times of the stages, over the current results.

use serde::Serialize;

use mocban_core::domain::Stage;
use mocban_results::stats::{median, quantile};

/// Computing times of one stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StageTimes {
    /// The stage.
    pub stage: Stage,
    /// Pairs that have a result of it.
    pub n: u64,
    /// Median, in milliseconds.
    pub median_ms: f64,
    /// 95th percentile, in milliseconds.
    pub p95_ms: f64,
    /// Sum, in seconds.
    pub total_s: f64,
}

impl StageTimes {
    /// Returns the times of a stage. `ms` holds the time of each result. Returns `None` if `ms` is empty.
    pub(super) fn of(stage: Stage, ms: &mut [f64]) -> Option<Self> {
        Some(Self {
            stage,
            n: ms.len() as u64,
            median_ms: median(ms)?,
            p95_ms: quantile(ms, 0.95)?,
            total_s: ms.iter().sum::<f64>() / 1000.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::StageTimes;
    use mocban_core::domain::Stage;

    #[test]
    fn a_stage_has_its_median_its_tail_and_its_sum() {
        let mut ms = [100.0, 10.0, 20.0, 30.0, 40.0];
        let found = StageTimes::of(Stage::Depth, &mut ms).expect("five results");
        assert_eq!((found.stage, found.n), (Stage::Depth, 5));
        assert_eq!((found.median_ms, found.total_s), (30.0, 0.2));
        // NumPy 2 `quantile([10, 20, 30, 40, 100], 0.95)`.
        assert!((found.p95_ms - 88.0).abs() < 1e-9, "{}", found.p95_ms);
        assert_eq!(StageTimes::of(Stage::Depth, &mut []), None);
    }
}
