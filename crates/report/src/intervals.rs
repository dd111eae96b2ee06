//! Changes how the intervals of a report are computed.

use super::headline::headline;
use super::model::Report;
use mocban_results::stats::IntervalMethod;

impl Report {
    /// Returns the same report with intervals of shares computed by `method`.
    #[must_use]
    pub fn with_interval(mut self, method: IntervalMethod) -> Self {
        self.interval = method;
        if let Some(rates) = &mut self.attention_checks {
            rates.set_interval(method);
        }
        for row in &mut self.rows {
            row.acc_ci95 = method.interval_95(row.passed, row.passed + row.failed);
            if let Some(rules) = &mut row.rules {
                rules.set_interval(method);
            }
            if let Some(truth) = &mut row.truth {
                truth.acc_ci95 = method.interval_95(truth.passed, truth.n);
            }
        }
        let curves = self.risk_coverage.iter_mut();
        for point in curves.flat_map(|curve| &mut curve.points) {
            point.acc_ci95 = method.interval_95(point.passed, point.n);
        }
        self.headline = headline(&self);
        self
    }
}
