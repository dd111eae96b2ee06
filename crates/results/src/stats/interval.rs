//! Confidence intervals of a proportion.

use serde::Serialize;

use super::binomial::binomial_cdf;
use mocban_core::domain::enum_names;

/// The 97.5 % point of the standard normal distribution.
pub(super) const Z_975: f64 = 1.959_963_984_540_054;

/// How the 95 % interval of a proportion is computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum IntervalMethod {
    /// Wilson's score interval: its coverage is 95 % on average.
    #[default]
    Wilson,
    /// The interval of Clopper and Pearson. Its coverage is at least 95 %, and usually more.
    Exact,
}

impl IntervalMethod {
    /// Returns the header of a column of intervals.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Wilson => "95 % Wilson",
            Self::Exact => "95 % exact",
        }
    }

    /// Returns the 95 % interval of `count / n`, with both bounds in 0..=1, or `None` if `n` is 0.
    pub fn interval_95(self, count: u64, n: u64) -> Option<[f64; 2]> {
        match self {
            Self::Wilson => wilson_95(count, n),
            Self::Exact => clopper_pearson_95(count, n),
        }
    }
}

enum_names! { pub IntervalMethod, "an interval": Wilson = "wilson", Exact = "exact" }

/// Returns Wilson's 95 % score interval of `count / n`, with both bounds in 0..=1, or `None` if `n` is 0.
///
/// With p = `count / n` and z = 1.96, the bounds are `(p + z²/2n ± z sqrt(p (1 - p) / n + z²/4n²)) / (1 + z²/n)`,
/// without continuity correction. Source: Wilson 1927, doi:10.1080/01621459.1927.10502953.
///
/// ```
/// use mocban_results::stats::wilson_95;
///
/// // statsmodels: proportion_confint(584, 587, method="wilson") is 0.98508, 0.99826.
/// let [low, high] = wilson_95(584, 587).unwrap();
/// assert!((low - 0.98508).abs() < 1e-5 && (high - 0.99826).abs() < 1e-5);
/// ```
pub fn wilson_95(count: u64, n: u64) -> Option<[f64; 2]> {
    if n == 0 {
        return None;
    }
    let (n, z2) = (n as f64, Z_975 * Z_975);
    let share = count as f64 / n;
    let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_975 / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    // If `count` is 0 or `n`, rounding errors could shift the bound that is exactly 0 or 1.
    let low = if share == 0.0 { 0.0 } else { middle - half };
    let high = if share == 1.0 { 1.0 } else { middle + half };
    Some([low, high])
}

/// Returns the exact 95 % interval of `count / n`, with both bounds in 0..=1, or `None` if `n` is 0.
///
/// At the lower bound, `count` or more successes have a probability of 2.5 %. At the upper bound, `count` or fewer
/// successes have that probability. Source: Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404.
///
/// ```
/// use mocban_results::stats::clopper_pearson_95;
///
/// // All of n succeed: the lower bound solves p^n = 0.025.
/// let [low, high] = clopper_pearson_95(10, 10).unwrap();
/// assert!((low.powi(10) - 0.025).abs() < 1e-9);
/// assert_eq!(high, 1.0);
/// ```
pub fn clopper_pearson_95(count: u64, n: u64) -> Option<[f64; 2]> {
    (n > 0).then(|| [1.0 - upper_bound(n - count, n), upper_bound(count, n)])
}

/// Returns the proportion for which `n` trials give at most `count` successes with a probability of 2.5 %.
fn upper_bound(count: u64, n: u64) -> f64 {
    let (mut low, mut high) = (count as f64 / n as f64, 1.0);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if binomial_cdf(count, n, middle) > 0.025 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::{IntervalMethod, clopper_pearson_95, wilson_95};

    /// Values of statsmodels 0.15.0 `proportion_confint(method="wilson")`.
    const WILSON: [(u64, u64, [f64; 2]); 8] = [
        (584, 587, [0.985_082_917_759_498_6, 0.998_260_399_345_672_9]),
        (578, 587, [0.971_120_192_604_173_3, 0.991_913_107_624_521_1]),
        (586, 587, [0.990_414_109_317_094_5, 0.999_699_213_413_586_4]),
        (0, 10, [0.0, 0.277_532_799_862_889_26]),
        (10, 10, [0.722_467_200_137_110_6, 1.0]),
        (1, 1, [0.206_549_314_377_237_4, 1.0]),
        (37, 50, [0.604_468_427_351_511_6, 0.841_284_725_064_476]),
        (587, 587, [0.993_498_325_543_435, 1.0]),
    ];

    /// Values of statsmodels 0.15.0 `proportion_confint(method="beta")`.
    const EXACT: [(u64, u64, [f64; 2]); 8] = [
        (584, 587, [0.985_137_485_406_516_2, 0.998_944_801_454_672_8]),
        (578, 587, [0.971_094_935_018_714_7, 0.992_965_799_897_107_3]),
        (586, 587, [0.990_545_152_725_619_7, 0.999_956_870_081_766_8]),
        (0, 10, [0.0, 0.308_497_107_818_760_83]),
        (10, 10, [0.691_502_892_181_239_2, 1.0]),
        (1, 1, [0.025, 1.0]),
        (37, 50, [0.596_552_321_271_934_2, 0.853_699_415_603_445_5]),
        (
            99_990,
            100_000,
            [0.999_816_104_154_623_3, 0.999_952_045_104_861],
        ),
    ];

    fn assert_bounds(found: Option<[f64; 2]>, wanted: [f64; 2], tolerance: f64) {
        let found = found.expect("n is not 0");
        for (bound, wanted) in found.into_iter().zip(wanted) {
            assert!((bound - wanted).abs() < tolerance, "{found:?} {wanted:?}");
        }
    }

    #[test]
    fn wilson_equals_statsmodels() {
        for (count, n, wanted) in WILSON {
            assert_bounds(wilson_95(count, n), wanted, 1e-12);
        }
        assert_eq!(wilson_95(0, 0), None);
    }

    #[test]
    fn exact_equals_statsmodels() {
        for (count, n, wanted) in EXACT {
            assert_bounds(clopper_pearson_95(count, n), wanted, 1e-10);
        }
        assert_eq!(clopper_pearson_95(0, 0), None);
    }

    #[test]
    fn every_method_is_found_by_its_name() {
        for method in IntervalMethod::ALL {
            assert_eq!(method.name().parse(), Ok(method));
        }
        assert!("normal".parse::<IntervalMethod>().is_err());
    }
}
