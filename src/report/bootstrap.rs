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

/// What a unit, a pair or a block, adds to each quantity: its sum there, and over how many results.
pub(super) type Sums = Vec<[f64; 2]>;

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
pub(super) fn resampled_means(units: &[Sums], width: usize) -> Vec<Vec<f64>> {
    let drawn: Vec<Sums> = (0..resamples(units.len()) as u64)
        .into_par_iter()
        .map(|stream| draw(units, width, stream))
        .collect();
    let mean = |quantity: usize| {
        let all = drawn.iter().map(move |sums| sums[quantity]);
        all.filter(|[_, n]| *n > 0.0)
            .map(|[sum, n]| sum / n)
            .collect()
    };
    (0..width).map(mean).collect()
}

/// As many units as there are, drawn with replacement and added up.
fn draw(units: &[Sums], width: usize, stream: u64) -> Sums {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(stream);
    let mut total = vec![[0.0; 2]; width];
    for _ in 0..units.len() {
        let unit = &units[rng.random_range(0..units.len())];
        for ([sum, n], [more, times]) in total.iter_mut().zip(unit) {
            *sum += more;
            *n += times;
        }
    }
    total
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
    use super::{
        FEWEST_RESAMPLES, RESAMPLES, Sums, middle_95, resampled_means, resamples, two_sided_p,
    };

    /// Differences of 40 pairs, unevenly spread around 0.01.
    fn differences() -> Vec<f64> {
        let pairs = (0..40).map(f64::from);
        pairs
            .map(|i| (0.8 + 0.1 * i.sin()) - (0.79 + 0.1 * i.sin() + 0.03 * (3.0 * i).cos()))
            .collect()
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
        let units: Vec<Sums> = differences().into_iter().map(|d| vec![[d, 1.0]]).collect();
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
        let units: Vec<Sums> = differences()
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
        let units: Vec<Sums> = differences()
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
