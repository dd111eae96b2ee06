//! The pose of a scan: the map from the block frame to the mesh frame, in mesh units.
//!
//! The block frame is right-handed and in mm. Its z axis points out of the block, and its origin is the character's
//! centre. The block is carved in mirror writing, so the print's x axis is reversed. The print's y axis points down.
//! Therefore a point (u, v) of the print lies at x = -u, y = -v on the block.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::normal;
use super::tier::Tier;
use mocban_core::domain::{Affine2, LengthUnit, PrintFromMesh};

/// A rigid motion and a length unit.
#[derive(Debug, Clone)]
pub(super) struct ScanPose {
    /// Rows of the rotation from block to mesh frame.
    rotation: [[f64; 3]; 3],
    /// Position of the block's origin, mm.
    shift_mm: [f64; 3],
    /// Mesh units per millimetre.
    unit_per_mm: f64,
    /// The unit given in the manifest.
    pub unit: Option<LengthUnit>,
}

/// The plane of the stroke tops in mesh coordinates: `n . x + d = 0`.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct TopsPlane {
    /// Unit normal, out of the block.
    pub n: [f64; 3],
    /// Offset, mesh units.
    pub d: f64,
}

impl ScanPose {
    /// Draws a pose of a tier.
    pub(super) fn draw(tier: Tier, rng: &mut ChaCha8Rng) -> Self {
        let (rotation, max_shift_mm) = if tier.is_any_pose() {
            (any_rotation(rng), 150.0)
        } else {
            (upright_rotation(rng), 20.0)
        };
        let (unit, unit_per_mm) = draw_unit(tier, rng);
        Self {
            rotation,
            shift_mm: [0; 3].map(|_: i32| rng.random_range(-max_shift_mm..max_shift_mm)),
            unit_per_mm,
            unit,
        }
    }

    /// Converts a block point to mesh coordinates.
    pub(super) fn mesh_from_block(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.rotation.map(|row| dot(row, point));
        let [a, b, c] = self.shift_mm;
        [x + a, y + b, z + c].map(|coordinate| coordinate * self.unit_per_mm)
    }

    /// Returns the plane of the stroke tops.
    pub(super) fn tops_plane(&self) -> TopsPlane {
        let n = self.block_axis(2);
        TopsPlane {
            n,
            d: -dot(n, self.shift_mm) * self.unit_per_mm,
        }
    }

    /// Returns the true map from the mesh to the print. `print_from_uv` maps positions (u, v) in mm to print pixels.
    pub(super) fn print_from_mesh(&self, print_from_uv: &Affine2) -> PrintFromMesh {
        let block_axes = [0, 1, 2].map(|i| self.block_axis(i));
        let row = |weights: [f64; 3], constant: f64| {
            let mut out = [0.0, 0.0, 0.0, constant];
            for (axis, weight) in block_axes.into_iter().zip(weights) {
                for (value, component) in out.iter_mut().zip(axis) {
                    *value += weight * component / self.unit_per_mm;
                }
                out[3] -= weight * dot(axis, self.shift_mm);
            }
            out
        };
        let [a, b] = print_from_uv.0;
        let plane = self.tops_plane();
        PrintFromMesh([
            row([-a[0], -a[1], 0.0], a[2]),
            row([-b[0], -b[1], 0.0], b[2]),
            [plane.n[0], plane.n[1], plane.n[2], plane.d],
        ])
    }

    /// Returns whether the carved side faces -z in the mesh frame.
    pub(super) fn is_face_down(&self) -> bool {
        self.block_axis(2)[2] < 0.0
    }

    /// Returns a block axis in the mesh frame.
    fn block_axis(&self, index: usize) -> [f64; 3] {
        self.rotation.map(|row| row[index])
    }
}

fn draw_unit(tier: Tier, rng: &mut ChaCha8Rng) -> (Option<LengthUnit>, f64) {
    if !tier.is_any_pose() {
        return (Some(LengthUnit::Mm), 1.0);
    }
    match rng.random_range(0..10_u32) {
        0..=4 => (Some(LengthUnit::Mm), 1.0),
        5 => (Some(LengthUnit::Cm), 1.0 / LengthUnit::Cm.mm()),
        6 => (Some(LengthUnit::M), 1.0 / LengthUnit::M.mm()),
        7 => (Some(LengthUnit::In), 1.0 / LengthUnit::In.mm()),
        _ => (None, 10_f64.powf(rng.random_range(-1.5..1.5))),
    }
}

/// Draws a uniformly distributed rotation: a quaternion of four normal draws, divided by its length (Muller 1959).
pub(super) fn any_rotation(rng: &mut ChaCha8Rng) -> [[f64; 3]; 3] {
    let raw = [0; 4].map(|_: i32| normal(rng));
    let length = raw.iter().map(|c| c * c).sum::<f64>().sqrt();
    let [w, x, y, z] = raw.map(|c| c / length);
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// Draws an in-plane rotation of up to 11 degrees, followed by a tilt of up to 10 degrees. The print is rotated by up
/// to 4 degrees, so mesh and print differ by at most 15 degrees in the plane.
fn upright_rotation(rng: &mut ChaCha8Rng) -> [[f64; 3]; 3] {
    let in_plane = rotation_about(
        [0.0, 0.0, 1.0],
        rng.random_range(-11.0..11.0_f64).to_radians(),
    );
    let direction = rng.random_range(0.0..std::f64::consts::TAU);
    let tilt = rng.random_range(0.0..10.0_f64).to_radians();
    multiply(
        rotation_about([direction.cos(), direction.sin(), 0.0], tilt),
        in_plane,
    )
}

/// Returns the rotation about a unit axis (Rodrigues' formula).
fn rotation_about([x, y, z]: [f64; 3], angle_rad: f64) -> [[f64; 3]; 3] {
    let (s, c) = angle_rad.sin_cos();
    let k = 1.0 - c;
    [
        [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
        [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
        [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
    ]
}

fn multiply(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| [0, 1, 2].map(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::ScanPose;
    use crate::tier::Tier;
    use mocban_core::domain::Affine2;

    #[test]
    fn print_from_mesh_inverts_the_pose() {
        let print_from_uv = Affine2::similarity(12.0, 0.05, [70.0, 66.0]);
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let pose = ScanPose::draw(Tier::Pose, &mut rng);
            let product = pose.print_from_mesh(&print_from_uv);
            let [px, py, height] = product.apply(pose.mesh_from_block([-1.5, -2.5, 0.25]));
            let [ex, ey] = print_from_uv.apply([1.5, 2.5]);
            assert!((px - ex).abs() < 1e-6 && (py - ey).abs() < 1e-6);
            assert!((height / pose.unit_per_mm - 0.25).abs() < 1e-9);
        }
    }

    #[test]
    fn upright_scans_face_up_within_ten_degrees() {
        for seed in 0..50 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let pose = ScanPose::draw(Tier::Upright, &mut rng);
            assert!(pose.block_axis(2)[2] >= 10_f64.to_radians().cos() - 1e-12);
            assert!(!pose.is_face_down());
        }
    }
}
