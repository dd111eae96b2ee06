//! Rasterises a block of triangles. Triangles without a pixel centre are skipped. Small triangles are filled in
//! parallel lanes, large triangles one at a time.

use super::draw_effort::DrawEffort;
use super::small_triangles::SmallTriangles;
use super::triangle_block::{AffineForm, LANES, LaneArray, TriangleBlock};
use super::triangle_fill::fill_triangle;
use mocban_core::simd::{floor_f32, max_f32, min_f32};

/// Fills the triangles that contain a pixel centre. `u`, `v` and `z` compute the column, row and height of a corner.
/// Calls `emit` in the same way as [`fill_triangle`].
#[inline(always)]
pub(super) fn fill_block(
    block: &TriangleBlock,
    [u, v, z]: &[AffineForm; 3],
    size: [usize; 2],
    effort: &mut DrawEffort,
    emit: &mut impl FnMut(usize, f32),
) {
    // A local copy cannot alias memory that `emit` writes. Reads from it are therefore vectorised.
    let block = *block;
    let [a, b, c] = &block;
    let (across, down) = (
        [u.at_lanes(a), u.at_lanes(b), u.at_lanes(c)],
        [v.at_lanes(a), v.at_lanes(b), v.at_lanes(c)],
    );
    let ranges = [range_of(&across), range_of(&down)];
    let candidates = may_cover_centre([&ranges[0], &ranges[1]], size);
    if candidates == [false; LANES] {
        return;
    }
    let heights = [z.at_lanes(a), z.at_lanes(b), z.at_lanes(c)];
    let corners = [across, down, heights];
    let small = SmallTriangles::new(&ranges, candidates, size);
    if !small.is_empty() {
        small.fill(&corners, size, emit);
    }
    for k in (0..LANES).filter(|k| candidates[*k] && !small.lanes[*k]) {
        let corner = |c: usize| [across[c][k], down[c][k], heights[c][k]];
        fill_triangle([corner(0), corner(1), corner(2)], size, effort, emit);
    }
}

/// Returns the lowest and highest of three corners' values.
#[inline(always)]
fn range_of([a, b, c]: &[LaneArray; 3]) -> [LaneArray; 2] {
    let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        low[k] = min_f32(min_f32(a[k], b[k]), c[k]);
        high[k] = max_f32(max_f32(a[k], b[k]), c[k]);
    }
    [low, high]
}

/// Returns which lanes may contain a pixel centre. `across` and `down` are each lane's range of columns and of rows.
#[inline(always)]
pub(super) fn may_cover_centre(
    [across, down]: [&[LaneArray; 2]; 2],
    [width, height]: [usize; 2],
) -> [bool; LANES] {
    let (wide, high) = (
        covers_centre_along(across, width),
        covers_centre_along(down, height),
    );
    let mut candidates = [false; LANES];
    for k in 0..LANES {
        candidates[k] = wide[k] & high[k];
    }
    candidates
}

#[inline(always)]
fn covers_centre_along([low, high]: &[LaneArray; 2], side: usize) -> [bool; LANES] {
    let last = side as f32 - 1.0;
    let mut holds = [false; LANES];
    for k in 0..LANES {
        let below = floor_f32(min_f32(max_f32(high[k], -1.0), last));
        holds[k] = below >= max_f32(low[k], 0.0);
    }
    holds
}
