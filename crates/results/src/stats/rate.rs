//! A count out of a total.

use serde::Serialize;

use super::interval::IntervalMethod;

/// Returns `sum / n`, or `None` if `n` is 0.
///
/// ```
/// use mocban_results::stats::ratio;
///
/// assert_eq!((ratio(3.0, 4), ratio(3.0, 0)), (Some(0.75), None));
/// ```
pub fn ratio(sum: f64, n: u64) -> Option<f64> {
    (n > 0).then(|| sum / n as f64)
}

/// A count out of a total, with its proportion and 95 % interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Rate {
    /// The total.
    pub n: u64,
    /// The count.
    pub count: u64,
    /// `count / n`, in 0..=1. `None` if `n` is 0.
    pub share: Option<f64>,
    /// The 95 % interval of `share`: Wilson's, unless `set_interval` chose another method.
    pub ci95: Option<[f64; 2]>,
}

impl Rate {
    /// Returns the rate of `count` out of `n` with Wilson's interval.
    ///
    /// ```
    /// use mocban_results::stats::Rate;
    ///
    /// let rate = Rate::new(19, 20);
    /// assert_eq!(rate.share, Some(0.95));
    /// assert!(rate.ci95.unwrap()[0] > 0.763);
    /// ```
    pub fn new(count: u64, n: u64) -> Self {
        Self {
            n,
            count,
            share: ratio(count as f64, n),
            ci95: IntervalMethod::Wilson.interval_95(count, n),
        }
    }

    /// Computes the interval by `method`.
    pub fn set_interval(&mut self, method: IntervalMethod) {
        self.ci95 = method.interval_95(self.count, self.n);
    }

    /// Counts one outcome, and computes the interval by Wilson's method.
    pub fn add(&mut self, outcome: bool) {
        *self = Self::new(self.count + u64::from(outcome), self.n + 1);
    }

    /// Returns the rate of `true` among the outcomes.
    pub fn of(outcomes: impl IntoIterator<Item = bool>) -> Self {
        let mut rate = Self::default();
        outcomes.into_iter().for_each(|outcome| rate.add(outcome));
        rate
    }

    /// Returns the rate over all of several samples.
    pub fn total(rates: impl IntoIterator<Item = Self>) -> Self {
        let rates = rates.into_iter();
        let (count, n) = rates.fold((0, 0), |(count, n), rate| (count + rate.count, n + rate.n));
        Self::new(count, n)
    }
}

#[cfg(test)]
mod tests {
    use super::Rate;

    #[test]
    fn nineteen_of_twenty_have_the_interval_of_statsmodels() {
        let found = Rate::of((0..20).map(|i| i > 0));
        assert_eq!((found.n, found.count, found.share), (20, 19, Some(0.95)));
        let [low, high] = found.ci95.expect("twenty");
        // statsmodels 0.15.0 `proportion_confint(19, 20, method="wilson")`.
        assert!((low - 0.763_868_806_553_257_7).abs() < 1e-12, "{low}");
        assert!((high - 0.991_118_551_199_204_4).abs() < 1e-12, "{high}");
    }

    #[test]
    fn an_empty_sample_has_no_share() {
        assert_eq!(Rate::of([]), Rate::default());
    }
}
