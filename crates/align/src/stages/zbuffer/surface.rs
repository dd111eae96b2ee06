//! A mesh packed into blocks of triangles with bounding boxes, for fast rendering along any direction.

use super::block_bounds::BlockBounds;
use super::draw_effort::GivenUp;
use super::triangle_block::{AffineForm, Coordinate, LANES, LaneArray, TriangleBlock, pack_block};
use mocban_core::domain::Rigid3;
use mocban_core::domain::cancel::{poll, polled};
use mocban_core::mesh::robust_bounds::{Bounds, BulkRange, bulk_box, samples};
use mocban_core::mesh::{Mesh, Vertices};
use mocban_core::page_vec::PageVec;
use mocban_core::simd::dispatch;

/// Largest number of blocks that are sampled to decide the winding. Tens of thousands of triangles are enough.
const WINDING_SAMPLE_BLOCKS: usize = 8_192;

/// Groups of 64 triangles between two polls for a cancellation.
const GROUPS_PER_POLL: usize = 64;

/// A surface that can be bounded and rendered along any direction.
///
/// Corners are stored in single precision relative to the centre of the bulk (the range of the scan without specks).
/// The precision is about 1e-7 of the extent of the bulk.
#[derive(Debug)]
pub(crate) struct IndexedSurface {
    pub(super) origin: [f64; 3],
    /// Bounding box of the bulk, mesh frame.
    pub(crate) bulk: Bounds<3>,
    pub(super) blocks: PageVec<TriangleBlock>,
    /// Boxes of each [`LANES`] blocks.
    pub(super) bounds: Vec<BlockBounds>,
    /// Samples of the corners, which show the bulk along any direction.
    corners: Vec<[f32; 3]>,
    /// Number of triangles (or points) in the blocks.
    pub(super) triangle_count: usize,
    pub(super) has_faces: bool,
    /// Whether a rendering was given up.
    pub(super) given_up: GivenUp,
}

impl IndexedSurface {
    /// Packs the triangles of a mesh, or its points if it has none.
    pub(crate) fn new(mesh: &Mesh) -> Self {
        match &mesh.vertices {
            Vertices::Single(vertices) => Self::of(mesh, vertices),
            Vertices::Double(vertices) => Self::of(mesh, vertices),
        }
    }

    fn of<T: Coordinate>(mesh: &Mesh, vertices: &[[T; 3]]) -> Self {
        let bulk @ [low, high]: Bounds<3> = bulk_box(vertices);
        let origin = [0, 1, 2].map(|k| T::reference(f64::midpoint(low[k], high[k])));
        let points: PageVec<[u32; 3]>;
        let triangles = if mesh.triangles.is_empty() {
            points = polled(0..vertices.len() as u32).map(|i| [i; 3]).collect();
            &points
        } else {
            &mesh.triangles
        };
        let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let extent = sides.into_iter().fold(0.0, f64::max) as f32;
        let mut blocks = PageVec::with_capacity(triangles.len().div_ceil(LANES));
        let mut bounds = Vec::with_capacity(triangles.len().div_ceil(LANES * LANES));
        dispatch!({
            for (number, group) in triangles.chunks(LANES * LANES).enumerate() {
                if number.is_multiple_of(GROUPS_PER_POLL) {
                    poll();
                }
                let first = blocks.len();
                for triangles in group.chunks(LANES) {
                    blocks.push(pack_block(triangles, vertices, origin));
                }
                bounds.push(BlockBounds::new(&blocks[first..], extent));
            }
        });
        let corners = samples(blocks.len() * 3 * LANES, |k| {
            let corner: &[LaneArray; 3] = &blocks[k / (3 * LANES)][k / LANES % 3];
            [0, 1, 2].map(|axis| corner[axis][k % LANES])
        });
        Self {
            origin,
            bulk,
            corners,
            triangle_count: triangles.len(),
            bounds,
            blocks,
            has_faces: !mesh.triangles.is_empty(),
            given_up: GivenUp::default(),
        }
    }

