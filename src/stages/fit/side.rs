//! Which side of the plane is carved: told from the surface, not assumed.

use super::surface::Surface;
use crate::domain::{Bow, Rigid3, SideEvidence};
use crate::mesh::Mesh;

/// What was seen from one side.
#[derive(Debug, Clone)]
pub(super) struct Face {
    pub(super) plane_from_mesh: Rigid3,
    pub(super) bow: Option<Bow>,
    pub(super) bow_height: f64,
    pub(super) relief: f64,
    pub(super) extent: f64,
    pub(super) range: f64,
    pub(super) residuals: Vec<f64>,
    pub(super) surface: Surface,
}

/// The carved one of two faces with the evidence for it; `None` when neither shows a surface.
pub(super) fn choose(
    mesh: &Mesh,
    faces: [Option<Face>; 2],
    scanned_face_down: Option<bool>,
) -> Option<(Face, SideEvidence)> {
    let [a, b] = faces;
    let (a, b) = match (a, b) {
        (Some(a), Some(b)) => (a, b),
        (Some(only), None) | (None, Some(only)) => {
            let winding = outward_share(mesh, &only.plane_from_mesh);
            let side = SideEvidence {
                winding,
                flatness: only.surface.tops,
                confidence: 1.0,
            };
            return Some((only, side));
        }
        (None, None) => return None,
    };
    let _ = scanned_face_down;
    let (best, other) = if a.surface.support >= b.surface.support {
        (a, b)
    } else {
        (b, a)
    };
    let side = SideEvidence {
        winding: outward_share(mesh, &best.plane_from_mesh),
        flatness: best.surface.tops,
        confidence: (best.surface.support - other.surface.support).clamp(0.0, 1.0),
    };
    Some((best, side))
}

/// Share of the area, as seen along the normal, whose winding looks out on this side; `None` without faces.
fn outward_share(mesh: &Mesh, plane_from_mesh: &Rigid3) -> Option<f64> {
    let [x, y, z, _] = plane_from_mesh.0[2];
    let (mut out, mut all) = (0.0, 0.0);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
        let (p, q) = (minus(b, a), minus(c, a));
        let facing = x * (p[1] * q[2] - p[2] * q[1])
            + y * (p[2] * q[0] - p[0] * q[2])
            + z * (p[0] * q[1] - p[1] * q[0]);
        all += facing.abs();
        out += facing.max(0.0);
    }
    (all > 0.0).then(|| out / all)
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
