//! Maps between the frames of mesh, plane, depth map, print image and canvas. `a_from_b` maps from frame b to frame a.
//!
//! Matrices are row-major and act on column vectors. In pixel frames, x points right, y points down, and (0, 0) is the
//! centre of the top-left pixel. A positive angle is therefore a clockwise rotation on the screen.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An affine map of the plane as a 2x3 matrix.
///
/// ```
/// use mocban_core::domain::Affine2;
///
/// let depth_from_plane = Affine2::scale_shift(40.0, [100.0, 90.0]);
/// let print_from_depth = Affine2::similarity(0.5, 90_f64.to_radians(), [10.0, 20.0]);
/// let print_from_plane = print_from_depth.after(&depth_from_plane);
/// let [x, y] = print_from_plane.apply([0.0, 0.0]);
/// assert!((x - -35.0).abs() < 1e-9 && (y - 70.0).abs() < 1e-9);
///
/// assert!((print_from_plane.angle_deg() - 90.0).abs() < 1e-9);
/// assert!((print_from_plane.scale() - 20.0).abs() < 1e-9);
/// let plane_from_print = print_from_plane.inverse().expect("a similarity is invertible");
/// let [x, y] = plane_from_print.apply([x, y]);
/// assert!(x.abs() < 1e-9 && y.abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Affine2(pub [[f64; 3]; 2]);

impl Affine2 {
    /// The identity.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);

    /// Returns the similarity that rotates by `angle_rad` (clockwise on the screen), scales, then shifts.
    pub fn similarity(scale: f64, angle_rad: f64, shift: [f64; 2]) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self([
            [scale * cos, -scale * sin, shift[0]],
            [scale * sin, scale * cos, shift[1]],
        ])
    }

    /// Returns the map that scales, then shifts.
    pub fn scale_shift(scale: f64, shift: [f64; 2]) -> Self {
        Self([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    }

    /// Returns the map from the pixels of an image to those of the image resized by `scale`. Pixel centres are integers, so
    /// both images share the corner (-0.5, -0.5).
    pub fn resize(scale: f64) -> Self {
        Self::scale_shift(scale, [(scale - 1.0) / 2.0; 2])
    }

    /// Maps a point.
    pub fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.0;
        [a[0] * x + a[1] * y + a[2], b[0] * x + b[1] * y + b[2]]
    }

    /// Composes two maps: `c_from_b.after(&b_from_a)` is `c_from_a`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let [a, b] = self.0;
        let [p, q] = first.0;
        let row = |r: [f64; 3]| {
            [
                r[0] * p[0] + r[1] * q[0],
                r[0] * p[1] + r[1] * q[1],
                r[0] * p[2] + r[1] * q[2] + r[2],
            ]
        };
        Self([row(a), row(b)])
    }

    /// Returns the determinant of the linear part; negative for a reflection.
    pub fn determinant(&self) -> f64 {
        self.0[0][0] * self.0[1][1] - self.0[0][1] * self.0[1][0]
    }

    /// Returns the inverse. Returns `None` for a singular map.
    pub fn inverse(&self) -> Option<Self> {
        let det = self.determinant();
        if !det.is_finite() || det == 0.0 {
            return None;
        }
        let [[a, b, c], [d, e, f]] = self.0;
        Some(Self([
            [e / det, -b / det, (b * f - c * e) / det],
            [-d / det, a / det, (c * d - a * f) / det],
        ]))
    }

    /// Returns the horizontal reflection of an image of the given width.
    pub fn mirror(width_px: u32) -> Self {
        Self([[-1.0, 0.0, f64::from(width_px) - 1.0], [0.0, 1.0, 0.0]])
    }

    /// Returns the scale: the square root of the factor by which areas change.
    pub fn scale(&self) -> f64 {
        self.determinant().abs().sqrt()
    }

    /// Returns the angle of the rotation that is closest to the linear part, in degrees, in (-180, 180], positive
    /// clockwise on the screen. The linear part of a map with a reflection is compared with rotations after a reflection
    /// of y. For a similarity, this is the rotation of the x axis.
    pub fn angle_deg(&self) -> f64 {
        let [[a, b, _], [c, d, _]] = self.0;
        let side = self.determinant().signum();
        let angle = (c - side * b).atan2(a + side * d).to_degrees();
        if angle <= -180.0 {
            angle + 360.0
        } else {
            angle
        }
    }
}

