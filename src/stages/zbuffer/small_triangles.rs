//! Small triangles filled side by side: the same pixel, counted from each one's first, is asked of all together.
//!
//! Most triangles of a scan hold a pixel or two. Each lane computes what [`fill`](super::triangle_fill::fill) does, to the bit
//! (but for the sign of a zero that two triangles share).

use super::triangle_block::{LANES, Lanes};
use crate::simd::{higher, index, lower, whole_above, whole_below};

/// Triangles that reach over more columns or rows of pixels are filled one by one.
const MOST_PX: f32 = 4.0;

/// Which of a few triangles are small, and the pixels around them.
pub(super) struct Small {
    pub(super) lanes: [bool; LANES],
    /// First column and row of each.
    first: [Lanes; 2],
    /// Most columns and rows of any; none where no triangle is small.
    most: [usize; 2],
}

impl Small {
    /// Of triangles that reach from the first to the last `ends` along each axis of the grid, those that are `held`.
    #[inline(always)]
    pub(super) fn of(ends: &[[Lanes; 2]; 2], held: [bool; LANES], size: [usize; 2]) -> Self {
        let [across, down] = ends;
        let (columns, rows) = (pixels_of(across, size[0]), pixels_of(down, size[1]));
        let mut lanes = [false; LANES];
        let mut most = [0.0; 2];
        for k in 0..LANES {
            let (across, down) = (columns[1][k], rows[1][k]);
            lanes[k] = held[k] & (across <= MOST_PX) & (down <= MOST_PX);
            most[0] = higher(most[0], if lanes[k] { across } else { 0.0 });
            most[1] = higher(most[1], if lanes[k] { down } else { 0.0 });
        }
        Self {
            lanes,
            first: [columns[0], rows[0]],
            most: most.map(|most| index(most) as usize),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.most == [0; 2]
    }

    /// Hands `meet` places and heights as [`fill`](super::triangle_fill::fill) does.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        [across, down, heights]: &[[Lanes; 3]; 3],
        [width, height]: [usize; 2],
        meet: &mut impl FnMut(usize, f32),
    ) {
        let slopes = Slopes::of(across, down, heights, self.lanes);
        let origin = &self.first;
        let mut place = [0; LANES];
        for k in 0..LANES {
            place[k] = index(origin[1][k]) as usize * width + index(origin[0][k]) as usize;
        }
        let last = width * height - 1;
        for row in 0..self.most[1] {
            for column in 0..self.most[0] {
                let mut met = [f32::NAN; LANES];
                for k in 0..LANES {
                    let (x, y) = (origin[0][k] + column as f32, origin[1][k] + row as f32);
                    let way = slopes.way[k];
                    let [a, b, c] = down;
                    let down = [(a[k] - y) * way, (b[k] - y) * way, (c[k] - y) * way];
                    let [a, b, c] = across;
                    let across = [a[k] - x, b[k] - x, c[k] - x];
                    let side =
                        |from: usize, to: usize| across[from] * down[to] - down[from] * across[to];
                    let least = lower(lower(side(0, 1), side(1, 2)), side(2, 0));
                    let z = slopes.height(k, x, y);
                    let is_within = (x < width as f32) & (y < height as f32);
                    met[k] = if (least >= 0.0) & is_within {
                        z
                    } else {
                        f32::NAN
                    };
                }
                let on = row * width + column;
                for k in 0..LANES {
                    meet((place[k] + on).min(last), met[k]);
                }
            }
        }
    }
}

/// The first pixel of each lane along an axis of `side` pixels, and how many there are from its low to its high end.
#[inline(always)]
fn pixels_of([low, high]: &[Lanes; 2], side: usize) -> [Lanes; 2] {
    let last = side as f32 - 1.0;
    let mut pixels = [[0.0; LANES]; 2];
    for k in 0..LANES {
        let first = whole_above(lower(higher(low[k], 0.0), last));
        pixels[0][k] = first;
        pixels[1][k] = whole_below(lower(higher(high[k], 0.0), last)) - first + 1.0;
    }
    pixels
}

