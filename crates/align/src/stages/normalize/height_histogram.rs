//! Histogram of the heights below the tops. The profile of steepness uses the same bins of depth.

use mocban_core::domain::ReliefHeights;

/// Width of a bin and depth of the first, as fractions of the relief.
const BIN: f64 = 0.005;
const FROM: f64 = -0.3;
/// Number of bins. The last one ends at a depth of 1.2.
pub(super) const BINS: usize = 300;
/// Largest distance of the peak from the first estimate of the tops.
const NEAR: f64 = 0.25;
/// Number of bins averaged.
const FINE: usize = 3;

/// Frequency of each depth below the tops.
#[derive(Debug, Clone)]
pub(super) struct HeightHistogram {
    counts: Vec<f64>,
}

impl HeightHistogram {
    /// Counts heights by their depth below the tops.
    pub(super) fn of(heights: &[f32], relief: &ReliefHeights) -> Self {
        let mut counts = vec![0.0; BINS];
        for height in heights {
            let share = (relief.top - f64::from(*height)) / relief.depth();
            if let Some(bin) = bin_with(share) {
                counts[bin] += 1.0;
            }
        }
        Self { counts }
    }

    /// Returns the depth of the peak near the tops, as a fraction of the relief.
    pub(super) fn peak(&self) -> f64 {
        middle(peak_bin(&smoothed(&self.counts, FINE)))
    }
}

/// Returns the fullest bin near depth zero.
fn peak_bin(fine: &[f64]) -> usize {
    let near = bin_of(-NEAR)..bin_of(NEAR);
    near.max_by(|a, b| fine[*a].total_cmp(&fine[*b]))
        .unwrap_or(bin_of(0.0))
}

/// Returns the bin that contains a depth, or `None` if the depth is outside the range.
#[inline(always)]
pub(super) fn bin_with(share: f64) -> Option<usize> {
    let bin = (share - FROM) / BIN;
    (bin >= 0.0 && bin < BINS as f64).then_some(bin as usize)
}

/// Returns the bin that begins next to a depth.
pub(super) fn bin_of(share: f64) -> usize {
    ((share - FROM) / BIN).round() as usize
}

/// Returns the depth in the middle of a bin, as a fraction of the relief.
pub(super) fn middle(bin: usize) -> f64 {
    FROM + (bin as f64 + 0.5) * BIN
}

/// Computes running means over `width` bins.
pub(super) fn smoothed(counts: &[f64], width: usize) -> Vec<f64> {
    let half = width / 2;
    (0..counts.len())
        .map(|i| {
            let near = &counts[i.saturating_sub(half)..(i + width - half).min(counts.len())];
            near.iter().sum::<f64>() / near.len() as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::HeightHistogram;
    use mocban_core::domain::ReliefHeights;

    #[test]
    fn peak_is_the_depth_of_most_tops() {
        let relief = ReliefHeights {
            top: 0.0,
            ground: -1.0,
            tops_end: 0.0,
            tops_end_log_deviation: 0.0,
        };
        // Most tops are worn by 0.06, walls are spread evenly from 0 to 1, and ground lies at 1.
        let tops = (0..4000).map(|i| -0.04 - 0.04 * (i % 100) as f32 / 100.0);
        let walls = (0..3000).map(|i| -(i as f32) / 3000.0);
        let heights: Vec<f32> = tops.chain(walls).chain([-1.0; 3000]).collect();
        let peak = HeightHistogram::of(&heights, &relief).peak();
        assert!((0.04..0.08).contains(&peak), "{peak}");
    }
}
