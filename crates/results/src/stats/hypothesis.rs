//! Correction for several tests at once.

/// The level below which a p-value counts as significant.
pub const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// Returns the p-values adjusted by Holm's step-down method, each in 0..=1, in the given order.
///
/// The i-th smallest of m values is multiplied by m - i + 1. A larger p-value never gets a smaller adjusted value.
/// Source: Holm 1979, <https://www.jstor.org/stable/4615733>.
///
/// ```
/// use mocban_results::stats::holm;
///
/// // R: p.adjust(c(0.04, 0.01, 0.6), "holm") is 0.08, 0.03, 0.60.
/// let adjusted = holm(&[0.04, 0.01, 0.6]);
/// for (found, wanted) in adjusted.iter().zip([0.08, 0.03, 0.6]) {
///     assert!((found - wanted).abs() < 1e-12);
/// }
/// ```
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut adjusted = vec![1.0; p_values.len()];
    let mut floor = 0.0_f64;
    for (rank, index) in order.into_iter().enumerate() {
        floor = floor.max(((p_values.len() - rank) as f64 * p_values[index]).min(1.0));
        adjusted[index] = floor;
    }
    adjusted
}

/// Applies [`holm`] to a family of tests. Some tests may have no p-value.
///
/// For example, `McNemar`'s test has no p-value without discordant pairs. Such a test gets `None`, but still counts in
/// the size of the family.
///
/// ```
/// use mocban_results::stats::holm_of_known;
///
/// assert_eq!(holm_of_known(&[Some(0.25), None]), [Some(0.5), None]);
/// ```
pub fn holm_of_known(p_values: &[Option<f64>]) -> Vec<Option<f64>> {
    let all: Vec<f64> = p_values.iter().map(|p| p.unwrap_or(1.0)).collect();
    let adjusted = p_values.iter().zip(holm(&all));
    adjusted.map(|(p, holm)| p.map(|_| holm)).collect()
}

#[cfg(test)]
mod tests {
    use super::holm;

    #[test]
    fn adjusted_values_never_exceed_one() {
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
