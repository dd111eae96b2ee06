//! Bringing values to another size along the axes: exact area means where the map shrinks, linear where it grows.

use super::Grid;
use crate::wide::widely;

/// How far along one axis an output pixel reaches in the source.
struct Reach {
    first: usize,
    weights: Vec<f32>,
}

/// Values under an upright map `to = scale * from + shift` (pixels, per axis), `width` x `height` pixels large.
///
/// Each output pixel is the mean of the source over its own square, or over a source pixel's where that is larger.
/// Beyond the source values are zero.
pub fn resample(
    values: &Grid<f32>,
    scale: f64,
    shift: [f64; 2],
    [width, height]: [usize; 2],
) -> Grid<f32> {
    let rows = reaches(values.height(), height, scale, shift[1]);
    let columns = reaches(values.width(), width, scale, shift[0]);
    // Whole rows are summed side by side, so columns are turned into rows for their turn.
    mixed(&mixed(values, &rows).transposed(), &columns).transposed()
}

/// Rows mixed from those that each reaches.
fn mixed(values: &Grid<f32>, reaches: &[Reach]) -> Grid<f32> {
    let width = values.width();
    let mut out = Grid::new(width, reaches.len(), 0.0_f32);
    let rows = out.data_mut().chunks_exact_mut(width.max(1)).zip(reaches);
    widely(
        #[inline(always)]
        || {
            for (row, reach) in rows {
                for (k, weight) in reach.weights.iter().enumerate() {
                    for (sum, value) in row.iter_mut().zip(values.row(reach.first + k)) {
                        *sum += weight * value;
                    }
                }
            }
        },
    );
    out
}

/// The reach of each of `to` output pixels over `from` source pixels.
fn reaches(from: usize, to: usize, scale: f64, shift: f64) -> Vec<Reach> {
    let length = (1.0 / scale).max(1.0);
    (0..to)
        .map(|i| {
            let centre = (i as f64 - shift) / scale;
            let (low, high) = (centre - length / 2.0, centre + length / 2.0);
            let first = (low + 0.5).floor().clamp(0.0, from as f64) as usize;
            let end = ((high + 0.5).ceil().clamp(0.0, from as f64) as usize).max(first);
            let overlap = |j: usize| {
                let j = j as f64;
                ((high.min(j + 0.5) - low.max(j - 0.5)).max(0.0) / length) as f32
            };
            Reach {
                first,
                weights: (first..end).map(overlap).collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::resample;
    use crate::raster::Grid;

    #[test]
    fn shrinking_keeps_the_mean_and_growing_is_linear() {
        let ramp = Grid::from_fn(12, 8, |x, y| (x + 10 * y) as f32);
        let half = resample(&ramp, 0.5, [-0.25, -0.25], [6, 4]);
        assert!((half.at(0, 0) - (0.0 + 1.0 + 10.0 + 11.0) / 4.0).abs() < 1e-5);
        assert!((half.at(5, 3) - (70.0 + 71.0 + 80.0 + 81.0) / 4.0).abs() < 1e-4);
        let double = resample(&ramp, 2.0, [0.5, 0.5], [24, 16]);
        assert!((double.at(6, 4) - (2.75 + 17.5)).abs() < 1e-5);
    }

    #[test]
    fn beyond_the_source_there_is_nothing() {
        let ones = Grid::new(4, 4, 1.0_f32);
        let moved = resample(&ones, 1.0, [6.0, 0.5], [8, 4]);
        assert_eq!(moved.at(5, 1), 0.0);
        assert_eq!(moved.at(6, 1), 1.0);
        assert_eq!(moved.at(6, 0), 0.5);
    }
}
