//! Statistics of the report: Wilson's interval, McNemar's exact test, Holm's correction, the median.

/// The 97.5 % point of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// Chance of at most `count` of `n` where each has the chance `p`, of 0..=1 without the ends; `count` is not above `p n`.
pub(super) fn binomial_tail(count: u64, n: u64, p: f64) -> f64 {
    let ln_choose: f64 = (0..count.min(n - count))
        .map(|k| ((n - k) as f64 / (k + 1) as f64).ln())
        .sum();
    // From the largest term down, until a term adds nothing.
    let odds = p / (1.0 - p);
    let mut term = (ln_choose + (n as f64 * (-p).ln_1p() + count as f64 * odds.ln())).exp();
    let mut tail = 0.0;
    for k in (0..=count).rev() {
        tail += term;
        term *= k as f64 / (n - k + 1) as f64 / odds;
        if term <= tail * f64::EPSILON {
            break;
        }
    }
    tail
}

/// More pairs than these are as good as none.
pub const MOST_PAIRS: u64 = 100_000;

/// Wilson's 95 % score interval for `passed` of `n`, both bounds in 0..=1; `None` when `n` is 0.
///
/// Source: Wilson 1927, doi:10.1080/01621459.1927.10502953, without continuity correction.
pub fn wilson_95(passed: u64, n: u64) -> Option<[f64; 2]> {
    if n == 0 {
        return None;
    }
    let (n, z2) = (n as f64, Z_95 * Z_95);
    let share = passed as f64 / n;
    let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    // The bounds of 0 of n and n of n are exact; rounding would leave them a hair off.
    let low = if share == 0.0 { 0.0 } else { middle - half };
    let high = if share == 1.0 { 1.0 } else { middle + half };
    Some([low, high])
}

/// Two-sided p of McNemar's exact test from the two counts of discordant pairs; `None` when both are 0.
///
/// `p = min(1, 2 P(X <= min(a, b)))` with `X` binomial of `a + b` throws of a fair coin.
/// Source: McNemar 1947, doi:10.1007/BF02295996, in its exact (binomial) form.
pub fn mcnemar_exact(a_only: u64, b_only: u64) -> Option<f64> {
    let (fewer, n) = (a_only.min(b_only), a_only + b_only);
    if n == 0 {
        return None;
    }
    let tail = binomial_tail(fewer, n, 0.5);
    Some((2.0 * tail).min(1.0))
}

/// So many pairs of which `n` gave these discordant ones would give p below `level`, were the rate and the split the same;
/// `None` where both are as many, or where more than [`MOST_PAIRS`] would be needed.
///
/// The lesser count is rounded up, so that the split is never more one-sided than what was seen.
pub fn pairs_needed(a_only: u64, b_only: u64, n: u64, level: f64) -> Option<u64> {
    let (fewer, discordant) = (a_only.min(b_only), a_only + b_only);
    if a_only == b_only {
        return None;
    }
    let mut wanted = 1;
    loop {
        let pairs = (wanted * n).div_ceil(discordant);
        if pairs > MOST_PAIRS {
            return None;
        }
        let lesser = (wanted * fewer).div_ceil(discordant);
        if mcnemar_exact(wanted - lesser, lesser).is_some_and(|p| p < level) {
            return Some(pairs);
        }
        // Large numbers need no exact answer.
        wanted += 1 + wanted / 50;
    }
}

/// Holm's step-down correction: each p made comparable with the level for the whole family, in the order given.
///
/// Source: Holm 1979, <https://www.jstor.org/stable/4615733>.
pub fn holm(ps: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..ps.len()).collect();
    order.sort_by(|a, b| ps[*a].total_cmp(&ps[*b]));
    let mut corrected = vec![1.0; ps.len()];
    let mut floor = 0.0_f64;
    for (rank, index) in order.into_iter().enumerate() {
        floor = floor.max(((ps.len() - rank) as f64 * ps[index]).min(1.0));
        corrected[index] = floor;
    }
    corrected
}

