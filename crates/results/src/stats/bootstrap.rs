//! The bootstrap of means, which resamples units with replacement.
//!
//! Source: Efron 1979, doi:10.1214/aos/1176344552.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::quantile::quantile;
use mocban_core::domain::cancel::ThreadToken;

/// Seed of the resamples, so that equal results have equal intervals.
pub const BOOTSTRAP_SEED: u64 = 1;
/// Most resamples.
const MAX_RESAMPLES: usize = 10_000;
/// Fewest resamples, however many units there are.
const MIN_RESAMPLES: usize = 1000;
/// Large samples get fewer resamples to draw at most this number of units in total, but at least `MIN_RESAMPLES`.
const MAX_DRAWS: usize = 50_000_000;
/// Resamples that one thread adds up in one pass over the units.
const STREAMS_PER_PASS: usize = 8;

/// One unit's `[sum, count]` for each quantity. The mean of a quantity is its total sum divided by its total count.
pub type QuantitySums = Vec<[f64; 2]>;

/// Returns the number of resamples for a sample of `units` units. It is 10,000 for up to 5,000 units, and falls to
/// 1,000 for larger samples. Returns 0 for an empty sample.
///
/// ```
/// use mocban_results::stats::resample_count;
///
/// assert_eq!([0, 587, 10_000, 1_000_000].map(resample_count), [0, 10_000, 5_000, 1_000]);
/// ```
pub fn resample_count(units: usize) -> usize {
    match MAX_DRAWS.checked_div(units) {
        None => 0,
        Some(affordable) => affordable.clamp(MIN_RESAMPLES, MAX_RESAMPLES),
    }
}

/// Returns the mean of each of the `width` quantities in every resample. Resamples that contain no value of a quantity
/// are skipped for that quantity.
///
/// All quantities use the same drawn units, so the means of two quantities can be compared resample by resample. The
/// result depends on the order of the units, not on the number of threads.
///
/// ```
/// use mocban_results::stats::{percentile_interval_95, resampled_means};
///
/// // Forty units, half of them 0 and half 1: the standard error of the mean is 0.079.
/// let units: Vec<_> = (0..40).map(|i| vec![[f64::from(i % 2), 1.0]]).collect();
/// let mut means = resampled_means(&units, 1).remove(0);
/// let [low, high] = percentile_interval_95(&mut means).unwrap();
/// assert!((low - 0.35).abs() < 0.03 && (high - 0.65).abs() < 0.03);
/// ```
pub fn resampled_means(units: &[QuantitySums], width: usize) -> Vec<Vec<f64>> {
    let flat = units.concat();
    let streams: Vec<u64> = (0..resample_count(units.len()) as u64).collect();
    let token = ThreadToken::current();
    let totals: Vec<QuantitySums> = streams
        .par_chunks(STREAMS_PER_PASS)
        .flat_map_iter(|streams| token.scope(|| resample(&flat, width, streams)))
        .collect();
    let means = |quantity: usize| {
        let all = totals.iter().map(move |sums| sums[quantity]);
        all.filter(|[_, n]| *n > 0.0)
            .map(|[sum, n]| sum / n)
            .collect()
    };
    (0..width).map(means).collect()
}

/// Returns the sums of one resample for each random stream. A resample draws as many units as the sample has, with
/// replacement.
///
/// `units` is flat: `width` entries for each unit. Reading the units takes most of the time if there are many, so one
/// pass over them serves all streams.
fn resample(units: &[[f64; 2]], width: usize, streams: &[u64]) -> Vec<QuantitySums> {
    let count = units.len() / width.max(1);
    let multiplicities: Vec<Vec<u32>> = streams
        .iter()
        .map(|stream| multiplicities(count, *stream))
        .collect();
    let mut totals = vec![vec![[0.0; 2]; width]; streams.len()];
    for (i, unit) in units.chunks_exact(width.max(1)).enumerate() {
        for (total, multiplicities) in totals.iter_mut().zip(&multiplicities) {
            let times = f64::from(multiplicities[i]);
            if times == 0.0 {
                continue;
            }
            for ([sum, n], [unit_sum, unit_n]) in total.iter_mut().zip(unit) {
                *sum += times * unit_sum;
                *n += times * unit_n;
            }
        }
    }
    totals
}

/// Returns how often each of `count` units is drawn in one resample.
fn multiplicities(count: usize, stream: u64) -> Vec<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(BOOTSTRAP_SEED);
    rng.set_stream(stream);
    let mut times = vec![0; count];
    for _ in 0..count {
        times[rng.random_range(0..count)] += 1;
    }
    times
}

/// Returns the percentile interval: the 2.5 % and 97.5 % quantiles of resampled means. Returns `None` without means.
///
/// Sorts `means`.
pub fn percentile_interval_95(means: &mut [f64]) -> Option<[f64; 2]> {
    Some([quantile(means, 0.025)?, quantile(means, 0.975)?])
}

