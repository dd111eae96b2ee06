//! Triangles in structure-of-arrays blocks, and affine forms over their corners.

/// Triangles per block, one SIMD vector of each coordinate.
pub(super) const LANES: usize = 8;

/// A block of triangles, indexed by corner, axis and lane. A block that is not full repeats its last triangle. A point
/// is stored as a triangle whose corners coincide.
pub(super) type TriangleBlock = [[LaneArray; 3]; 3];
pub(super) type LaneArray = [f32; LANES];

/// An affine function of a corner's offset from the origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct AffineForm(pub(super) [f32; 4]);

impl AffineForm {
    /// Evaluates the form at one corner.
    #[inline(always)]
    pub(super) fn at(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [a, b, c, d] = self.0;
        a * x + b * y + c * z + d
    }

    /// Evaluates the form at one corner of each lane.
    #[inline(always)]
    pub(super) fn at_lanes(&self, [x, y, z]: &[LaneArray; 3]) -> LaneArray {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            values[k] = self.at([x[k], y[k], z[k]]);
        }
        values
    }
}

/// A vertex coordinate in the precision of its file.
pub(super) trait Coordinate: Copy + Into<f64> {
    /// Returns the origin for offsets: the value nearest to `near` that this type represents exactly, in mesh units.
    fn reference(near: f64) -> f64;
    /// Returns the offset from the origin, mesh units.
    fn offset_from(self, origin: f64) -> f32;
}

impl Coordinate for f32 {
    fn reference(near: f64) -> f64 {
        f64::from(near as f32)
    }

    #[inline(always)]
    fn offset_from(self, origin: f64) -> f32 {
        self - origin as f32
    }
}

impl Coordinate for f64 {
    fn reference(near: f64) -> f64 {
        near
    }

    #[inline(always)]
    fn offset_from(self, origin: f64) -> f32 {
        (self - origin) as f32
    }
}

/// Packs up to [`LANES`] triangles and repeats the last.
#[inline(always)]
pub(super) fn pack_block<T: Coordinate>(
    triangles: &[[u32; 3]],
    vertices: &[[T; 3]],
    origin: [f64; 3],
) -> TriangleBlock {
    let mut block = [[[0.0; LANES]; 3]; 3];
    if let Some(corners) = consecutive_vertices(triangles, vertices) {
        for lane in 0..LANES {
            for corner in 0..3 {
                for axis in 0..3 {
                    let place = corners[3 * lane + corner][axis];
                    block[corner][axis][lane] = place.offset_from(origin[axis]);
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
                corner[axis][lane] = vertex[axis].offset_from(origin[axis]);
            }
        }
    }
    block
}

/// Returns the vertices of [`LANES`] triangles if the vertices are consecutive, as in a triangle soup.
#[inline(always)]
fn consecutive_vertices<'a, T>(
    triangles: &[[u32; 3]],
    vertices: &'a [[T; 3]],
) -> Option<&'a [[T; 3]; 3 * LANES]> {
    let triangles = triangles.first_chunk::<LANES>()?;
    let first = triangles[0][0];
    let mut is_consecutive = true;
    for (k, corner) in (0_u32..).zip(triangles.as_flattened()) {
        is_consecutive &= *corner == first.wrapping_add(k);
    }
    let vertices = vertices.get(first as usize..)?;
    vertices.first_chunk().filter(|_| is_consecutive)
}
