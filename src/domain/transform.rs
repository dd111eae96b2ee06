//! Maps between frames, named `to_from_from`: mesh, plane, depth map, print image, canvas.
//!
//! Matrices are row-major and act on column vectors. Pixel frames have x to the right, y down, and (0, 0) at the
//! centre of the top-left pixel, so a positive angle turns clockwise on the screen.

use serde::{Deserialize, Serialize};

/// An affine map of the plane: two rows of three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Affine2(pub [[f64; 3]; 2]);

impl Affine2 {
    /// The map that changes nothing.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);

    /// Turn by `angle_rad` (clockwise on the screen), scale, then shift.
    pub fn similarity(scale: f64, angle_rad: f64, shift: [f64; 2]) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        Self([
            [scale * cos, -scale * sin, shift[0]],
            [scale * sin, scale * cos, shift[1]],
        ])
    }

    /// Scale, then shift.
    pub fn scale_shift(scale: f64, shift: [f64; 2]) -> Self {
        Self([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    }

    /// Where a point goes.
    pub fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.0;
        [a[0] * x + a[1] * y + a[2], b[0] * x + b[1] * y + b[2]]
    }

    /// `c_from_b.after(&b_from_a)` is `c_from_a`.
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

    /// Determinant of the linear part: negative for a map that mirrors.
    pub fn determinant(&self) -> f64 {
        self.0[0][0] * self.0[1][1] - self.0[0][1] * self.0[1][0]
    }

    /// The map back; `None` when this one flattens the plane.
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

    /// Pixels of a picture so wide to those of its mirror image, left and right changed.
    pub fn mirror(width_px: u32) -> Self {
        Self([[-1.0, 0.0, f64::from(width_px) - 1.0], [0.0, 1.0, 0.0]])
    }

    /// Square root of the area factor.
    pub fn scale(&self) -> f64 {
        self.determinant().abs().sqrt()
    }

    /// Turn of the x axis in degrees, in (-180, 180], positive clockwise on the screen.
    pub fn angle_deg(&self) -> f64 {
        let angle = self.0[1][0].atan2(self.0[0][0]).to_degrees();
        if angle <= -180.0 {
            angle + 360.0
        } else {
            angle
        }
    }
}

/// A rigid motion of space as a 4x4 matrix, such as `plane_from_mesh`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rigid3(pub [[f64; 4]; 4]);

impl Rigid3 {
    /// The motion that takes `origin` to zero and the three unit `axes` (right-handed) to x, y, z.
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

    /// Where a point goes.
    pub fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let dot = |r: [f64; 4]| r[0] * x + r[1] * y + r[2] * z + r[3];
        [dot(self.0[0]), dot(self.0[1]), dot(self.0[2])]
    }

    /// This motion after another.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let cell = |i: usize, j: usize| (0..4).map(|k| self.0[i][k] * first.0[k][j]).sum();
        Self(std::array::from_fn(|i| std::array::from_fn(|j| cell(i, j))))
    }

    /// The motion back: the transpose of the rotation.
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

/// The product of the whole system, 3x4: rows 1 and 2 give the print pixel of a mesh point `[X Y Z 1]`, row 3
/// its height over the character plane in mesh units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

    /// Print pixel x, y and height over the plane of a mesh point.
    pub fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let dot = |r: [f64; 4]| r[0] * x + r[1] * y + r[2] * z + r[3];
        [dot(self.0[0]), dot(self.0[1]), dot(self.0[2])]
    }
}

#[cfg(test)]
mod tests {
    use super::{Affine2, PrintFromMesh, Rigid3};

    fn close(a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).all(|(p, q)| (p - q).abs() < 1e-12)
    }

    #[test]
    fn positive_angle_turns_right_to_down() {
        let turn = Affine2::similarity(1.0, std::f64::consts::FRAC_PI_2, [0.0, 0.0]);
        assert!(close(&turn.apply([1.0, 0.0]), &[0.0, 1.0]));
        assert!((turn.angle_deg() - 90.0).abs() < 1e-12);
    }

    #[test]
    fn inverse_leads_back() {
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
        let whole = PrintFromMesh::new(&print_from_depth, &depth_from_plane, &plane_from_mesh);
        let point = [1.5, 2.25, 2.0];
        let [x, y, z] = plane_from_mesh.apply(point);
        let [u, v] = print_from_depth.apply(depth_from_plane.apply([x, y]));
        assert!(close(&whole.apply(point), &[u, v, z]));
    }
}
