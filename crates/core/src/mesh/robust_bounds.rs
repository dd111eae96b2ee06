//! Bounds of a scan without distant specks. With specks, the rest of the scan would be tiny in every rendering.

/// Approximate number of points that are sampled to find the bulk.
const SAMPLES: usize = 4_000;
/// Share of the samples at either end of an axis that may be specks.
const SPECK_SHARE: f64 = 0.002;
/// The range without specks is widened by this share of its length at either end. The result is called the bulk.
const WIDENED: f64 = 0.25;

/// A box along the axes, `[low, high]`.
pub type Bounds<const N: usize> = [[f64; N]; 2];

/// Returns the lowest and the highest value of the bulk. If there are no specks, these are the exact bounds.
pub fn bulk_along(values: &[f32]) -> [f64; 2] {
    let mut bulk = BulkRange::new(&samples(values.len(), |k| values[k]));
    bulk.add_all(values);
    bulk.range().map(f64::from)
}

/// Number of values that are added together.
const LANES: usize = 8;

/// Running minimum and maximum of the values of the bulk.
pub struct BulkRange {
    /// Limits of the bulk.
    least: f32,
    most: f32,
    low: [f32; LANES],
    high: [f32; LANES],
}

impl BulkRange {
    /// Finds the limits of the bulk from [`samples`] of its values; adds none.
    pub fn new(samples: &[f32]) -> Self {
        let [least, most] = limits(samples.iter().map(|v| f64::from(*v)));
        Self {
            least: least as f32,
            most: most as f32,
            low: [f32::INFINITY; LANES],
            high: [f32::NEG_INFINITY; LANES],
        }
    }

    /// Adds values.
    #[inline]
    pub fn add(&mut self, values: [f32; LANES]) {
        for (k, v) in values.into_iter().enumerate() {
            // Plain comparisons are vectorized.
            let (low, high) = (self.low[k], self.high[k]);
            self.low[k] = if v >= self.least && v < low { v } else { low };
            self.high[k] = if v <= self.most && v > high { v } else { high };
        }
    }

    /// Adds any number of values.
    pub fn add_all(&mut self, values: &[f32]) {
        for lanes in values.chunks(LANES) {
            // NaN is ignored.
            self.add(std::array::from_fn(|k| {
                lanes.get(k).copied().unwrap_or(f32::NAN)
            }));
        }
    }

    /// Returns the lowest and the highest of the values added so far that belong to the bulk.
    pub fn range(&self) -> [f32; 2] {
        [
            self.low.into_iter().fold(f32::INFINITY, f32::min),
            self.high.into_iter().fold(f32::NEG_INFINITY, f32::max),
        ]
    }
}

/// Returns the bulk along each axis as a box. Points outside the box are specks.
pub fn bulk_box<T: Copy + Into<f64>>(points: &[[T; 3]]) -> Bounds<3> {
    let sampled = samples(points.len(), |k| points[k]);
    let along = [0, 1, 2].map(|axis| limits(sampled.iter().map(|point| point[axis].into())));
    [0, 1].map(|end| along.map(|limits| limits[end]))
}

/// Returns every n-th of `count` values, with n so that at most 4,000 are left.
pub fn samples<T>(count: usize, value: impl Fn(usize) -> T) -> Vec<T> {
    let stride = count.div_ceil(SAMPLES).max(1);
    (0..count).step_by(stride).map(value).collect()
}

/// Returns the limits of the bulk of sampled values.
fn limits(values: impl ExactSizeIterator<Item = f64> + Clone) -> [f64; 2] {
    if values.len() == 0 {
        return [f64::INFINITY, f64::NEG_INFINITY];
    }
    let specks = ((values.len() - 1) as f64 * SPECK_SHARE) as usize;
    let low = smallest(values.clone(), specks);
    let high = -smallest(values.map(|v| -v), specks);
    let slack = WIDENED * (high - low);
    [low - slack, high + slack]
}

/// Returns the value at index `rank` after sorting. Fast for a small `rank`. There must be more than `rank` values.
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
pub fn is_in_box<const N: usize>([low, high]: &Bounds<N>, point: &[f64; N]) -> bool {
    (0..N).all(|k| (low[k]..=high[k]).contains(&point[k]))
}

#[cfg(test)]
mod tests {
    use super::{bulk_along, bulk_box, is_in_box};

    #[test]
    fn only_specks_are_excluded() {
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
    fn specks_are_outside_the_box() {
        let mut points: Vec<[f64; 3]> = (0..5000)
            .map(|i| [f64::from(i % 100), f64::from(i / 100), 1.0])
            .collect();
        points.push([9000.0, -700.0, 1.0]);
        let bulk = bulk_box(&points);
        assert!(points[..5000].iter().all(|p| is_in_box(&bulk, p)));
        assert!(!is_in_box(&bulk, &points[5000]));
    }
}
