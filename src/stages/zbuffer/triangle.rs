//! One triangle on a grid: which pixels' centres it holds, and how high it is there.

/// In triangles no wider than this each pixel is asked whether it is inside; wider ones are crossed row by row.
const FEW_COLUMNS: usize = 6;

/// Plain comparisons, which are one instruction for many lanes; `f32::min` minds what is not a number.
pub(super) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

pub(super) fn higher(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Fills the pixels whose centre lies in the triangle, borders included, with the plane through its corners.
///
/// Edges are always looked at from their lower to their upper end, so two triangles that share one agree on it to the
/// last bit and no pixel between them stays empty.
pub(super) fn fill(
    corners: [[f32; 3]; 3],
    [width, height]: [usize; 2],
    meet: &mut impl FnMut(usize, f32),
) {
    let [a, b, c] = corners;
    let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if doubled_area == 0.0 || !doubled_area.is_finite() {
        return;
    }
    let (u, v) = (b[2] - a[2], c[2] - a[2]);
    let per_area = 1.0 / doubled_area;
    let dz_dx = (u * (c[1] - a[1]) - v * (b[1] - a[1])) * per_area;
    let dz_dy = (v * (b[0] - a[0]) - u * (c[0] - a[0])) * per_area;
    let low = |k: usize| lower(lower(a[k], b[k]), c[k]);
    let high = |k: usize| higher(higher(a[k], b[k]), c[k]);
    let (z_low, z_high) = (low(2), high(2));
    let height_at = |x: f32, y: f32| {
        let z = a[2] + (y - a[1]) * dz_dy + (x - a[0]) * dz_dx;
        lower(higher(z, z_low), z_high)
    };
    let edges = [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)];
    let columns = pixels(low(0), high(0), width);
    let left = doubled_area > 0.0;
    for row in pixels(low(1), high(1), height) {
        let y = row as f32;
        let mut set = |column: usize| {
            meet(row * width + column, height_at(column as f32, y));
        };
        if columns.len() <= FEW_COLUMNS {
            let inside = |column: &usize| edges.iter().all(|e| e.has([*column as f32, y], left));
            columns.clone().filter(inside).for_each(&mut set);
        } else {
            let crossings = edges.iter().filter_map(|edge| edge.crossing(y));
            let (first, last) = crossings.fold((f32::INFINITY, f32::NEG_INFINITY), |(p, q), x| {
                (lower(p, x), higher(q, x))
            });
            pixels(first, last, width).for_each(&mut set);
        }
    }
}

/// An edge from its lower to its upper end.
struct Edge {
    low: [f32; 2],
    along: [f32; 2],
    /// Whether the triangle's own order runs the other way.
    turned: bool,
}

impl Edge {
    #[inline]
    fn new(a: [f32; 3], b: [f32; 3]) -> Self {
        let turned = (a[1], a[0]) > (b[1], b[0]);
        let (low, high) = if turned { (b, a) } else { (a, b) };
        Self {
            low: [low[0], low[1]],
            along: [high[0] - low[0], high[1] - low[1]],
            turned,
        }
    }

    /// Whether a point is on the triangle's side of the edge, or on it; `left` when its corners run that way round.
    #[inline]
    fn has(&self, [x, y]: [f32; 2], left: bool) -> bool {
        let side = self.along[0] * (y - self.low[1]) - self.along[1] * (x - self.low[0]);
        if left == self.turned {
            side <= 0.0
        } else {
            side >= 0.0
        }
    }

    /// x at which the edge meets a row; level edges meet none.
    #[inline]
    fn crossing(&self, y: f32) -> Option<f32> {
        let up = y - self.low[1];
        let meets = up >= 0.0 && up <= self.along[1] && self.along[1] > 0.0;
        meets.then(|| self.low[0] + up / self.along[1] * self.along[0])
    }
}

/// Whole pixels from `low` to `high`, bounds included, cut to the grid.
///
/// Casts to narrow integers do the rounding: `ceil` and `floor` are calls.
#[inline]
pub(super) fn pixels(low: f32, high: f32, len: usize) -> std::ops::Range<usize> {
    let cut = |v: f32| v.max(-1.0).min(len as f32) as i32;
    let (first, last) = (cut(low), cut(high));
    let first = (first + i32::from((first as f32) < low)).max(0);
    let end = (last + i32::from(last as f32 <= high)).min(len as i32);
    first as usize..end.max(first) as usize
}
