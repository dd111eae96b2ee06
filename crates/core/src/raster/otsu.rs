//! Otsu's threshold between two classes of values (1979, doi:10.1109/TSMC.1979.4310076).

use crate::domain::cancel::{poll, polled};

/// Two classes of values and the threshold between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// Middle of the classes' nearest members.
    pub threshold: f64,
    /// Median of the lower class.
    pub low: f64,
    /// Median of the upper class.
    pub high: f64,
}

/// Sorts values, and splits them where the variance between the classes is largest. Returns `None` for fewer than two.
pub fn split(values: &mut [f32]) -> Option<Split> {
    sort(values);
    split_sorted(values)
}

/// Sorts values, and splits them without the lowest and the highest `1 / one_in` of the values.
pub fn split_inner(values: &mut [f32], one_in: usize) -> Option<Split> {
    sort(values);
    let cut = values.len() / one_in;
    split_sorted(&values[cut..values.len() - cut])
}

fn split_sorted(values: &[f32]) -> Option<Split> {
    let count = values.len();
    if count < 2 {
        return None;
    }
    poll();
    let total: f64 = values.iter().map(|v| f64::from(*v)).sum();
    let all = count as f64;
    let (mut below, mut best, mut cut) = (0.0, -1.0, 1);
    for (k, v) in polled(values.iter().enumerate().take(count - 1)) {
        below += f64::from(*v);
        let (n, m) = ((k + 1) as f64, (count - k - 1) as f64);
        // n m (below / n - (total - below) / m)^2, with one division.
        let apart = (below * all - total * n).powi(2) / (n * m);
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

/// Bit positions of the digits of a key, lowest first.
const DIGITS: [u32; 3] = [0, 11, 22];
/// Number of values of a digit.
const DIGIT_VALUES: usize = 1 << 11;
/// Fewer values are sorted faster by comparison.
const SHORT: usize = DIGIT_VALUES / 4;

/// Sorts in the order of `total_cmp`: radix sort with three digits.
fn sort(values: &mut [f32]) {
    if values.len() < SHORT {
        values.sort_unstable_by(f32::total_cmp);
        return;
    }
    let mut keys: Vec<u32> = values.iter().map(|v| key(*v)).collect();
    let mut sorted = vec![0; keys.len()];
    let digit = |key: u32, shift: u32| (key >> shift) as usize % DIGIT_VALUES;
    // At first the number of keys with each value of a digit. Later the index in `sorted` for the next such key.
    let mut places = vec![[0_u32; DIGIT_VALUES]; DIGITS.len()];
    poll();
    for key in &keys {
        for (places, shift) in places.iter_mut().zip(DIGITS) {
            places[digit(*key, shift)] += 1;
        }
    }
    for (places, shift) in places.iter_mut().zip(DIGITS) {
        let mut next = 0;
        for place in places.iter_mut() {
            next += std::mem::replace(place, next);
        }
        for part in keys.chunks(KEYS_PER_POLL) {
            poll();
            for key in part {
                let place = &mut places[digit(*key, shift)];
                sorted[*place as usize] = *key;
                *place += 1;
            }
        }
        std::mem::swap(&mut keys, &mut sorted);
    }
    for (value, key) in values.iter_mut().zip(keys) {
        *value = of_key(key);
    }
}

/// Keys that are sorted between two polls for a cancellation.
const KEYS_PER_POLL: usize = 1 << 16;

const SIGN: u32 = 1 << 31;

/// Returns a key that sorts like the value: inverts all bits of a negative value, and the sign bit of any other value.
fn key(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

fn of_key(key: u32) -> f32 {
    f32::from_bits(if key & SIGN == 0 { !key } else { key & !SIGN })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{DIGIT_VALUES, sort, split, split_inner};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20))]
        #[test]
        fn sorts_like_the_standard_library(
            mut values in prop::collection::vec(any::<f32>(), DIGIT_VALUES..DIGIT_VALUES + 500),
        ) {
            let mut wanted = values.clone();
            wanted.sort_by(f32::total_cmp);
            sort(&mut values);
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&values), bits(&wanted));
        }
    }

    #[test]
    fn threshold_lies_between_two_clusters() {
        let mut values: Vec<f32> = (0..30).map(|i| i as f32 * 0.1).collect();
        values.extend((0..90).map(|i| 10.0 + i as f32 * 0.01));
        let parted = split(&mut values).expect("two clusters");
        assert!((2.9..10.0).contains(&parted.threshold));
        assert!((parted.low - 1.5).abs() < 0.1 && (parted.high - 10.45).abs() < 0.1);
        assert!(split(&mut [1.0]).is_none());
    }

    #[test]
    fn extreme_values_can_be_left_out() {
        let mut values: Vec<f32> = (0..100).map(|i| if i < 60 { 1.0 } else { 2.0 }).collect();
        values[0] = -5000.0;
        values[99] = 9000.0;
        let split = split_inner(&mut values, 50).expect("there are two classes");
        assert_eq!((split.low, split.high), (1.0, 2.0));
    }
}