/// A rigid transform of space as a 4x4 matrix, such as `plane_from_mesh`.
///
/// ```
/// use mocban_core::domain::Rigid3;
///
/// // x of the new frame is y of the old one, and so on; the origin is at [1, 2, 3].
/// let axes = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
/// let plane_from_mesh = Rigid3::to_frame(axes, [1.0, 2.0, 3.0]);
/// assert_eq!(plane_from_mesh.apply([1.0, 2.5, 3.0]), [0.5, 0.0, 0.0]);
/// assert_eq!(plane_from_mesh.inverse().apply([0.5, 0.0, 0.0]), [1.0, 2.5, 3.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rigid3(pub [[f64; 4]; 4]);

impl Rigid3 {
    /// Returns the transform that maps `origin` to zero and the right-handed orthonormal `axes` to x, y and z.
    pub fn to_frame(axes: [[f64; 3]; 3], origin: [f64; 3]) -> Self {
        let row = |axis: [f64; 3]| {
            let shift = -(axis[0] * origin[0] + axis[1] * origin[1] + axis[2] * origin[2]);
            [axis[0], axis[1], axis[2], shift]
        };
        Self([
            row(axes[0]),
            row(axes[1]),
            row(axes[2]),
            [0.0, 0.0, 0.0, 1.0],
        ])
    }

    /// Maps a point.
    pub fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let dot = |r: [f64; 4]| r[0] * x + r[1] * y + r[2] * z + r[3];
        [dot(self.0[0]), dot(self.0[1]), dot(self.0[2])]
    }

    /// Composes two transforms: `c_from_b.after(&b_from_a)` is `c_from_a`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let cell = |i: usize, j: usize| (0..4).map(|k| self.0[i][k] * first.0[k][j]).sum();
        Self(std::array::from_fn(|i| std::array::from_fn(|j| cell(i, j))))
    }

    /// Returns the inverse, by transposing the rotation.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let m = &self.0;
        let mut back = [[0.0; 4]; 4];
        for (i, row) in back.iter_mut().take(3).enumerate() {
            for (j, value) in row.iter_mut().take(3).enumerate() {
                *value = m[j][i];
            }
            row[3] = -(0..3).map(|j| m[j][i] * m[j][3]).sum::<f64>();
        }
        back[3] = [0.0, 0.0, 0.0, 1.0];
        Self(back)
    }
}

/// The result of the pipeline: a 3x4 matrix that is applied to a mesh point `[X Y Z 1]`. The rows give the x and y of
/// the point's print pixel, and the point's height over the character plane in mesh units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrintFromMesh(pub [[f64; 4]; 3]);

impl PrintFromMesh {
    /// Composes the three maps of the pipeline.
    pub fn new(
        print_from_depth: &Affine2,
        depth_from_plane: &Affine2,
        plane_from_mesh: &Rigid3,
    ) -> Self {
        let [a, b] = print_from_depth.after(depth_from_plane).0;
        let m = &plane_from_mesh.0;
        let row = |r: [f64; 3]| {
            let mut out = [0.0; 4];
            for (j, value) in out.iter_mut().enumerate() {
                *value = r[0] * m[0][j] + r[1] * m[1][j];
            }
            out[3] += r[2];
            out
        };
        Self([row(a), row(b), m[2]])
    }

    /// Returns the map from depth-map pixels to print pixels that agrees with this map on the character plane. `None` if
    /// the depth map has no inverse.
    pub fn print_from_depth(
        &self,
        depth_from_plane: &Affine2,
        plane_from_mesh: &Rigid3,
    ) -> Option<Affine2> {
        let plane_from_depth = depth_from_plane.inverse()?;
        let mesh_from_plane = plane_from_mesh.inverse();
        let print = |depth: [f64; 2]| {
            let [x, y] = plane_from_depth.apply(depth);
            let [x, y, _] = self.apply(mesh_from_plane.apply([x, y, 0.0]));
            [x, y]
        };
        let origin = print([0.0, 0.0]);
        let [right, down] = [print([1.0, 0.0]), print([0.0, 1.0])];
        let row = |k: usize| [right[k] - origin[k], down[k] - origin[k], origin[k]];
        Some(Affine2([row(0), row(1)]))
    }

