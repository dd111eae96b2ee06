//! The heap of heights that the tops make, and where it ends: the foot between worn tops and walls.
//!
//! Walls slope, so each depth holds about as much of them; tops crowd at one depth, worn ones a little below. A cut
//! loses least of the tops and takes in least of the walls where both are about as frequent.

use super::relief::Relief;

/// Bins a share of the relief, and the depths they cover.
const BIN: f64 = 0.005;
const FROM: f64 = -0.3;
const TO: f64 = 1.2;
/// The tops' crowd is looked for this near to the first guess.
const NEAR: f64 = 0.25;
/// Depths at which walls are seen by themselves.
const WALLS: [f64; 2] = [0.10, 0.50];
/// Bins averaged, for the tops and for the walls.
const FINE: usize = 3;
const COARSE: usize = 16;
/// The tops end where heights are this many times as frequent as on the walls: walls and tops still half each, and
/// a little for the noise that widens the heap. Measured on two independent kinds of made reliefs; flat around 2.5.
/// Where walls are frequent all over, half-way between both will do.
const EDGE: f64 = 2.5;
/// Where the tops of most reliefs end, and the range in which a found end is believed. One scan's heights tell it with
/// much noise, so the answer lies half-way between both: nearer to the truth on three kinds of made reliefs.
const USUAL: f64 = 0.075;
const RANGE: [f64; 2] = [0.02, 0.25];

/// How frequent each depth under the tops is.
#[derive(Debug, Clone)]
pub(super) struct HeightHistogram {
    counts: Vec<f64>,
}

impl HeightHistogram {
    /// Counts heights by their depth under the tops.
    pub(super) fn of(heights: &[f32], relief: &Relief) -> Self {
        let mut counts = vec![0.0; ((TO - FROM) / BIN).round() as usize];
        for height in heights {
            let share = (relief.top - f64::from(*height)) / relief.depth();
            let bin = (share - FROM) / BIN;
            if bin >= 0.0 && (bin as usize) < counts.len() {
                counts[bin as usize] += 1.0;
            }
        }
        Self { counts }
    }

    /// Depth at which most heights crowd near the tops.
    pub(super) fn peak(&self) -> f64 {
        middle(peak_bin(&smoothed(&self.counts, FINE)))
    }

    /// Depth at which the tops end, going down from depth zero.
    pub(super) fn edge(&self) -> f64 {
        let fine = smoothed(&self.counts, FINE);
        let coarse = smoothed(&self.counts, COARSE);
        let mut walls = coarse[bin_of(WALLS[0])..bin_of(WALLS[1])].to_vec();
        let half = walls.len() / 2;
        let wall = *walls.select_nth_unstable_by(half, f64::total_cmp).1;
        let start = peak_bin(&fine);
        let end = (EDGE * wall).min(f64::midpoint(wall, fine[start].max(wall)));
        let found = (start..bin_of(WALLS[1]))
            .find(|bin| fine[*bin] <= end)
            .map_or(USUAL, middle);
        (found.clamp(RANGE[0], RANGE[1]) * USUAL).sqrt()
    }
}

/// Bin near depth zero that holds most.
fn peak_bin(fine: &[f64]) -> usize {
    let near = bin_of(-NEAR)..bin_of(NEAR);
    near.max_by(|a, b| fine[*a].total_cmp(&fine[*b]))
        .unwrap_or(bin_of(0.0))
}

fn bin_of(share: f64) -> usize {
    ((share - FROM) / BIN).round() as usize
}

fn middle(bin: usize) -> f64 {
    FROM + (bin as f64 + 0.5) * BIN
}

/// Running means over `width` bins.
fn smoothed(counts: &[f64], width: usize) -> Vec<f64> {
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
    use super::{HeightHistogram, Relief};

    #[test]
    fn tops_end_where_walls_begin() {
        let relief = Relief {
            top: 0.0,
            ground: -1.0,
            edge: 0.0,
        };
        // A crowd of tops within 0.04 of the relief, walls evenly below it, ground at the end.
        let tops = (0..4000).map(|i| -0.04 + 0.08 * (i % 100) as f32 / 100.0);
        let walls = (0..3000).map(|i| -(i as f32) / 3000.0);
        let heights: Vec<f32> = tops.chain(walls).chain([-1.0; 3000]).collect();
        let heap = HeightHistogram::of(&heights, &relief);
        assert!((0.03..0.06).contains(&heap.edge()), "{}", heap.edge());
        assert!(heap.peak().abs() <= 0.045);
    }
}
