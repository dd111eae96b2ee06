//! Fills small triangles in parallel, one per lane. Each step tests the same pixel offset in every lane.
//!
//! Most triangles of a scan contain one or two pixels. The results are bit-identical to those of
//! [`fill_triangle`](super::triangle_fill::fill_triangle). The order of the triangles differs, so heights of 0.0 and
//! -0.0 may be swapped at pixels that two triangles share.

use super::triangle_block::{LANES, LaneArray};
use mocban_core::simd::{ceil_f32, floor_f32, index_from_f32, max_f32, min_f32};

/// Triangles that span more columns or rows are filled one at a time.
const MAX_SPAN_PX: f32 = 4.0;

/// The lanes with small triangles, and the pixels around them.
pub(super) struct SmallTriangles {
    pub(super) lanes: [bool; LANES],
    /// First column and row of each lane.
    first: [LaneArray; 2],
    /// Largest number of columns and rows; zero if no triangle is small.
    max_span: [usize; 2],
}

impl SmallTriangles {
    /// Selects the small triangles among the `candidates`. `ranges` holds each lane's range of columns and of rows.
    #[inline(always)]
    pub(super) fn new(
        ranges: &[[LaneArray; 2]; 2],
        candidates: [bool; LANES],
        size: [usize; 2],
    ) -> Self {
        let [across, down] = ranges;
        let (columns, rows) = (pixel_span(across, size[0]), pixel_span(down, size[1]));
        let mut lanes = [false; LANES];
        let mut max_span = [0.0; 2];
        for k in 0..LANES {
            let (across, down) = (columns[1][k], rows[1][k]);
            lanes[k] = candidates[k] & (across <= MAX_SPAN_PX) & (down <= MAX_SPAN_PX);
            max_span[0] = max_f32(max_span[0], if lanes[k] { across } else { 0.0 });
            max_span[1] = max_f32(max_span[1], if lanes[k] { down } else { 0.0 });
        }
        Self {
            lanes,
            first: [columns[0], rows[0]],
            max_span: max_span.map(|max_span| index_from_f32(max_span) as usize),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.max_span == [0; 2]
    }

    /// Calls `emit` with pixel indices and heights, as [`fill_triangle`](super::triangle_fill::fill_triangle) does.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        [across, down, heights]: &[[LaneArray; 3]; 3],
        [width, height]: [usize; 2],
        emit: &mut impl FnMut(usize, f32),
    ) {
        let planes = TrianglePlanes::of(across, down, heights, self.lanes);
        let origin = &self.first;
        let mut place = [0; LANES];
        for k in 0..LANES {
            place[k] = index_from_f32(origin[1][k]) as usize * width
                + index_from_f32(origin[0][k]) as usize;
        }
        for row in 0..self.max_span[1] {
            for column in 0..self.max_span[0] {
                let (mut heights, mut hits) = ([0.0; LANES], [0_u32; LANES]);
                for k in 0..LANES {
                    let (x, y) = (origin[0][k] + column as f32, origin[1][k] + row as f32);
                    let orientation = planes.orientation[k];
                    let [a, b, c] = down;
                    let down = [
                        (a[k] - y) * orientation,
                        (b[k] - y) * orientation,
                        (c[k] - y) * orientation,
                    ];
                    let [a, b, c] = across;
                    let across = [a[k] - x, b[k] - x, c[k] - x];
                    let side =
                        |from: usize, to: usize| across[from] * down[to] - down[from] * across[to];
                    let least = min_f32(min_f32(side(0, 1), side(1, 2)), side(2, 0));
                    heights[k] = planes.height(k, x, y);
                    let is_within = (x < width as f32) & (y < height as f32);
                    let is_hit = (least >= 0.0) & is_within;
                    hits[k] = if is_hit { 1 << k } else { 0 };
                }
                let on = row * width + column;
                // Visits only the lanes that hit.
                let mut hits = hits.into_iter().fold(0, |all, lane| all | lane);
                while hits != 0 {
                    let k = hits.trailing_zeros() as usize % LANES;
                    emit(place[k] + on, heights[k]);
                    hits &= hits - 1;
                }
            }
        }
    }
}

/// Returns the first pixel of each lane along an axis of `side` pixels, and the number of pixels of each lane.
#[inline(always)]
fn pixel_span([low, high]: &[LaneArray; 2], side: usize) -> [LaneArray; 2] {
    let last = side as f32 - 1.0;
    let mut pixels = [[0.0; LANES]; 2];
    for k in 0..LANES {
        let first = ceil_f32(min_f32(max_f32(low[k], 0.0), last));
        pixels[0][k] = first;
        pixels[1][k] = floor_f32(min_f32(max_f32(high[k], 0.0), last)) - first + 1.0;
    }
    pixels
}

/// The planes through the corners of the triangles.
struct TrianglePlanes {
    /// First corners: x, y, z.
    corner: [LaneArray; 3],
    dz_dx: LaneArray,
    dz_dy: LaneArray,
    /// Lowest and highest z of the corners.
    range: [LaneArray; 2],
    /// Sign of the doubled area; NaN for lanes that are not filled.
    orientation: LaneArray,
}