    /// Returns the same map to another image, to whose pixels `other_from_print` maps those of the print. Heights stay.
    ///
    /// ```
    /// use mocban_core::domain::{Affine2, PrintFromMesh};
    ///
    /// let map = PrintFromMesh([[2.0, 0.0, 0.0, 5.0], [0.0, 2.0, 0.0, 7.0], [0.0, 0.0, 1.0, 0.0]]);
    /// let moved = map.in_image(&Affine2::scale_shift(1.0, [-3.0, 4.0]));
    /// assert_eq!(moved.apply([1.0, 1.0, 9.0]), [4.0, 13.0, 9.0]);
    /// ```
    #[must_use]
    pub fn in_image(&self, other_from_print: &Affine2) -> Self {
        let [x, y, height] = self.0;
        let row = |[a, b, c]: [f64; 3]| {
            let mut row = [0, 1, 2, 3].map(|k: usize| a * x[k] + b * y[k]);
            row[3] += c;
            row
        };
        let [first, second] = other_from_print.0;
        Self([row(first), row(second), height])
    }

    /// Maps a mesh point to `[x, y, height]`: x and y in print pixels, the height over the plane in mesh units.
    pub fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let dot = |r: [f64; 4]| r[0] * x + r[1] * y + r[2] * z + r[3];
        [dot(self.0[0]), dot(self.0[1]), dot(self.0[2])]
    }
}

#[cfg(test)]
mod tests {
    use super::{Affine2, PrintFromMesh, Rigid3};

    #[test]
    fn an_alignment_and_the_maps_to_the_plane_give_the_pose_back() {
        let print_from_depth = Affine2::similarity(0.7, 0.4, [12.0, -3.0]);
        let depth_from_plane = Affine2([[-20.0, 0.0, 256.0], [0.0, -20.0, 250.0]]);
        let (sin, cos) = 0.6_f64.sin_cos();
        let axes = [[cos, sin, 0.0], [0.0, 0.0, 1.0], [sin, -cos, 0.0]];
        let plane_from_mesh = Rigid3::to_frame(axes, [5.0, -7.0, 2.0]);
        let print_from_mesh =
            PrintFromMesh::new(&print_from_depth, &depth_from_plane, &plane_from_mesh);
        let pose = print_from_mesh
            .print_from_depth(&depth_from_plane, &plane_from_mesh)
            .unwrap();
        for (row, expected) in pose.0.iter().zip(&print_from_depth.0) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }

    fn close(a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).all(|(p, q)| (p - q).abs() < 1e-12)
    }

    #[test]
    fn positive_angle_rotates_right_to_down() {
        let rotation = Affine2::similarity(1.0, std::f64::consts::FRAC_PI_2, [0.0, 0.0]);
        assert!(close(&rotation.apply([1.0, 0.0]), &[0.0, 1.0]));
        assert!((rotation.angle_deg() - 90.0).abs() < 1e-12);
    }

    #[test]
    fn angle_is_that_of_the_closest_rotation() {
        let stretch = Affine2([[1.0, 0.08, 0.0], [0.08, 1.0, 0.0]]);
        let rotated = Affine2::similarity(3.0, 0.5, [0.0; 2]).after(&stretch);
        let mirrored = rotated.after(&Affine2([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]));
        for map in [rotated, mirrored] {
            assert!((map.angle_deg() - 0.5_f64.to_degrees()).abs() < 1e-9);
        }
    }

    #[test]
    fn inverse_undoes_the_map() {
        let there = Affine2::similarity(2.5, 0.7, [3.0, -4.0]);
        let back = there.inverse().expect("a similarity has an inverse");
        assert!(close(&back.after(&there).apply([5.0, 6.0]), &[5.0, 6.0]));
        let (s, c) = 0.4_f64.sin_cos();
        let motion = Rigid3::to_frame(
            [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]],
            [1.0, 2.0, 3.0],
        );
        let point = [0.3, -0.2, 9.0];
        assert!(close(&motion.inverse().apply(motion.apply(point)), &point));
        assert!(close(&motion.apply([1.0, 2.0, 3.0]), &[0.0; 3]));
        assert!(close(&motion.inverse().after(&motion).apply(point), &point));
        let twice = motion.apply(motion.apply(point));
        assert!(close(&motion.after(&motion).apply(point), &twice));
    }

    #[test]
    fn product_equals_the_three_steps() {
        let plane_from_mesh = Rigid3::to_frame(
            [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            [1.0, 2.0, 3.0],
        );
        let depth_from_plane = Affine2([[-40.0, 0.0, 100.0], [0.0, 40.0, 90.0]]);
        let print_from_depth = Affine2::similarity(0.3, -0.2, [5.0, 6.0]);
        let product = PrintFromMesh::new(&print_from_depth, &depth_from_plane, &plane_from_mesh);
        let point = [1.5, 2.25, 2.0];
        let [x, y, z] = plane_from_mesh.apply(point);
        let [u, v] = print_from_depth.apply(depth_from_plane.apply([x, y]));
        assert!(close(&product.apply(point), &[u, v, z]));
    }
}
