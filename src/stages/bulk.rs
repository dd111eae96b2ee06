//! Where the bulk of a scan lies: a fleck far away must not shrink everything else.

/// About so many points are looked at.
const LOOKED_AT: usize = 20_000;
/// This share of the points at either end of an axis may be flecks.
const FLECKS: f64 = 0.002;
/// The rest, widened by this share of its length on each side, is the bulk.
const WIDENED: f64 = 0.25;

/// A box along the axes, `[low, high]`.
pub(super) type Bounds<const N: usize> = [[f64; N]; 2];

/// Bounds along the first `N` axes of the points that belong to the bulk; a scan without flecks keeps all of its
/// bounds.
pub(super) fn bulk<const N: usize, const D: usize>(points: &[[f64; D]]) -> Bounds<N> {
    let mut bounds = [[f64::INFINITY; N], [f64::NEG_INFINITY; N]];
    if points.is_empty() {
        return bounds;
    }
    let limits: [[f64; 2]; N] = std::array::from_fn(|axis| limits(points, axis));
    for p in points {
        for (axis, [low, high]) in limits.iter().enumerate() {
            if p[axis] >= *low && p[axis] <= *high {
                bounds[0][axis] = bounds[0][axis].min(p[axis]);
                bounds[1][axis] = bounds[1][axis].max(p[axis]);
            }
        }
    }
    bounds
}

/// Between which values along an axis a point belongs to the bulk.
fn limits<const D: usize>(points: &[[f64; D]], axis: usize) -> [f64; 2] {
    let stride = points.len().div_ceil(LOOKED_AT);
    let looked_at = points.len().div_ceil(stride);
    let flecks = ((looked_at - 1) as f64 * FLECKS) as usize;
    let values = || points.iter().step_by(stride).map(|p| p[axis]);
    let low = smallest(values(), flecks);
    let high = -smallest(values().map(|v| -v), flecks);
    let slack = WIDENED * (high - low);
    [low - slack, high + slack]
}

/// The value that `rank` of the values lie below; quick where that is few. There are more than `rank` values.
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

/// Whether a point lies in the box, borders included.
pub(super) fn holds<const N: usize>([low, high]: &Bounds<N>, point: &[f64; N]) -> bool {
    (0..N).all(|k| (low[k]..=high[k]).contains(&point[k]))
}

#[cfg(test)]
mod tests {
    use super::{bulk, holds};

    #[test]
    fn a_fleck_is_left_out_and_nothing_else() {
        let mut points: Vec<[f64; 2]> = (0..5000)
            .map(|i| [f64::from(i % 100), f64::from(i / 100)])
            .collect();
        assert_eq!(bulk::<2, 2>(&points), [[0.0, 0.0], [99.0, 49.0]]);
        points.push([9000.0, -700.0]);
        let bounds: [[f64; 2]; 2] = bulk(&points);
        assert_eq!(bounds, [[0.0, 0.0], [99.0, 49.0]]);
        assert!(holds(&bounds, &[99.0, 0.0]) && !holds(&bounds, &[9000.0, -700.0]));
    }

    #[test]
    fn two_points_keep_their_bounds() {
        assert_eq!(bulk::<1, 1>(&[[1.0], [4.0]]), [[1.0], [4.0]]);
        assert_eq!(bulk::<1, 2>(&[[1.0, 0.0], [4.0, 2.0]]), [[1.0], [4.0]]);
    }
}