/// The planes through a few triangles' corners.
struct Slopes {
    /// First corners: x, y, z.
    corner: [Lanes; 3],
    dz_dx: Lanes,
    dz_dy: Lanes,
    /// Lowest and highest corners.
    range: [Lanes; 2],
    /// Which way round the corners run; not a number for what is not to be filled.
    way: Lanes,
}

impl Slopes {
    #[inline(always)]
    fn of(x: &[Lanes; 3], y: &[Lanes; 3], z: &[Lanes; 3], wanted: [bool; LANES]) -> Self {
        let mut slopes = Self {
            corner: [x[0], y[0], z[0]],
            dz_dx: [0.0; LANES],
            dz_dy: [0.0; LANES],
            range: [[0.0; LANES]; 2],
            way: [0.0; LANES],
        };
        for k in 0..LANES {
            let doubled_area = (x[1][k] - x[0][k]) * (y[2][k] - y[0][k])
                - (x[2][k] - x[0][k]) * (y[1][k] - y[0][k]);
            let (u, v) = (z[1][k] - z[0][k], z[2][k] - z[0][k]);
            let per_area = 1.0 / doubled_area;
            slopes.dz_dx[k] = (u * (y[2][k] - y[0][k]) - v * (y[1][k] - y[0][k])) * per_area;
            slopes.dz_dy[k] = (v * (x[1][k] - x[0][k]) - u * (x[2][k] - x[0][k])) * per_area;
            slopes.range[0][k] = lower(lower(z[0][k], z[1][k]), z[2][k]);
            slopes.range[1][k] = higher(higher(z[0][k], z[1][k]), z[2][k]);
            let is_sound = (doubled_area != 0.0) & (doubled_area.abs() < f32::INFINITY);
            let way = if doubled_area < 0.0 { -1.0 } else { 1.0 };
            slopes.way[k] = if is_sound & wanted[k] { way } else { f32::NAN };
        }
        slopes
    }

    /// Height of a triangle's plane at a pixel, within its corners'.
    #[inline(always)]
    fn height(&self, k: usize, x: f32, y: f32) -> f32 {
        let [a, b, c] = &self.corner;
        let z = c[k] + (y - b[k]) * self.dz_dy[k];
        let z = z + (x - a[k]) * self.dz_dx[k];
        lower(higher(z, self.range[0][k]), self.range[1][k])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::triangle_block::{Block, LANES, Row, fill_block};
    use super::super::triangle_fill::fill;
    use crate::simd::higher;

    const SIZE: [usize; 2] = [9, 7];
    const AS_THEY_ARE: [Row; 3] = [
        Row([1.0, 0.0, 0.0, 0.0]),
        Row([0.0, 1.0, 0.0, 0.0]),
        Row([0.0, 0.0, 1.0, 0.0]),
    ];

    fn filled(by: impl FnOnce(&mut dyn FnMut(usize, f32))) -> Vec<f32> {
        let mut heights = [f32::NEG_INFINITY; SIZE[0] * SIZE[1]];
        by(&mut |place, z| heights[place] = higher(z, heights[place]));
        heights.to_vec()
    }

    /// Triangles on and beyond the grid, some with corners on pixels' centres, some of no area, some large.
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
        fn side_by_side_is_one_by_one(triangles in triangles()) {
            let block: Block = std::array::from_fn(|corner| {
                std::array::from_fn(|axis| std::array::from_fn(|k| triangles[k][corner][axis]))
            });
            let together = filled(|mut meet| fill_block(&block, &AS_THEY_ARE, SIZE, &mut meet));
            let alone = filled(|mut meet| {
                for corners in &triangles {
                    fill(*corners, SIZE, &mut meet);
                }
            });
            prop_assert_eq!(together, alone);
        }
    }
}
