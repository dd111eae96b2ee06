//! McNemar's test of two methods on the same pairs.

use super::binomial::binomial_cdf;
use super::interval::Z_975;

/// The 80 % point of the standard normal distribution.
const Z_80: f64 = 0.841_621_233_572_914_3;

/// Counts of pairs on which two methods are right or wrong.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct McNemarTest {
    /// Pairs on which both methods were judged.
    pub n: u64,
    /// Pairs on which only the first is right.
    pub a_only: u64,
    /// Pairs on which only the second is right.
    pub b_only: u64,
}

impl McNemarTest {
    /// Name of the test, as reports give it.
    pub const NAME: &str = "McNemar, exact, two-sided";

    /// Counts one pair.
    pub fn add(&mut self, a_right: bool, b_right: bool) {
        self.n += 1;
        self.a_only += u64::from(a_right && !b_right);
        self.b_only += u64::from(b_right && !a_right);
    }

    /// Returns the two-sided p-value. See [`mcnemar_exact`].
    pub fn p(self) -> Option<f64> {
        mcnemar_exact(self.a_only, self.b_only)
    }

    /// Returns the number of pairs needed to show the observed difference. See [`mcnemar_sample_size`].
    pub fn sample_size(self) -> Option<f64> {
        mcnemar_sample_size(self.a_only, self.b_only, self.n)
    }
}

/// Returns the two-sided p-value of McNemar's exact test from the counts of discordant pairs, or `None` if both are 0.
///
/// The value is `min(1, 2 P(X <= min(a_only, b_only)))`. X is binomial with `a_only + b_only` trials of probability
/// 1/2. Source: McNemar 1947, doi:10.1007/BF02295996, in its exact (binomial) form.
///
/// ```
/// use mocban_results::stats::mcnemar_exact;
///
/// // Five discordant pairs, all for the same method: 2 / 2^5.
/// assert!((mcnemar_exact(0, 5).unwrap() - 0.0625).abs() < 1e-12);
/// assert_eq!(mcnemar_exact(0, 0), None);
/// ```
pub fn mcnemar_exact(a_only: u64, b_only: u64) -> Option<f64> {
    let (fewer, n) = (a_only.min(b_only), a_only + b_only);
    (n > 0).then(|| (2.0 * binomial_cdf(fewer, n, 0.5)).min(1.0))
}

/// Returns the number of pairs for which McNemar's test has 80 % power at the two-sided 5 % level. Returns `None` if
/// `a_only` and `b_only` are equal.
///
/// The true shares of the two kinds of discordant pairs are assumed to be `a_only / n` and `b_only / n`. With psi =
/// `(a_only + b_only) / n` and delta = `|a_only - b_only| / n`, the number is
/// `(1.960 sqrt(psi) + 0.842 sqrt(psi - delta²))² / delta²`. This holds for the asymptotic test; the exact test needs
/// slightly more pairs. Source: Connor 1987, Biometrics 43, p. 207-211.
///
/// ```
/// use mocban_results::stats::mcnemar_sample_size;
///
/// // Published calculators give 23 pairs for discordant shares of 0.45 and 0.05, and 155 for 0.30 and 0.15.
/// assert_eq!(mcnemar_sample_size(45, 5, 100).unwrap().ceil(), 23.0);
/// assert_eq!(mcnemar_sample_size(30, 15, 100).unwrap().ceil(), 155.0);
/// ```
pub fn mcnemar_sample_size(a_only: u64, b_only: u64, n: u64) -> Option<f64> {
    let psi = (a_only + b_only) as f64 / n as f64;
    let delta = a_only.abs_diff(b_only) as f64 / n as f64;
    let spread = Z_975 * psi.sqrt() + Z_80 * (psi - delta * delta).sqrt();
    (a_only != b_only).then(|| (spread / delta).powi(2))
}

#[cfg(test)]
mod tests {
    use super::{McNemarTest, mcnemar_exact, mcnemar_sample_size};

    /// Values from statsmodels 0.15.0 `mcnemar(exact=True)`, which equal SciPy 1.17.1 `binomtest`.
    const MCNEMAR: [(u64, u64, f64); 9] = [
        (3, 1, 0.625),
        (9, 3, 0.145_996_093_75),
        (9, 1, 0.021_484_375),
        (0, 5, 0.0625),
        (6, 6, 1.0),
        (1, 0, 1.0),
        (20, 4, 0.001_543_879_508_972_168),
        (120, 80, 0.005_685_155_996_750_306),
        (1200, 1000, 2.181_702_640_791_419_4e-5),
    ];

    #[test]
    fn p_equals_statsmodels_and_scipy() {
        for (a, b, p) in MCNEMAR {
            let found = mcnemar_exact(a, b).expect("there are discordant pairs");
            assert!((found / p - 1.0).abs() < 1e-10, "{a}/{b}: {found}");
            assert_eq!(mcnemar_exact(b, a), Some(found));
        }
    }

    #[test]
    fn p_of_a_million_pairs_is_still_a_probability() {
        let p = mcnemar_exact(1_000_000, 1_002_000).expect("there are discordant pairs");
        // SciPy 1.17.1 `binomtest(1_000_000, 2_002_000)`.
        assert!((p - 0.157_714_452_813_144_67).abs() < 1e-7, "{p}");
        assert_eq!(mcnemar_exact(0, 100_000), Some(0.0));
    }

    #[test]
    fn only_discordant_pairs_enter_the_test() {
        let mut test = McNemarTest::default();
        for (a, b) in [(true, true), (true, false), (false, false), (false, true)] {
            test.add(a, b);
        }
        assert_eq!((test.n, test.a_only, test.b_only), (4, 1, 1));
        assert_eq!((test.p(), test.sample_size()), (Some(1.0), None));
    }

    /// Returns the power of the exact test with `pairs` pairs, if the counts of discordant pairs are Poisson
    /// distributed.
    fn exact_power(a_rate: f64, b_rate: f64, pairs: f64) -> f64 {
        let mut power = 0.0;
        let mut a_chance = (-a_rate * pairs).exp();
        for a in 0..200_u64 {
            let mut chance = a_chance * (-b_rate * pairs).exp();
            for b in 0..200_u64 {
                let is_significant = mcnemar_exact(a, b).is_some_and(|p| p < 0.05);
                power += if is_significant { chance } else { 0.0 };
                chance *= b_rate * pairs / (b + 1) as f64;
            }
            a_chance *= a_rate * pairs / (a + 1) as f64;
        }
        power
    }

    #[test]
    fn at_the_sample_size_the_exact_test_has_about_the_power_that_is_promised() {
        for (a, b) in [(2, 0), (3, 1), (30, 15)] {
            let pairs = mcnemar_sample_size(a, b, 587).expect("a and b differ");
            let [a_rate, b_rate] = [a, b].map(|count| count as f64 / 587.0);
            let power = exact_power(a_rate, b_rate, pairs);
            assert!((0.72..0.82).contains(&power), "{a}/{b}: {power}");
        }
    }
}