/// Returns the two-sided p-value, in 0..=1, of the hypothesis that the true difference is 0. Returns `None` if
/// `differences` is empty.
///
/// The p-value is `2 (m + 1) / (n + 1)`, at most 1, for `n` differences. `m` is the number of differences that are at
/// most 0, or the number that are at least 0, whichever is smaller. Source: Davison and Hinkley 1997, section 4.4,
/// doi:10.1017/CBO9780511802843.
///
/// ```
/// use mocban_results::stats::bootstrap_p;
///
/// // None of 99 differences is at or below 0: 2 * (0 + 1) / (99 + 1).
/// assert_eq!(bootstrap_p(&[0.5; 99]), Some(0.02));
/// assert_eq!(bootstrap_p(&[0.0; 99]), Some(1.0));
/// ```
pub fn bootstrap_p(differences: &[f64]) -> Option<f64> {
    let n = differences.len();
    let below = differences.iter().filter(|found| **found <= 0.0).count();
    let above = differences.iter().filter(|found| **found >= 0.0).count();
    let rarer = below.min(above) + 1;
    (n > 0).then(|| (2.0 * rarer as f64 / (n + 1) as f64).min(1.0))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::{
        BOOTSTRAP_SEED, MAX_RESAMPLES, QuantitySums, bootstrap_p, percentile_interval_95, resample,
        resampled_means,
    };

    /// Differences of 40 pairs, unevenly spread around 0.01.
    fn differences() -> Vec<f64> {
        let pairs = (0..40).map(f64::from);
        pairs
            .map(|i| (0.8 + 0.1 * i.sin()) - (0.79 + 0.1 * i.sin() + 0.03 * (3.0 * i).cos()))
            .collect()
    }

    /// Draws a resample in the plain way: adds one unit after another.
    fn resample_slowly(units: &[QuantitySums], width: usize, stream: u64) -> QuantitySums {
        let mut rng = ChaCha8Rng::seed_from_u64(BOOTSTRAP_SEED);
        rng.set_stream(stream);
        let mut total = vec![[0.0; 2]; width];
        for _ in 0..units.len() {
            let unit = &units[rng.random_range(0..units.len())];
            for ([sum, n], [more, results]) in total.iter_mut().zip(unit) {
                *sum += more;
                *n += results;
            }
        }
        total
    }

    #[test]
    fn resamples_added_up_in_one_pass_equal_those_drawn_singly() {
        let sums = |i: f64| vec![[i.sin(), 1.0], [i.cos(), 1.0 + (i % 3.0)], [0.0, 0.0]];
        let units: Vec<QuantitySums> = (0..50).map(|i| sums(f64::from(i))).collect();
        let streams = [4, 0, 7];
        let found = resample(&units.concat(), 3, &streams);
        for (found, stream) in found.iter().zip(streams) {
            for (found, wanted) in found.iter().zip(resample_slowly(&units, 3, stream)) {
                assert!((found[0] - wanted[0]).abs() < 1e-9, "{found:?} {wanted:?}");
                assert_eq!(found[1], wanted[1]);
            }
        }
    }

    /// Asserts that bounds from 10,000 resamples lie within four standard errors of bounds from a million resamples.
    fn assert_near(found: [f64; 2], wanted: [f64; 2], deviation: f64) {
        for (found, wanted) in found.into_iter().zip(wanted) {
            assert!(
                (found - wanted).abs() < 0.11 * deviation,
                "{found} {wanted}"
            );
        }
    }

    #[test]
    fn resampled_pairs_have_the_interval_of_scipy() {
        let units: Vec<QuantitySums> = differences().into_iter().map(|d| vec![[d, 1.0]]).collect();
        let mut means = resampled_means(&units, 1).remove(0);
        assert_eq!(means.len(), MAX_RESAMPLES);
        // SciPy 1.17.1 `bootstrap(method="percentile", n_resamples=1_000_000)`.
        let wanted = [0.003_584_218, 0.016_222_326];
        let found = percentile_interval_95(&mut means).expect("means");
        assert_near(found, wanted, 0.003_227_767);
        let p = bootstrap_p(&means).expect("means");
        assert!((0.0008..0.0036).contains(&p), "{p}");
    }

    #[test]
    fn resampled_blocks_have_the_interval_of_numpy() {
        let units: Vec<QuantitySums> = differences()
            .chunks(3)
            .map(|block| vec![[block.iter().sum(), block.len() as f64]])
            .collect();
        assert_eq!(units.len(), 14);
        let mut means = resampled_means(&units, 1).remove(0);
        // The bounds are from NumPy 2.4.6: a million resamples of the blocks, drawn with `integers`.
        let found = percentile_interval_95(&mut means).expect("means");
        assert_near(found, [0.006_332_87, 0.013_707_07], 0.001_885_758);
        assert_eq!(bootstrap_p(&means), Some(2.0 / 10_001.0));
    }

    #[test]
    fn quantities_are_computed_from_the_same_draws() {
        let units: Vec<QuantitySums> = differences()
            .into_iter()
            .map(|d| vec![[d, 1.0], [d + 0.5, 1.0], [0.0, 0.0]])
            .collect();
        let means = resampled_means(&units, 3);
        let apart = means[0].iter().zip(&means[1]);
        assert!(apart.into_iter().all(|(a, b)| (b - a - 0.5).abs() < 1e-12));
        assert!(means[2].is_empty(), "a quantity that no result has");
    }

    #[test]
    fn without_differences_there_is_no_p() {
        assert_eq!(bootstrap_p(&[]), None);
    }
}
