//! Means over units drawn anew with replacement, many times: how far chance alone moves them.
//!
//! Source: Efron 1979, doi:10.1214/aos/1176344552; the interval is that of percentiles.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::stats::quantile;

/// The seed, so that the same results always have the same intervals.
pub(super) const SEED: u64 = 1;
/// How often units are drawn anew.
pub(super) const RESAMPLES: usize = 10_000;
/// No fewer than these when there are many units.
const FEWEST_RESAMPLES: usize = 1000;
/// About so many draws in all, so that many units do not take minutes.
const DRAWS: usize = 50_000_000;

/// Resamples that are added up together.
const TOGETHER: usize = 8;

/// What a unit, a pair or a block, adds to each quantity: its sum there, and over how many results.
pub(super) type QuantitySums = Vec<[f64; 2]>;

/// How often so many units are drawn anew.
pub(super) const fn resamples(units: usize) -> usize {
    if units == 0 {
        return 0;
    }
    let most = DRAWS / units;
    if most > RESAMPLES {
        RESAMPLES
    } else if most < FEWEST_RESAMPLES {
        FEWEST_RESAMPLES
    } else {
        most
    }
}

/// Every quantity's mean in each resample, where it exists there; the units all have `width` quantities.
///
/// All quantities are of the same draws, so that differences of them are paired. The order of the units counts, the
/// number of threads does not.
pub(super) fn resampled_means(units: &[QuantitySums], width: usize) -> Vec<Vec<f64>> {
    let flat = units.concat();
    let streams: Vec<u64> = (0..resamples(units.len()) as u64).collect();
    let drawn: Vec<QuantitySums> = streams
        .par_chunks(TOGETHER)
        .flat_map_iter(|streams| draw(&flat, width, streams))
        .collect();
    let mean = |quantity: usize| {
        let all = drawn.iter().map(move |sums| sums[quantity]);
        all.filter(|[_, n]| *n > 0.0)
            .map(|[sum, n]| sum / n)
            .collect()
    };
    (0..width).map(mean).collect()
}

/// For each stream as many units as there are, drawn with replacement and added up. All units lie one after another,
/// and each is read once for all streams: where there are many, reading them is what takes the time.
fn draw(units: &[[f64; 2]], width: usize, streams: &[u64]) -> Vec<QuantitySums> {
    let count = units.len() / width.max(1);
    let drawn: Vec<Vec<u32>> = streams.iter().map(|stream| times(count, *stream)).collect();
    let mut totals = vec![vec![[0.0; 2]; width]; streams.len()];
    for (i, unit) in units.chunks_exact(width.max(1)).enumerate() {
        for (total, drawn) in totals.iter_mut().zip(&drawn) {
            let times = f64::from(drawn[i]);
            if times == 0.0 {
                continue;
            }
            for ([sum, n], [more, results]) in total.iter_mut().zip(unit) {
                *sum += times * more;
                *n += times * results;
            }
        }
    }
    totals
}

/// How often each of so many units is drawn.
fn times(count: usize, stream: u64) -> Vec<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(stream);
    let mut times = vec![0; count];
    for _ in 0..count {
        times[rng.random_range(0..count)] += 1;
    }
    times
}

/// The middle 95 % of resampled means; `None` of none. Reorders them.
pub(super) fn middle_95(means: &mut [f64]) -> Option<[f64; 2]> {
    Some([quantile(means, 0.025)?, quantile(means, 0.975)?])
}

/// Two-sided p of a difference of 0 from the resampled differences: twice the share on the rarer side of 0, with the
/// sample itself counted among them, so that it is never 0; `None` of none.
///
/// Source: Davison and Hinkley 1997, section 4.4, doi:10.1017/CBO9780511802843.
pub(super) fn two_sided_p(differences: &[f64]) -> Option<f64> {
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
        FEWEST_RESAMPLES, QuantitySums, RESAMPLES, SEED, draw, middle_95, resampled_means,
        resamples, two_sided_p,
    };

    /// Differences of 40 pairs, unevenly spread around 0.01.
    fn differences() -> Vec<f64> {
        let pairs = (0..40).map(f64::from);
        pairs
            .map(|i| (0.8 + 0.1 * i.sin()) - (0.79 + 0.1 * i.sin() + 0.03 * (3.0 * i).cos()))
            .collect()
    }

    /// Units drawn one after another, as the text books say it.
    fn slow(units: &[QuantitySums], width: usize, stream: u64) -> QuantitySums {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
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
    fn resamples_added_up_together_are_those_drawn_one_by_one() {
        let sums = |i: f64| vec![[i.sin(), 1.0], [i.cos(), 1.0 + (i % 3.0)], [0.0, 0.0]];
        let units: Vec<QuantitySums> = (0..50).map(|i| sums(f64::from(i))).collect();
        let streams = [4, 0, 7];
        let found = draw(&units.concat(), 3, &streams);
        for (found, stream) in found.iter().zip(streams) {
            for (found, wanted) in found.iter().zip(slow(&units, 3, stream)) {
                assert!((found[0] - wanted[0]).abs() < 1e-9, "{found:?} {wanted:?}");
                assert_eq!(found[1], wanted[1]);
            }
        }
    }

    /// Whether bounds are those of a million resamples, within four standard errors of a bound of ten thousand.
    fn assert_near(found: [f64; 2], wanted: [f64; 2], deviation: f64) {
        for (found, wanted) in found.into_iter().zip(wanted) {
            assert!(
                (found - wanted).abs() < 0.11 * deviation,
                "{found} {wanted}"
            );
        }
    }

    #[test]
    fn pairs_drawn_anew_have_the_interval_of_scipy() {
        let units: Vec<QuantitySums> = differences().into_iter().map(|d| vec![[d, 1.0]]).collect();
        let mut means = resampled_means(&units, 1).remove(0);
        assert_eq!(means.len(), RESAMPLES);
        // SciPy 1.17.1 `bootstrap(method="percentile", n_resamples=1_000_000)`.
        let wanted = [0.003_584_218, 0.016_222_326];
        let found = middle_95(&mut means).expect("means");
        assert_near(found, wanted, 0.003_227_767);
        let p = two_sided_p(&means).expect("means");
        assert!((0.0008..0.0036).contains(&p), "{p}");
    }

    #[test]
    fn blocks_drawn_whole_have_the_interval_of_numpy() {
        let units: Vec<QuantitySums> = differences()
            .chunks(3)
            .map(|block| vec![[block.iter().sum(), block.len() as f64]])
            .collect();
        assert_eq!(units.len(), 14);
        let mut means = resampled_means(&units, 1).remove(0);
        // NumPy 2.4.6: sums and counts of blocks drawn with `integers`, a million times.
        let found = middle_95(&mut means).expect("means");
        assert_near(found, [0.006_332_87, 0.013_707_07], 0.001_885_758);
        assert_eq!(two_sided_p(&means), Some(2.0 / 10_001.0));
    }

    #[test]
    fn quantities_are_of_the_same_draws() {
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
    fn a_difference_that_is_always_nought_is_as_sure_as_can_be() {
        assert_eq!(two_sided_p(&[0.0; 99]), Some(1.0));
        assert_eq!(two_sided_p(&[0.5; 99]), Some(0.02));
        assert_eq!(two_sided_p(&[]), None);
    }

    #[test]
    fn many_units_are_drawn_less_often_and_none_never() {
        assert_eq!([0, 587, 5000].map(resamples), [0, RESAMPLES, RESAMPLES]);
        assert_eq!([10_000, 1_000_000].map(resamples), [5000, FEWEST_RESAMPLES]);
    }
}
