//! Bounds of the bulk of a scan: a speck far away must not shrink everything else.

/// Number of points that are sampled, about.
const LOOKED_AT: usize = 4_000;
/// Share of the points at either end of an axis that may be specks.
const FLECKS: f64 = 0.002;
/// The rest, widened by this share of its length on each side, is the bulk.
const WIDENED: f64 = 0.25;

/// A box along the axes, `[low, high]`.
pub(super) type Bounds<const N: usize> = [[f64; N]; 2];

/// Returns the first and the last value of the bulk; a scan without specks keeps its exact bounds.
pub(super) fn bulk_along(values: &[f32]) -> [f64; 2] {
    let mut bulk = Bulk::of(values.len(), |k| values[k]);
    let (runs, rest) = values.as_chunks::<LANES>();
    for run in runs {
        bulk.take(*run);
    }
    // NaN is never taken.
    bulk.take(std::array::from_fn(|k| {
        rest.get(k).copied().unwrap_or(f32::NAN)
    }));
    bulk.taken().map(f64::from)
}

/// Values of one block.
type ValueBlock = [f32; LANES];

/// Running minimum and maximum of the values of the bulk.
pub(super) struct Bulk {
    least: f32,
    most: f32,
    low: ValueBlock,
    high: ValueBlock,
}

impl Bulk {
    /// Samples `count` values to decide what belongs to the bulk; none is taken yet.
    pub(super) fn of(count: usize, value: impl Fn(usize) -> f32) -> Self {
        let [least, most] = limits(count, |k| f64::from(value(k)));
        Self {
            least: least as f32,
            most: most as f32,
            low: [f32::INFINITY; LANES],
            high: [f32::NEG_INFINITY; LANES],
        }
    }

    /// Takes a block of values.
    #[inline]
    pub(super) fn take(&mut self, values: ValueBlock) {
        for (k, v) in values.into_iter().enumerate() {
            // Plain comparisons are vectorized.
            let (low, high) = (&mut self.low[k], &mut self.high[k]);
            *low = if v >= self.least && v < *low { v } else { *low };
            *high = if v <= self.most && v > *high {
                v
            } else {
                *high
            };
        }
    }

    /// Returns whether a value belongs to the bulk.
    pub(super) fn holds(&self, value: f32) -> bool {
        (self.least..=self.most).contains(&value)
    }

    /// Returns the first and the last of the taken values that belong to the bulk.
    pub(super) fn taken(&self) -> [f32; 2] {
        [
            self.low.into_iter().fold(f32::INFINITY, f32::min),
            self.high.into_iter().fold(f32::NEG_INFINITY, f32::max),
        ]
    }
}

/// Number of values in a block.
const LANES: usize = 8;

/// Returns a box somewhat wider than the bulk: points outside it along an axis are specks.
pub(super) fn room<T: Copy + Into<f64>>(points: &[[T; 3]]) -> Bounds<3> {
    let along = [0, 1, 2].map(|axis| limits(points.len(), |k| points[k][axis].into()));
    [0, 1].map(|end| along.map(|limits| limits[end]))
}

/// Returns the limits of the bulk of `count` values.
fn limits(count: usize, value: impl Fn(usize) -> f64) -> [f64; 2] {
    if count == 0 {
        return [f64::INFINITY, f64::NEG_INFINITY];
    }
    let stride = count.div_ceil(LOOKED_AT);
    let looked_at = count.div_ceil(stride);
    let flecks = ((looked_at - 1) as f64 * FLECKS) as usize;
    let values = (0..looked_at).map(|k| value(k * stride));
    let low = smallest(values.clone(), flecks);
    let high = -smallest(values.map(|v| -v), flecks);
    let slack = WIDENED * (high - low);
    [low - slack, high + slack]
}

/// Returns the value that `rank` of the values lie below; fast for a small `rank`. There are more than `rank` values.
fn smallest(values: impl Iterator<Item = f64>, rank: usize) -> f64 {
    let mut kept = Vec::with_capacity(4 * (rank + 1));
    let mut limit = f64::INFINITY;
    for value in values {
        if value < limit || kept.len() <= rank {
            kept.push(value);
        }
        if kept.len() == kept.capacity() {
            limit = *kept.select_nth_unstable_by(rank, f64::total_cmp).1;
            kept.truncate(rank + 1);
        }
    }
    *kept.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Returns whether a point lies in the box, borders included.
pub(super) fn holds<const N: usize>([low, high]: &Bounds<N>, point: &[f64; N]) -> bool {
    (0..N).all(|k| (low[k]..=high[k]).contains(&point[k]))
}

#[cfg(test)]
mod tests {
    use super::{bulk_along, holds, room};

    #[test]
    fn a_fleck_is_left_out_and_nothing_else() {
        let mut values: Vec<f32> = (0..5003).map(|i| (i % 100) as f32).collect();
        assert_eq!(bulk_along(&values), [0.0, 99.0]);
        values.push(9000.0);
        values.insert(0, -700.0);
        assert_eq!(bulk_along(&values), [0.0, 99.0]);
    }

    #[test]
    fn two_values_keep_their_bounds() {
        assert_eq!(bulk_along(&[1.0, 4.0]), [1.0, 4.0]);
    }

    #[test]
    fn a_fleck_is_outside_of_the_room() {
        let mut points: Vec<[f64; 3]> = (0..5000)
            .map(|i| [f64::from(i % 100), f64::from(i / 100), 1.0])
            .collect();
        points.push([9000.0, -700.0, 1.0]);
        let room = room(&points);
        assert!(points[..5000].iter().all(|p| holds(&room, p)));
        assert!(!holds(&room, &points[5000]));
    }
}
