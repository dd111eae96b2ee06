//! The highest surface under each pixel, looking straight down on a plane (orthographic z-buffer).

mod block_bounds;
mod moments;
mod render;
mod small_triangles;
mod triangle_block;
mod triangle_fill;
mod viewport;
mod winding;

use super::robust_bounds::{Bounds, Bulk, room};
use crate::domain::Rigid3;
use crate::mesh::{Mesh, Vertices};
use crate::page_vec::PageVec;
use crate::simd::dispatch;

use block_bounds::Boxes;
pub(super) use moments::Moments;
pub(super) use render::NO_HIT;
use triangle_block::{Block, Coordinate, LANES, Lanes, Row, block};
pub(super) use viewport::Viewport;

/// A surface ready to be looked at along any direction.
///
/// Corners are kept relative to the middle of the bulk, which single precision resolves to a ten-millionth of its
/// extent.
#[derive(Debug)]
pub(super) struct IndexedSurface {
    middle: [f64; 3],
    /// Box around the bulk.
    room: Bounds<3>,
    blocks: PageVec<Block>,
    /// Around each [`LANES`] blocks.
    boxes: Vec<Boxes>,
    /// Triangles, or points, in the blocks.
    count: usize,
    has_faces: bool,
}

impl IndexedSurface {
    /// Takes the corners of a mesh's triangles, or its points when it has none.
    pub(super) fn new(mesh: &Mesh) -> Self {
        match &mesh.vertices {
            Vertices::Single(vertices) => Self::of(mesh, vertices),
            Vertices::Double(vertices) => Self::of(mesh, vertices),
        }
    }

    fn of<T: Coordinate>(mesh: &Mesh, vertices: &[[T; 3]]) -> Self {
        let room @ [low, high]: Bounds<3> = room(vertices);
        let middle: [f64; 3] = std::array::from_fn(|k| T::middle(f64::midpoint(low[k], high[k])));
        let points: PageVec<[u32; 3]>;
        let triangles = if mesh.triangles.is_empty() {
            points = (0..vertices.len() as u32).map(|i| [i; 3]).collect();
            &points
        } else {
            &mesh.triangles
        };
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let extent = sides.into_iter().fold(0.0, f64::max) as f32;
        let mut blocks = PageVec::with_capacity(triangles.len().div_ceil(LANES));
        let mut boxes = Vec::with_capacity(triangles.len().div_ceil(LANES * LANES));
        dispatch(
            #[inline(always)]
            || {
                for group in triangles.chunks(LANES * LANES) {
                    let first = blocks.len();
                    for few in group.chunks(LANES) {
                        blocks.push(block(few, vertices, middle));
                    }
                    boxes.push(Boxes::around(&blocks[first..], extent));
                }
            },
        );
        Self {
            middle,
            room,
            count: triangles.len(),
            boxes,
            blocks,
            has_faces: !mesh.triangles.is_empty(),
        }
    }

    /// Box around the bulk, in the mesh's frame.
    pub(super) const fn bulk_bounds(&self) -> Bounds<3> {
        self.room
    }

    /// Rows that give a place in a frame: x, y, z.
    fn rows(&self, frame: &Rigid3) -> [[f64; 4]; 3] {
        let origin = frame.apply(self.middle);
        std::array::from_fn(|k| {
            let [a, b, c, _] = frame.0[k];
            [a, b, c, origin[k]]
        })
    }

    /// Bounds in x and y of a frame of the bulk of the corners.
    pub(super) fn bounds(&self, plane_from_mesh: &Rigid3) -> Bounds<2> {
        let [x, y, _] = self.rows(plane_from_mesh);
        let [x, y] = [x, y].map(|row| self.along(&Row(row.map(|v| v as f32))));
        [[x[0], y[0]], [x[1], y[1]]]
    }

    /// The first and the last place of the bulk of the corners.
    fn along(&self, row: &Row) -> [f64; 2] {
        let mut bulk = Bulk::of(self.blocks.len() * 3 * LANES, |k| {
            let corner = &self.blocks[k / (3 * LANES)][k / LANES % 3];
            row.place([0, 1, 2].map(|axis| corner[axis][k % LANES]))
        });
        let take = |bulk: &mut Bulk, block: &Block| {
            for corner in block {
                bulk.take(row.at(corner));
            }
        };
        // Those that reach farthest come first, so that few of the others have anything to add.
        for place in self.farthest(row, &bulk) {
            take(&mut bulk, &self.blocks[place]);
        }
        let [mut low, mut high] = bulk.taken();
        dispatch(
            #[inline(always)]
            || {
                for (boxes, blocks) in self.boxes.iter().zip(self.blocks.chunks(LANES)) {
                    let [lows, highs] = boxes.reach(row);
                    for (k, block) in blocks.iter().enumerate() {
                        if lows[k] < low || highs[k] > high {
                            take(&mut bulk, block);
                            [low, high] = bulk.taken();
                        }
                    }
                }
            },
        );
        [low, high].map(f64::from)
    }

    /// The blocks whose boxes reach farthest down and up, those that reach out of the bulk left out.
    fn farthest(&self, row: &Row, bulk: &Bulk) -> [usize; 2] {
        let (mut places, [mut low, mut high]) = ([0; 2], [f32::INFINITY, f32::NEG_INFINITY]);
        dispatch(
            #[inline(always)]
            || {
                for (group, boxes) in self.boxes.iter().enumerate() {
                    let [lows, highs] = boxes.reach(row);
                    for k in 0..LANES {
                        if lows[k] < low && bulk.holds(lows[k]) {
                            (low, places[0]) = (lows[k], group * LANES + k);
                        }
                        if highs[k] > high && bulk.holds(highs[k]) {
                            (high, places[1]) = (highs[k], group * LANES + k);
                        }
                    }
                }
            },
        );
        places.map(|place| place.min(self.blocks.len() - 1))
    }
}