    /// Returns the rows of coefficients that map a vertex's offset from the origin to x, y and z in `frame`.
    pub(super) fn frame_rows(&self, frame: &Rigid3) -> [[f64; 4]; 3] {
        let moved = frame.apply(self.origin);
        std::array::from_fn(|k| {
            let [a, b, c, _] = frame.0[k];
            [a, b, c, moved[k]]
        })
    }

    /// Returns whether the surface has neither faces nor points.
    pub(crate) const fn is_empty(&self) -> bool {
        self.triangle_count == 0
    }

    /// Returns the bounds of the bulk in x and y of a plane frame, in mesh units. The surface must not be empty.
    pub(crate) fn bounds(&self, plane_from_mesh: &Rigid3) -> Bounds<2> {
        let [x, y, _] = self.frame_rows(plane_from_mesh);
        let [x, y] = [x, y].map(|row| self.bulk_range_along(&AffineForm(row.map(|v| v as f32))));
        [[x[0], y[0]], [x[1], y[1]]]
    }

    /// Returns the lowest and highest value of the bulk along an affine form.
    fn bulk_range_along(&self, row: &AffineForm) -> [f64; 2] {
        // The samples come first, so that few blocks change the range.
        let sampled: Vec<f32> = self.corners.iter().map(|corner| row.at(*corner)).collect();
        let mut bulk = BulkRange::new(&sampled);
        bulk.add_all(&sampled);
        let [mut low, mut high] = bulk.range();
        dispatch!({
            let groups = self.bounds.iter().zip(self.blocks.chunks(LANES));
            for (group, (bounds, blocks)) in groups.enumerate() {
                if group.is_multiple_of(GROUPS_PER_POLL) {
                    poll();
                }
                let [lows, highs] = bounds.range_along(row);
                let mut is_wider = false;
                for k in 0..LANES {
                    is_wider |= (lows[k] < low) | (highs[k] > high);
                }
                if !is_wider {
                    continue;
                }
                for (k, block) in blocks.iter().enumerate() {
                    if lows[k] < low || highs[k] > high {
                        for corner in block {
                            bulk.add(row.at_lanes(corner));
                        }
                        [low, high] = bulk.range();
                    }
                }
            }
        });
        [low, high].map(f64::from)
    }

    /// Projects the surface along z of the frame. Returns the fraction of the projected area, 0..=1, with a winding
    /// that faces +z. Returns `None` if there are no faces, or if the area is zero.
    pub(crate) fn upward_facing_share(&self, plane_from_mesh: &Rigid3) -> Option<f64> {
        if !self.has_faces {
            return None;
        }
        let normal = [0, 1, 2].map(|k| plane_from_mesh.0[2][k] as f32);
        let (mut out, mut all) = (0.0, 0.0);
        let stride = self.blocks.len().div_ceil(WINDING_SAMPLE_BLOCKS);
        dispatch!({
            for (place, [a, b, c]) in self.blocks.iter().enumerate().step_by(stride) {
                let facing = facing(normal, a, b, c);
                // The last block repeats its last triangle.
                let count = self.triangle_count - place * LANES;
                for (k, facing) in facing.into_iter().enumerate() {
                    let facing = f64::from(if k < count { facing } else { 0.0 });
                    all += facing.abs();
                    out += facing.max(0.0);
                }
            }
        });
        (all > 0.0).then(|| out / all)
    }
}

/// Returns twice each triangle's signed area, projected along the normal. Triangles facing away have a negative area.
#[inline(always)]
fn facing(
    [x, y, z]: [f32; 3],
    a: &[LaneArray; 3],
    b: &[LaneArray; 3],
    c: &[LaneArray; 3],
) -> LaneArray {
    let mut facing = [0.0; LANES];
    for (k, facing) in facing.iter_mut().enumerate() {
        let p = [0, 1, 2].map(|axis| b[axis][k] - a[axis][k]);
        let q = [0, 1, 2].map(|axis| c[axis][k] - a[axis][k]);
        *facing = x * (p[1] * q[2] - p[2] * q[1])
            + y * (p[2] * q[0] - p[0] * q[2])
            + z * (p[0] * q[1] - p[1] * q[0]);
    }
    facing
}
