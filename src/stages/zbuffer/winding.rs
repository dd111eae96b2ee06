//! Which way a surface's faces look.

use super::{IndexedSurface, LANES, Lanes};
use crate::domain::Rigid3;

/// About so many blocks are looked at: a share is told well enough by tens of thousands of triangles.
const LOOKED_AT: usize = 8_192;

impl IndexedSurface {
    /// Share of the area, as seen along z of a frame, whose winding looks up; `None` without faces.
    pub(in crate::stages) fn upward_facing_share(&self, plane_from_mesh: &Rigid3) -> Option<f64> {
        if !self.has_faces {
            return None;
        }
        let normal = [0, 1, 2].map(|k| plane_from_mesh.0[2][k] as f32);
        let (mut out, mut all) = (0.0, 0.0);
        let stride = self.blocks.len().div_ceil(LOOKED_AT);
        for (place, [a, b, c]) in self.blocks.iter().enumerate().step_by(stride) {
            let facing = facing(normal, a, b, c);
            // The last block repeats its last triangle.
            let count = self.count - place * LANES;
            for facing in facing.into_iter().take(count).map(f64::from) {
                all += facing.abs();
                out += facing.max(0.0);
            }
        }
        (all > 0.0).then(|| out / all)
    }
}

/// Twice the area of each triangle as seen along the normal, negative where it is seen from within.
fn facing([x, y, z]: [f32; 3], a: &[Lanes; 3], b: &[Lanes; 3], c: &[Lanes; 3]) -> Lanes {
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
