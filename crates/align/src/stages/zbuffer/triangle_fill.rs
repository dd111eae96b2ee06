//! Scan conversion of one triangle: finds the pixel centres in the triangle, and the triangle's height at each centre.

use super::draw_effort::DrawEffort;
use mocban_core::domain::cancel::poll;
use mocban_core::simd::{max_f32, min_f32};

/// If a triangle spans more columns than this, its rows are clipped before their pixels are tested.
const MAX_UNCLIPPED_COLUMNS: usize = 12;

/// Triangles that span more pixels poll for a cancellation at each row.
const PIXELS_PER_POLL: usize = 1 << 20;

/// Calls `emit` for each tested pixel, with the pixel's index and the height of the triangle at the pixel's centre. The
/// height is NaN if the centre is outside the triangle. Edges belong to the triangle.
///
/// Edge functions are computed relative to the pixel centre. Swapping the ends of an edge then negates the value
/// exactly, so two triangles that share an edge leave no gap (watertight). Pixels are not rejected early: most
/// triangles of a scan contain one or two pixels, and a mispredicted branch costs more than the arithmetic.
#[inline(always)]
pub(super) fn fill_triangle(
    corners: [[f32; 3]; 3],
    [width, height]: [usize; 2],
    effort: &mut DrawEffort,
    emit: &mut impl FnMut(usize, f32),
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
    let low = |k: usize| min_f32(min_f32(a[k], b[k]), c[k]);
    let high = |k: usize| max_f32(max_f32(a[k], b[k]), c[k]);
    let (z_low, z_high) = (low(2), high(2));
    let columns = pixel_range(low(0), high(0), width);
    // Both windings are accepted.
    let orientation = doubled_area.signum();
    let rows = pixel_range(low(1), high(1), height);
    let is_huge = rows.len() * columns.len() > PIXELS_PER_POLL;
    for row in rows {
        if is_huge {
            poll();
        }
        let y = row as f32;
        let down = [a, b, c].map(|corner| (corner[1] - y) * orientation);
        let z = a[2] + (y - a[1]) * dz_dy;
        let clipped = clip_columns(&columns, &corners, y);
        effort.spend(clipped.len());
        for column in clipped {
            let x = column as u32 as f32;
            let across = [a[0] - x, b[0] - x, c[0] - x];
            let side = |from: usize, to: usize| across[from] * down[to] - down[from] * across[to];
            let least = min_f32(min_f32(side(0, 1), side(1, 2)), side(2, 0));
            let z = min_f32(max_f32(z + (x - a[0]) * dz_dx, z_low), z_high);
            emit(
                row * width + column,
                if least >= 0.0 { z } else { f32::NAN },
            );
        }
    }
}

/// Returns the columns to test in a row. In a wide triangle, these lie between the edges, or one column beyond.
#[inline(always)]
fn clip_columns(
    columns: &std::ops::Range<usize>,
    corners: &[[f32; 3]; 3],
    y: f32,
) -> std::ops::Range<usize> {
    if columns.len() <= MAX_UNCLIPPED_COLUMNS {
        return columns.clone();
    }
    let [a, b, c] = corners;
    let crossings = [(a, b), (b, c), (c, a)].map(|(p, q)| crossing(p, q, y));
    let crossings = crossings.into_iter().flatten();
    let (first, last) = crossings.fold((f32::INFINITY, f32::NEG_INFINITY), |(p, q), x| {
        (min_f32(p, x), max_f32(q, x))
    });
    let clipped = pixel_range(first - 1.0, last + 1.0, columns.end);
    clipped.start.max(columns.start)..clipped.end
}

/// Returns the column where an edge crosses a row, or `None` if the edge is level or does not reach the row.
#[inline(always)]
fn crossing(p: &[f32; 3], q: &[f32; 3], y: f32) -> Option<f32> {
    let share = (y - p[1]) / (q[1] - p[1]);
    (0.0..=1.0)
        .contains(&share)
        .then(|| p[0] + share * (q[0] - p[0]))
}

/// Returns the whole pixels from `low` to `high`, inclusive, clamped to the grid.
///
/// Rounds by casts to narrow integers, because `ceil` and `floor` would be function calls.
#[inline(always)]
pub(super) fn pixel_range(low: f32, high: f32, len: usize) -> std::ops::Range<usize> {
    let clamp = |v: f32| v.max(-1.0).min(len as f32) as i32;
    let (first, last) = (clamp(low), clamp(high));
    let first = (first + i32::from((first as f32) < low)).max(0);
    let end = (last + i32::from(last as f32 <= high)).min(len as i32);
    first as usize..end.max(first) as usize
}
