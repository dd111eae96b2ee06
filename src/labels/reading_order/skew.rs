//! The angle by which a page is turned, from the centres of its boxes.

use super::spot::Spot;

/// Largest angle that is searched, in degrees.
const MAX_DEGREES: f64 = 6.0;
/// Steps of the search in degrees, and how many are tried on both sides of the best angle so far.
const SEARCHES: [(f64, i32); 2] = [(0.25, 24), (0.03, 10)];
/// Smallest number of boxes that show an angle.
const MIN_BOXES: usize = 6;
/// Bins of the histogram in the size of a box.
const BINS_PER_SIZE: f64 = 8.0;
/// Maximum number of bins, for boxes that are far apart.
const MAX_BINS: f64 = 65536.0;
/// Share of the sharpness that the largest angle must gain, so that few boxes are not turned without reason.
const COST: f64 = 0.1;

/// Returns the angle in radians, clockwise on the page, by which columns of boxes of a usual size are turned.
pub(super) fn skew(spots: &[Spot], full_size: f64) -> f64 {
    if spots.len() < MIN_BOXES || full_size <= 0.0 {
        return 0.0;
    }
    let mut best: f64 = 0.0;
    for (step, count) in SEARCHES {
        let start = best;
        let mut highest = f64::NEG_INFINITY;
        // Begins with the smallest change, which wins if others are equal.
        for k in (0..=count).flat_map(|k| [k, -k]) {
            let degrees = start + f64::from(k) * step;
            let cost = COST * (degrees / MAX_DEGREES).abs();
            let score = sharpness(spots, degrees.to_radians(), full_size) * (1.0 - cost);
            if score > highest {
                (best, highest) = (degrees, score);
            }
        }
    }
    // Columns that lean to the left at the bottom are turned clockwise.
    best.to_radians()
}

/// Returns the sum of squared counts of boxes that share a place sideways after turning by an angle in radians.
fn sharpness(spots: &[Spot], angle: f64, full_size: f64) -> f64 {
    let turned = spots.iter().map(|spot| {
        let mut spot = *spot;
        spot.turn(angle);
        spot.u
    });
    let places: Vec<f64> = turned.collect();
    let first = places.iter().copied().fold(f64::INFINITY, f64::min);
    let last = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let bin = (full_size / BINS_PER_SIZE).max((last - first) / MAX_BINS);
    if bin <= 0.0 {
        return 0.0;
    }
    // One bin more on both sides for the smoothing.
    let mut counts = vec![0.0; ((last - first) / bin) as usize + 3];
    for place in places {
        counts[((place - first) / bin) as usize + 1] += 1.0;
    }
    let smooth = |near: &[f64]| near[0] + 2.0 * near[1] + near[2];
    counts.windows(3).map(|near| smooth(near).powi(2)).sum()
}
