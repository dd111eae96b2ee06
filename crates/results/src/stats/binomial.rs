//! The binomial distribution.

/// Returns P(X <= `count`), in 0..=1, for a binomial X with `n` trials and success probability `p`.
///
/// `p` must lie strictly between 0 and 1, and `count` must be at most `n`. If `count` is at most the mean, the terms of
/// the lower tail are added, so even a tiny result is accurate. Otherwise the upper tail is subtracted from 1.
///
/// ```
/// use mocban_results::stats::binomial_cdf;
///
/// // Four tosses of a fair coin show at most one head in (1 + 4) of 16 cases.
/// assert!((binomial_cdf(1, 4, 0.5) - 5.0 / 16.0).abs() < 1e-12);
/// ```
pub fn binomial_cdf(count: u64, n: u64, p: f64) -> f64 {
    if count as f64 <= p * n as f64 {
        return lower_tail(count, n, p);
    }
    match (n - count).checked_sub(1) {
        Some(others) => 1.0 - lower_tail(others, n, 1.0 - p),
        None => 1.0,
    }
}

/// Sums the terms from `count` down to 0. `count` must be at most the mean, so that the terms shrink.
fn lower_tail(count: u64, n: u64, p: f64) -> f64 {
    let ln_choose: f64 = (0..count.min(n - count))
        .map(|k| ((n - k) as f64 / (k + 1) as f64).ln())
        .sum();
    let odds = p / (1.0 - p);
    let mut term = (ln_choose + (n as f64 * (-p).ln_1p() + count as f64 * odds.ln())).exp();
    let mut sum = 0.0;
    for k in (0..=count).rev() {
        sum += term;
        term *= k as f64 / (n - k + 1) as f64 / odds;
        if term <= sum * f64::EPSILON {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::binomial_cdf;

    #[test]
    fn probabilities_of_three_trials_are_those_of_the_formula() {
        let p: f64 = 0.3;
        let none = (1.0 - p).powi(3);
        let one = 3.0 * p * (1.0 - p).powi(2);
        let wanted = [none, none + one, 1.0 - p.powi(3), 1.0];
        for (count, wanted) in (0..).zip(wanted) {
            let found = binomial_cdf(count, 3, p);
            assert!((found - wanted).abs() < 1e-12, "{count}: {found}");
        }
        assert_eq!(binomial_cdf(99_000, 100_000, 0.01), 1.0);
    }
}
