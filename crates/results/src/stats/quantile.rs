//! Order statistics.

/// Returns the middle value, or the mean of the two middle values. Returns `None` without values. Sorts `values`.
///
/// ```
/// use mocban_results::stats::median;
///
/// assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
/// assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), Some(2.5));
/// ```
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    let upper = *values.get(half)?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(f64::midpoint(values[half - 1], upper))
}

/// Returns the quantile at `share` (0..=1), linearly interpolated between order statistics, or `None` without values.
///
/// Sorts `values`. Source: Hyndman and Fan 1996, doi:10.2307/2684934, definition 7 (the default of `NumPy` and R).
///
/// ```
/// use mocban_results::stats::quantile;
///
/// // NumPy: np.quantile([1, 2, 3, 4, 10], 0.95) is 8.8.
/// let found = quantile(&mut [4.0, 1.0, 3.0, 2.0, 10.0], 0.95).unwrap();
/// assert!((found - 8.8).abs() < 1e-12);
/// ```
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
    use super::{median, quantile};

    #[test]
    fn quantile_is_exact_at_values_and_none_without_any() {
        let mut values = [4.0, 1.0, 3.0, 2.0, 10.0];
        let mut at = |share| quantile(&mut values, share);
        assert_eq!([at(0.0), at(0.5), at(1.0)], [1.0, 3.0, 10.0].map(Some));
        assert_eq!(quantile(&mut [7.0], 0.3), Some(7.0));
        assert_eq!((quantile(&mut [], 0.5), median(&mut [])), (None, None));
    }
}
