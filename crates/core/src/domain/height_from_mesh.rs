//! Heights of mesh points over the fitted surface, as a depth map measures them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Curvature, Rigid3};

/// The map from mesh points to heights over the fitted surface, which may be curved.
///
/// With `[x, y, z] = plane_from_mesh * [X, Y, Z, 1]`, the height is
/// `z - (c0 + cx x + cy y + cxx x^2 + cxy x y + cyy y^2)`, in mesh units. It is the height that the levels of the depth
/// map and `threshold_depth` refer to. The third row of `print_from_mesh` gives `z` instead, the height over the plane.
///
/// ```
/// use mocban_core::domain::{Curvature, HeightFromMesh, Rigid3};
///
/// let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let plane_from_mesh = Rigid3::to_frame(axes, [0.0; 3]);
/// // A block that is bent along x: the stroke tops lie at z = 0.01 x^2.
/// let curvature = Curvature([0.0, 0.0, 0.0, 0.01, 0.0, 0.0]);
/// let height_from_mesh = HeightFromMesh::new(&plane_from_mesh, Some(&curvature));
///
/// // A vertex is stroke where its height is at least `threshold_depth`, which is 0.1 mm below the tops here.
/// let threshold_depth = -0.1;
/// let top = [10.0, 3.0, 0.95];
/// let ground = [10.0, 5.0, 0.4];
/// assert!((height_from_mesh.apply(top) - -0.05).abs() < 1e-12);
/// assert!(height_from_mesh.apply(top) >= threshold_depth);
/// assert!(height_from_mesh.apply(ground) < threshold_depth);
/// // The height over the plane would call the ground stroke, because the block is bent upward there.
/// assert!(plane_from_mesh.apply(ground)[2] >= threshold_depth);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeightFromMesh {
    /// First three rows of `plane_from_mesh`: mesh coordinates to x, y and z of the plane frame, mesh units.
    pub plane_from_mesh: [[f64; 4]; 3],
    /// `[c0, cx, cy, cxx, cxy, cyy]`: the fitted surface over the plane, mesh units. All zero for a flat block.
    pub curvature: [f64; 6],
}

impl HeightFromMesh {
    /// Returns the map for a plane and the curved surface over it.
    pub fn new(plane_from_mesh: &Rigid3, curvature: Option<&Curvature>) -> Self {
        let [x, y, z, _] = plane_from_mesh.0;
        Self {
            plane_from_mesh: [x, y, z],
            curvature: curvature.map_or([0.0; 6], |curvature| curvature.0),
        }
    }

    /// Returns the height of a mesh point over the fitted surface, in mesh units.
    pub fn apply(&self, [x, y, z]: [f64; 3]) -> f64 {
        let dot = |row: [f64; 4]| row[0] * x + row[1] * y + row[2] * z + row[3];
        let [u, v, height] = self.plane_from_mesh.map(dot);
        height - Curvature(self.curvature).height(u, v)
    }
}
