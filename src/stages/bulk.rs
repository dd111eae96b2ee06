//! Where the bulk of a scan lies: a fleck far away must not shrink everything else.

/// About so many points are looked at.
const LOOKED_AT: usize = 20_000;
/// This share of the points at either end of an axis may be flecks.
const FLECKS: f64 = 0.002;
/// The rest, widened by this share of its length on each side, is the bulk.
const WIDENED: f64 = 0.25;

/// A box along the axes, `[low, high]`.
pub(super) type Bounds<const N: usize> = [[f64; N]; 2];

/// Bounds of the points that belong to the bulk; a scan without flecks keeps all of its bounds.
pub(super) fn bulk<const N: usize>(points: &[[f64; N]]) -> Bounds<N> {
    let mut bounds = [[f64::INFINITY; N], [f64::NEG_INFINITY; N]];
    if points.is_empty() {
        return bounds;
    }
    let stride = points.len().div_ceil(LOOKED_AT);
    for axis in 0..N {
        let mut values: Vec<f64> = points.iter().step_by(stride).map(|p| p[axis]).collect();
        let end = ((values.len() - 1) as f64 * FLECKS) as usize;
        let low = *values.select_nth_unstable_by(end, f64::total_cmp).1;
        let last = values.len() - 1 - end;
        let high = *values.select_nth_unstable_by(last, f64::total_cmp).1;
        let slack = WIDENED * (high - low);
        for p in points {
            if p[axis] >= low - slack && p[axis] <= high + slack {
                bounds[0][axis] = bounds[0][axis].min(p[axis]);
                bounds[1][axis] = bounds[1][axis].max(p[axis]);
            }
        }
    }
    bounds
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
        assert_eq!(bulk(&points), [[0.0, 0.0], [99.0, 49.0]]);
        points.push([9000.0, -700.0]);
        let bounds = bulk(&points);
        assert_eq!(bounds, [[0.0, 0.0], [99.0, 49.0]]);
        assert!(holds(&bounds, &[99.0, 0.0]) && !holds(&bounds, &[9000.0, -700.0]));
    }

    #[test]
    fn two_points_keep_their_bounds() {
        assert_eq!(bulk(&[[1.0], [4.0]]), [[1.0], [4.0]]);
    }
}
