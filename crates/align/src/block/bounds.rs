//! The smallest rectangle around points.

/// Returns smallest and largest coordinates of points: `[x0, y0, x1, y1]`; zeros if there are none.
pub(super) fn bounds(points: impl IntoIterator<Item = [f64; 2]>) -> [f64; 4] {
    (points.into_iter().map(|[x, y]| [x, y, x, y]))
        .reduce(|[x0, y0, x1, y1], [x, y, ..]| [x0.min(x), y0.min(y), x1.max(x), y1.max(y)])
        .unwrap_or_default()
}