impl TrianglePlanes {
    #[inline(always)]
    fn of(
        x: &[LaneArray; 3],
        y: &[LaneArray; 3],
        z: &[LaneArray; 3],
        wanted: [bool; LANES],
    ) -> Self {
        let mut planes = Self {
            corner: [x[0], y[0], z[0]],
            dz_dx: [0.0; LANES],
            dz_dy: [0.0; LANES],
            range: [[0.0; LANES]; 2],
            orientation: [0.0; LANES],
        };
        for k in 0..LANES {
            let doubled_area = (x[1][k] - x[0][k]) * (y[2][k] - y[0][k])
                - (x[2][k] - x[0][k]) * (y[1][k] - y[0][k]);
            let (u, v) = (z[1][k] - z[0][k], z[2][k] - z[0][k]);
            let per_area = 1.0 / doubled_area;
            planes.dz_dx[k] = (u * (y[2][k] - y[0][k]) - v * (y[1][k] - y[0][k])) * per_area;
            planes.dz_dy[k] = (v * (x[1][k] - x[0][k]) - u * (x[2][k] - x[0][k])) * per_area;
            planes.range[0][k] = min_f32(min_f32(z[0][k], z[1][k]), z[2][k]);
            planes.range[1][k] = max_f32(max_f32(z[0][k], z[1][k]), z[2][k]);
            let is_sound = (doubled_area != 0.0) & (doubled_area.abs() < f32::INFINITY);
            let orientation = if doubled_area < 0.0 { -1.0 } else { 1.0 };
            planes.orientation[k] = if is_sound & wanted[k] {
                orientation
            } else {
                f32::NAN
            };
        }
        planes
    }

    /// Returns the height of the plane of lane `k` at a pixel, clamped to the range of the corners' heights.
    #[inline(always)]
    fn height(&self, k: usize, x: f32, y: f32) -> f32 {
        let [a, b, c] = &self.corner;
        let z = c[k] + (y - b[k]) * self.dz_dy[k];
        let z = z + (x - a[k]) * self.dz_dx[k];
        min_f32(max_f32(z, self.range[0][k]), self.range[1][k])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::block_fill::fill_block;
    use super::super::draw_effort::DrawEffort;
    use super::super::triangle_block::{AffineForm, LANES, TriangleBlock};
    use super::super::triangle_fill::fill_triangle;
    use super::super::viewport::Viewport;
    use mocban_core::simd::max_f32;

    const SIZE: [usize; 2] = [9, 7];
    const IDENTITY: [AffineForm; 3] = [
        AffineForm([1.0, 0.0, 0.0, 0.0]),
        AffineForm([0.0, 1.0, 0.0, 0.0]),
        AffineForm([0.0, 0.0, 1.0, 0.0]),
    ];

    fn effort() -> DrawEffort {
        let view = Viewport::around([[0.0; 2], [1.0; 2]], 8, false);
        DrawEffort::new(&view, LANES)
    }

    fn filled(by: impl FnOnce(&mut dyn FnMut(usize, f32))) -> Vec<f32> {
        let mut heights = [f32::NEG_INFINITY; SIZE[0] * SIZE[1]];
        by(&mut |place, z| heights[place] = max_f32(z, heights[place]));
        heights.to_vec()
    }

    /// Generates triangles on and beyond the grid: some with corners on pixel centres, some without area, some large.
    fn triangles() -> impl Strategy<Value = Vec<[[f32; 3]; 3]>> {
        let exact = |v: f32| (v * 2.0).round() / 2.0;
        let middle = [-2.0..11.0_f32, -2.0..9.0_f32, -1.0..1.0_f32];
        let around = [-1.0..1.0_f32, -1.0..1.0_f32, -1.0..1.0_f32];
        let triangle = (
            middle,
            [around.clone(), around.clone(), around],
            0.1..6.0_f32,
            0..3,
        );
        let triangle = triangle.prop_map(move |(middle, around, reach, kind)| {
            around.map(|to| {
                let corner = [0, 1, 2].map(|k| middle[k] + reach * to[k]);
                if kind == 0 { corner.map(exact) } else { corner }
            })
        });
        prop::collection::vec(triangle, LANES)
    }

    proptest! {
        #[test]
        fn lanes_equal_single_triangles(triangles in triangles()) {
            let block: TriangleBlock = std::array::from_fn(|corner| {
                std::array::from_fn(|axis| std::array::from_fn(|k| triangles[k][corner][axis]))
            });
            let together = filled(|mut emit| fill_block(&block, &IDENTITY, SIZE, &mut effort(), &mut emit));
            let alone = filled(|mut emit| {
                for corners in &triangles {
                    fill_triangle(*corners, SIZE, &mut effort(), &mut emit);
                }
            });
            prop_assert_eq!(together, alone);
        }
    }
}
