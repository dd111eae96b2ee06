//! Deformation of the sheet and perspective of the camera: the map from the block's plane to the image plane.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draw::within;
use super::ellipse::Axis;
use super::kind::DemoKind;
use super::noise::Noise;

/// Largest number of steps of the iteration that inverts the warp.
const INVERSION_STEPS: usize = 30;
/// Size of the warp's features, mm.
const WARP_SIZE_MM: [f64; 2] = [4.5, 9.0];
/// Distance of the camera from the sheet, mm.
const CAMERA_MM: [f64; 2] = [70.0, 300.0];

/// A smooth warp, then a shrinkage, then a perspective view, then unequal scales. All of them keep the character's centre
/// nearly in place.
#[derive(Debug, Clone, Copy)]
pub(super) struct PaperGeometry {
    warp_mm: f64,
    warp_size_mm: f64,
    warp: [Noise; 2],
    shrink_axis: Axis,
    /// Factors along and across the axis.
    shrink: [f64; 2],
    tilt_axis: Axis,
    tilt_rad: f64,
    camera_mm: f64,
    /// Factors along the axes of the upright character.
    picture: [f64; 2],
}

impl PaperGeometry {
    /// Draws the geometry of a kind. Returns `None` if the kind has flat sheets that are scanned and not photographed.
    pub(super) fn draw(kind: &DemoKind, rng: &mut ChaCha8Rng) -> Option<Self> {
        let most = [
            kind.warp_mm[1],
            kind.shrink[1],
            kind.tilt_deg[1],
            kind.stretch[1],
        ];
        most.iter().any(|value| *value > 0.0).then(|| {
            let shrink = within(kind.shrink, rng);
            Self {
                warp_mm: within(kind.warp_mm, rng),
                warp_size_mm: within(WARP_SIZE_MM, rng),
                warp: [Noise::draw(rng), Noise::draw(rng)],
                shrink_axis: Axis::draw_any(rng),
                shrink: [1.0 - shrink, 1.0 - shrink * rng.random_range(0.0..0.4)],
                tilt_axis: Axis::at(rng.random_range(0.0..std::f64::consts::TAU)),
                tilt_rad: within(kind.tilt_deg, rng).to_radians(),
                camera_mm: within(CAMERA_MM, rng),
                picture: draw_stretch(kind, rng),
            }
        })
    }

    /// Returns where a point of the block's plane appears in the image plane. Both are in mm.
    pub(super) fn image_from_uv(&self, uv: [f64; 2]) -> [f64; 2] {
        let shift = self.warp_at(uv);
        let warped = [uv[0] + shift[0], uv[1] + shift[1]];
        let [along, across] = self.shrink_axis.along_across(warped);
        let shrunk = [along * self.shrink[0], across * self.shrink[1]];
        let [along, across] = self.tilt_axis.along_across(self.shrink_axis.point(shrunk));
        let (sin, cos) = self.tilt_rad.sin_cos();
        let scale = self.camera_mm / (self.camera_mm + along * sin);
        let [x, y] = self.tilt_axis.point([along * cos * scale, across * scale]);
        [x * self.picture[0], y * self.picture[1]]
    }

    /// Returns which point of the block's plane appears at a point of the image plane.
    pub(super) fn uv_from_image(&self, image: [f64; 2]) -> [f64; 2] {
        let image = [0, 1].map(|i| image[i] / self.picture[i]);
        let [along, across] = self.tilt_axis.along_across(image);
        let (sin, cos) = self.tilt_rad.sin_cos();
        let along = along * self.camera_mm / (cos * self.camera_mm - along * sin);
        let across = across * (self.camera_mm + along * sin) / self.camera_mm;
        let shrunk = self.tilt_axis.point([along, across]);
        let [along, across] = self.shrink_axis.along_across(shrunk);
        let unshrunk = [along / self.shrink[0], across / self.shrink[1]];
        let warped = self.shrink_axis.point(unshrunk);
        unwarped(warped, INVERSION_STEPS, 0.0, |uv| self.warp_at(uv))
    }

    fn warp_at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        if self.warp_mm == 0.0 {
            return [0.0; 2];
        }
        let size = self.warp_size_mm;
        self.warp
            .map(|noise| self.warp_mm * noise.at(u / size, v / size))
    }
}

/// Draws unequal scales along the axes of the upright character. Draws no random numbers for a kind with equal scales.
fn draw_stretch(kind: &DemoKind, rng: &mut ChaCha8Rng) -> [f64; 2] {
    if kind.stretch[1] <= 0.0 {
        return [1.0; 2];
    }
    let side = (1.0 + within(kind.stretch, rng)).sqrt();
    if rng.random_bool(0.5) {
        [side, 1.0 / side]
    } else {
        [1.0 / side, side]
    }
}

/// Returns the point that a warp moves to `warped`, by a fixed-point iteration of at most `steps` steps. It ends when a step
/// moves the point by at most `tolerance_mm`. It converges if the warp is much smaller than its wavelength.
pub(super) fn unwarped(
    warped: [f64; 2],
    steps: usize,
    tolerance_mm: f64,
    warp_at: impl Fn([f64; 2]) -> [f64; 2],
) -> [f64; 2] {
    let mut uv = warped;
    for _ in 0..steps {
        let shift = warp_at(uv);
        let next = [warped[0] - shift[0], warped[1] - shift[1]];
        let moved = (next[0] - uv[0]).abs() + (next[1] - uv[1]).abs();
        uv = next;
        if moved <= tolerance_mm {
            break;
        }
    }
    uv
}
