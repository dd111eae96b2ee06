//! The distribution of measured times.

use std::time::{Duration, Instant};

use mocban::results::stats::quantile;

use super::markdown::two;

/// Milliseconds, in the order they were measured.
#[derive(Debug, Default)]
pub(super) struct Spread(Vec<f64>);

impl Spread {
    /// Times `what` repeatedly.
    pub(super) async fn of<T, E: Into<anyhow::Error>>(
        times: usize,
        mut what: impl AsyncFnMut() -> Result<T, E>,
    ) -> anyhow::Result<Self> {
        let mut spread = Self::default();
        for _ in 0..times {
            let start = Instant::now();
            what().await.map_err(Into::into)?;
            spread.since(start);
        }
        Ok(spread)
    }

    /// Adds the time since `start`.
    pub(super) fn since(&mut self, start: Instant) {
        self.add(start.elapsed());
    }

    /// Adds a time.
    pub(super) fn add(&mut self, time: Duration) {
        self.push(time.as_secs_f64() * 1e3);
    }

    /// Adds milliseconds, which may be negative if they are a difference.
    pub(super) fn push(&mut self, ms: f64) {
        self.0.push(ms);
    }

    /// Returns the median.
    pub(super) fn median(&mut self) -> Option<f64> {
        quantile(&mut self.0, 0.5)
    }

    /// Formats `median / 95th percentile`.
    pub(super) fn cell(&mut self) -> String {
        two([0.5, 0.95].map(|share| quantile(&mut self.0, share)), 2)
    }
}
