//! A few triangles side by side, and which of them may hold a pixel's centre.

use super::small_triangles::Small;
use super::triangle_fill::fill;
use crate::simd::{higher, lower, whole_below};

/// Triangles that are asked together whether they hold a pixel's centre: most of a scan's are too small.
pub(super) const LANES: usize = 8;

/// A few triangles side by side: x, y and z of their first corners, then of their second and third. The last block
/// repeats its last triangle; a point is a triangle whose corners are one.
pub(super) type Block = [[Lanes; 3]; 3];
pub(super) type Lanes = [f32; LANES];

/// A linear function of a corner's place relative to the middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row(pub(super) [f32; 4]);

impl Row {
    /// Of one corner.
    #[inline(always)]
    pub(super) fn place(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [a, b, c, d] = self.0;
        a * x + b * y + c * z + d
    }

    /// Of corners side by side.
    #[inline(always)]
    pub(super) fn at(&self, [x, y, z]: &[Lanes; 3]) -> Lanes {
        let mut places = [0.0; LANES];
        for k in 0..LANES {
            places[k] = self.place([x[k], y[k], z[k]]);
        }
        places
    }
}

/// A number of a vertex as its file has it.
pub(super) trait Coordinate: Copy + Into<f64> {
    /// The place that others are told from, near the one asked for, mesh units.
    fn middle(near: f64) -> f64;
    /// How far it lies beyond a middle, mesh units.
    fn beyond(self, middle: f64) -> f32;
}

impl Coordinate for f32 {
    fn middle(near: f64) -> f64 {
        f64::from(near as f32)
    }

    #[inline(always)]
    fn beyond(self, middle: f64) -> f32 {
        self - middle as f32
    }
}

impl Coordinate for f64 {
    fn middle(near: f64) -> f64 {
        near
    }

    #[inline(always)]
    fn beyond(self, middle: f64) -> f32 {
        (self - middle) as f32
    }
}

/// Up to [`LANES`] triangles, the last repeated.
#[inline(always)]
pub(super) fn block<T: Coordinate>(
    triangles: &[[u32; 3]],
    vertices: &[[T; 3]],
    middle: [f64; 3],
) -> Block {
    let mut block = [[[0.0; LANES]; 3]; 3];
    if let Some(corners) = in_a_row(triangles, vertices) {
        for lane in 0..LANES {
            for corner in 0..3 {
                for axis in 0..3 {
                    let place = corners[3 * lane + corner][axis];
                    block[corner][axis][lane] = place.beyond(middle[axis]);
                }
            }
        }
        return block;
    }
    for lane in 0..LANES {
        let triangle = triangles[lane.min(triangles.len() - 1)];
        for (corner, i) in block.iter_mut().zip(triangle) {
            let vertex = vertices[i as usize];
            for axis in 0..3 {
                corner[axis][lane] = vertex[axis].beyond(middle[axis]);
            }
        }
    }
    block
}

/// The vertices of [`LANES`] triangles, where they lie one after the other, as in a soup.
#[inline(always)]
fn in_a_row<'a, T>(
    triangles: &[[u32; 3]],
    vertices: &'a [[T; 3]],
) -> Option<&'a [[T; 3]; 3 * LANES]> {
    let triangles = triangles.first_chunk::<LANES>()?;
    let first = triangles[0][0];
    let mut is_in_a_row = true;
    for (k, corner) in (0_u32..).zip(triangles.as_flattened()) {
        is_in_a_row &= *corner == first.wrapping_add(k);
    }
    let vertices = vertices.get(first as usize..)?;
    vertices.first_chunk().filter(|_| is_in_a_row)
}

/// Fills those of a few triangles that hold a pixel's centre.
#[inline(always)]
pub(super) fn fill_block(
    block: &Block,
    [u, v, z]: &[Row; 3],
    size: [usize; 2],
    meet: &mut impl FnMut(usize, f32),
) {
    // A copy of its own: what may lie where `meet` writes is not computed side by side.
    let block = *block;
    let [a, b, c] = &block;
    let (across, down) = ([u.at(a), u.at(b), u.at(c)], [v.at(a), v.at(b), v.at(c)]);
    let ends = [ends(&across), ends(&down)];
    let held = holding([&ends[0], &ends[1]], size);
    if held == [false; LANES] {
        return;
    }
    let heights = [z.at(a), z.at(b), z.at(c)];
    let corners = [across, down, heights];
    let small = Small::of(&ends, held, size);
    if !small.is_empty() {
        small.fill(&corners, size, meet);
    }
    for k in (0..LANES).filter(|k| held[*k] && !small.lanes[*k]) {
        let corner = |c: usize| [across[c][k], down[c][k], heights[c][k]];
        fill([corner(0), corner(1), corner(2)], size, meet);
    }
}

/// The lowest and the highest of three corners' places.
#[inline(always)]
fn ends([a, b, c]: &[Lanes; 3]) -> [Lanes; 2] {
    let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        low[k] = lower(lower(a[k], b[k]), c[k]);
        high[k] = higher(higher(a[k], b[k]), c[k]);
    }
    [low, high]
}

/// Which lanes may hold a pixel's centre, given how far they reach along each axis of the grid.
#[inline(always)]
pub(super) fn holding(
    [across, down]: [&[Lanes; 2]; 2],
    [width, height]: [usize; 2],
) -> [bool; LANES] {
    let (wide, high) = (holding_along(across, width), holding_along(down, height));
    let mut held = [false; LANES];
    for k in 0..LANES {
        held[k] = wide[k] & high[k];
    }
    held
}

#[inline(always)]
fn holding_along([low, high]: &[Lanes; 2], side: usize) -> [bool; LANES] {
    let last = side as f32 - 1.0;
    let mut holds = [false; LANES];
    for k in 0..LANES {
        let below = whole_below(lower(higher(high[k], -1.0), last));
        holds[k] = below >= higher(low[k], 0.0);
    }
    holds
}