/// The middle value, or the mean of the two middle ones; `None` of nothing. Reorders the values.
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    let upper = *values.get(half)?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(f64::midpoint(values[half - 1], upper))
}

/// The value below which a share (0..=1) of the values lies, linear between two; `None` of nothing. Reorders the values.
///
/// Source: Hyndman and Fan 1996, doi:10.2307/2684934, definition 7.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let place = share.clamp(0.0, 1.0) * values.len().checked_sub(1)? as f64;
    let (low, high) = (
        values[place.floor() as usize],
        values[place.ceil() as usize],
    );
    Some(low + (high - low) * place.fract())
}

#[cfg(test)]
mod tests {
    use super::{holm, mcnemar_exact, median, pairs_needed, quantile, wilson_95};

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

    /// Values of statsmodels 0.15.0 `mcnemar(exact=True)`, equal to SciPy 1.17.1 `binomtest`.
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
    fn wilson_equals_statsmodels() {
        for (passed, n, [low, high]) in WILSON {
            let found = wilson_95(passed, n).expect("n is not 0");
            assert!((found[0] - low).abs() < 1e-12, "{passed}/{n}: {found:?}");
            assert!((found[1] - high).abs() < 1e-12, "{passed}/{n}: {found:?}");
        }
        assert_eq!(wilson_95(0, 0), None);
    }

    #[test]
    fn mcnemar_equals_statsmodels_and_scipy() {
        for (a, b, p) in MCNEMAR {
            let found = mcnemar_exact(a, b).expect("there are discordant pairs");
            assert!((found / p - 1.0).abs() < 1e-10, "{a}/{b}: {found}");
            assert_eq!(mcnemar_exact(b, a), Some(found));
        }
        assert_eq!(mcnemar_exact(0, 0), None);
    }

    #[test]
    fn mcnemar_of_a_million_pairs_is_still_a_probability() {
        let p = mcnemar_exact(1_000_000, 1_002_000).expect("there are discordant pairs");
        // SciPy 1.17.1 `binomtest(1_000_000, 2_002_000)`.
        assert!((p - 0.157_714_452_813_144_67).abs() < 1e-7, "{p}");
        assert_eq!(mcnemar_exact(0, 100_000), Some(0.0));
    }

    #[test]
    fn six_discordant_pairs_one_way_are_the_fewest_that_tell() {
        assert_eq!(pairs_needed(2, 0, 587, 0.05), Some(1761));
        assert_eq!(pairs_needed(0, 1, 587, 0.05), Some(3522));
        // SciPy 1.17.1: 15 of 20 has p 0.041, 14 of 19 has 0.064.
        assert_eq!(pairs_needed(3, 1, 587, 0.05), Some(2935));
        assert_eq!(pairs_needed(4, 4, 587, 0.05), None);
        assert_eq!(pairs_needed(1000, 1001, 100_000, 0.05), None);
    }

    #[test]
    fn holm_keeps_order_and_never_exceeds_one() {
        let corrected = holm(&[0.04, 0.01, 0.6]);
        assert!((corrected[0] - 0.08).abs() < 1e-15);
        assert!((corrected[1] - 0.03).abs() < 1e-15);
        assert!((corrected[2] - 0.6).abs() < 1e-15);
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }

    #[test]
    fn median_of_even_odd_and_none() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&mut []), None);
    }

    #[test]
    fn quantile_is_exact_at_values_and_linear_between() {
        let mut values = [4.0, 1.0, 3.0, 2.0, 10.0];
        let mut at = |share| quantile(&mut values, share);
        assert_eq!([at(0.0), at(0.5), at(1.0)], [1.0, 3.0, 10.0].map(Some));
        // NumPy 2 `quantile([1, 2, 3, 4, 10], 0.95)`.
        let found = at(0.95).expect("there are values");
        assert!((found - 8.8).abs() < 1e-12, "{found}");
        assert_eq!(quantile(&mut [], 0.5), None);
        assert_eq!(quantile(&mut [7.0], 0.3), Some(7.0));
    }
}
