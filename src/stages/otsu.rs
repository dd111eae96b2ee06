//! Otsu's split of values into two classes (1979, doi:10.1109/TSMC.1979.4310076).

/// Two classes of values and where they part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Split {
    /// Halfway between the classes' nearest members.
    pub(super) threshold: f64,
    /// Median of the lower class.
    pub(super) low: f64,
    /// Median of the upper class.
    pub(super) high: f64,
}

/// Parts values where the variance between the classes is greatest; `None` for fewer than two values.
///
/// Sorts the values.
pub(super) fn split(values: &mut [f32]) -> Option<Split> {
    values.sort_unstable_by(f32::total_cmp);
    let count = values.len();
    if count < 2 {
        return None;
    }
    let total: f64 = values.iter().map(|v| f64::from(*v)).sum();
    let (mut below, mut best, mut cut) = (0.0, -1.0, 1);
    for (k, v) in values.iter().enumerate().take(count - 1) {
        below += f64::from(*v);
        let (n, m) = ((k + 1) as f64, (count - k - 1) as f64);
        let apart = n * m * (below / n - (total - below) / m).powi(2);
        if apart > best {
            (best, cut) = (apart, k + 1);
        }
    }
    let at = |i: usize| f64::from(values[i]);
    Some(Split {
        threshold: f64::midpoint(at(cut - 1), at(cut)),
        low: at(cut / 2),
        high: at(cut + (count - cut) / 2),
    })
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn two_heaps_part_between_them() {
        let mut values: Vec<f32> = (0..30).map(|i| i as f32 * 0.1).collect();
        values.extend((0..90).map(|i| 10.0 + i as f32 * 0.01));
        let parted = split(&mut values).expect("two heaps");
        assert!((2.9..10.0).contains(&parted.threshold));
        assert!((parted.low - 1.5).abs() < 0.1 && (parted.high - 10.45).abs() < 0.1);
        assert!(split(&mut [1.0]).is_none());
    }
}
