//! A count out of a number, with its share and interval.

use serde::Serialize;

use super::accumulate::share;
use super::interval::IntervalMethod;

/// So many of so many.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Rate {
    /// Of how many.
    pub n: u64,
    /// How many.
    pub count: u64,
    /// `count / n`; `None` of nothing.
    pub share: Option<f64>,
    /// 95 % interval of `share`: Wilson's, unless another is asked for.
    pub ci95: Option<[f64; 2]>,
}

impl Rate {
    /// From the counts.
    pub fn new(count: u64, n: u64) -> Self {
        Self {
            n,
            count,
            share: share(count as f64, n),
            ci95: IntervalMethod::Wilson.of(count, n),
        }
    }

    /// The same with another interval.
    #[must_use]
    pub fn with_interval(self, interval: IntervalMethod) -> Self {
        Self {
            ci95: interval.of(self.count, self.n),
            ..self
        }
    }

    /// Of what is told one by one.
    pub fn of(told: impl IntoIterator<Item = bool>) -> Self {
        let (mut count, mut n) = (0, 0);
        for hit in told {
            n += 1;
            count += u64::from(hit);
        }
        Self::new(count, n)
    }

    /// Of several together.
    pub fn total(rates: impl Iterator<Item = Self>) -> Self {
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
    fn nothing_has_no_share() {
        assert_eq!(Rate::of([]), Rate::default());
    }
}
