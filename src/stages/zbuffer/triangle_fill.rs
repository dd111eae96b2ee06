//! One triangle on a grid: which pixels' centres it holds, and how high it is there.

use crate::simd::{higher, lower};

/// In triangles wider than this each row is cut to where the edges cross it before its pixels are asked.
const WIDE_COLUMNS: usize = 12;

/// Hands `meet` the place of each pixel around the triangle and the height there of the plane through its corners, not
/// a number where the triangle does not hold the pixel's centre; its borders are its own.
///
/// Which side of an edge a centre lies on is told by the edge's ends as seen from the centre. Swapping them gives the
/// same number with the other sign, so two triangles that share an edge agree on it to the last bit and no pixel
/// between them stays empty. Nothing here asks before it computes: most scans' triangles hold a pixel or two, and a
/// wrong guess of the processor takes longer than the sums.
#[inline(always)]
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
    let columns = pixels(low(0), high(0), width);
    // The corners may run either way round.
    let way = doubled_area.signum();
    for row in pixels(low(1), high(1), height) {
        let y = row as f32;
        let down = [a, b, c].map(|corner| (corner[1] - y) * way);
        let z = a[2] + (y - a[1]) * dz_dy;
        for column in cut(&columns, &corners, y) {
            let x = column as u32 as f32;
            let across = [a[0] - x, b[0] - x, c[0] - x];
            let side = |from: usize, to: usize| across[from] * down[to] - down[from] * across[to];
            let least = lower(lower(side(0, 1), side(1, 2)), side(2, 0));
            let z = lower(higher(z + (x - a[0]) * dz_dx, z_low), z_high);
            meet(
                row * width + column,
                if least >= 0.0 { z } else { f32::NAN },
            );
        }
    }
}

/// A row's columns; where they are many those between the edges, and one more on each side.
#[inline(always)]
fn cut(
    columns: &std::ops::Range<usize>,
    corners: &[[f32; 3]; 3],
    y: f32,
) -> std::ops::Range<usize> {
    if columns.len() <= WIDE_COLUMNS {
        return columns.clone();
    }
    let [a, b, c] = corners;
    let crossings = [(a, b), (b, c), (c, a)].map(|(p, q)| crossing(p, q, y));
    let crossings = crossings.into_iter().flatten();
    let (first, last) = crossings.fold((f32::INFINITY, f32::NEG_INFINITY), |(p, q), x| {
        (lower(p, x), higher(q, x))
    });
    let cut = pixels(first - 1.0, last + 1.0, columns.end);
    cut.start.max(columns.start)..cut.end
}

/// Where an edge meets a row; level edges meet none.
#[inline(always)]
fn crossing(p: &[f32; 3], q: &[f32; 3], y: f32) -> Option<f32> {
    let share = (y - p[1]) / (q[1] - p[1]);
    (0.0..=1.0)
        .contains(&share)
        .then(|| p[0] + share * (q[0] - p[0]))
}

/// Whole pixels from `low` to `high`, bounds included, cut to the grid.
///
/// Casts to narrow integers do the rounding: `ceil` and `floor` are calls.
#[inline(always)]
pub(super) fn pixels(low: f32, high: f32, len: usize) -> std::ops::Range<usize> {
    let cut = |v: f32| v.max(-1.0).min(len as f32) as i32;
    let (first, last) = (cut(low), cut(high));
    let first = (first + i32::from((first as f32) < low)).max(0);
    let end = (last + i32::from(last as f32 <= high)).min(len as i32);
    first as usize..end.max(first) as usize
}
