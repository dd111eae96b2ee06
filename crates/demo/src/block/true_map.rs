//! The true map between the face frame and the pixels of a page image.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::kind::BlockRanges;
use crate::draw::{number_within, within};
use crate::paper_geometry::unwarped;
use crate::polygon::BoundsMm;
use mocban_core::domain::Affine2;

/// Wavelengths of the warp, mm.
const WAVELENGTH_MM: [f64; 2] = [80.0, 320.0];
/// Fractions of the warp's amplitude that its waves have.
const WAVE_SHARES: [f64; 3] = [0.5, 0.3, 0.2];
/// Largest number of steps of the iteration that inverts the warp. It converges by a factor of ten per step.
const INVERSION_STEPS: usize = 20;
/// Distance from the middle for which the change of scale by perspective is given, mm.
const PERSPECTIVE_MM: f64 = 150.0;

/// One plane wave of the warp.
#[derive(Debug, Clone, Copy)]
struct SheetWave {
    /// Phase per mm along u and v, rad.
    per_mm: [f64; 2],
    phase: f64,
    amplitude_mm: f64,
}

/// A smooth warp, then shrinkage, shear and rotation, then perspective, then quarter turns and the resolution.
#[derive(Debug, Clone)]
pub(super) struct TruePageMap {
    waves: [[SheetWave; 3]; 2],
    linear: Affine2,
    /// Inverse of `linear`.
    unlinear: Affine2,
    /// Change of the scale per mm along both axes of the image plane.
    horizon: [f64; 2],
    /// Quarter turns, clockwise.
    pub turns: u32,
    pub px_per_mm: f64,
    shift_px: [f64; 2],
}

impl TruePageMap {
    /// Draws the map of an image that shows at least a box of the face frame. Returns it with the image's width and
    /// height in pixels.
    pub(super) fn draw(
        ranges: &BlockRanges,
        view: BoundsMm,
        rng: &mut ChaCha8Rng,
    ) -> (Self, [usize; 2]) {
        let warp_mm = within(ranges.warp_mm, rng);
        let waves =
            [0; 2].map(|_: i32| WAVE_SHARES.map(|share| SheetWave::draw(share * warp_mm, rng)));
        let shrink = [0; 2].map(|_: i32| 1.0 - within(ranges.shrink, rng));
        let shear = rng.random_range(-1.0..1.0) * ranges.shear;
        let angle = (rng.random_range(-1.0..1.0) * ranges.rotation_deg).to_radians();
        let scaled = Affine2([[shrink[0], shear, 0.0], [0.0, shrink[1], 0.0]]);
        let linear = Affine2::similarity(1.0, angle, [0.0; 2]).after(&scaled);
        let perspective = within(ranges.perspective, rng) / PERSPECTIVE_MM;
        let direction = rng.random_range(0.0..std::f64::consts::TAU);
        let mut map = Self {
            waves,
            linear,
            unlinear: linear.inverse().expect("the sheet has an area"),
            horizon: [perspective * direction.cos(), perspective * direction.sin()],
            turns: number_within(ranges.turns, rng),
            px_per_mm: within(ranges.px_per_mm, rng),
            shift_px: [0.0; 2],
        };
        let size = map.fit(view);
        (map, size)
    }

    /// Moves the image so that it shows a box of the face frame. Returns its width and height in pixels.
    fn fit(&mut self, view: BoundsMm) -> [usize; 2] {
        const STEPS: usize = 32;
        let edges = (0..=STEPS).flat_map(|step| {
            let t = step as f64 / STEPS as f64;
            let [u, v] = [0, 1].map(|i| view.min[i] + (view.max[i] - view.min[i]) * t);
            [
                [u, view.min[1]],
                [u, view.max[1]],
                [view.min[0], v],
                [view.max[0], v],
            ]
        });
        let pixels = BoundsMm::around(edges.map(|point| self.page_from_face(point)));
        self.shift_px = [0, 1].map(|i| self.shift_px[i] - pixels.min[i]);
        pixels.size().map(|length| length.ceil() as usize + 1)
    }

    /// Converts a point of the face frame to pixels. (0, 0) is the middle of the first pixel.
    pub(super) fn page_from_face(&self, uv: [f64; 2]) -> [f64; 2] {
        let shift = self.warp_at(uv);
        let flat = self.linear.apply([uv[0] + shift[0], uv[1] + shift[1]]);
        let depth = 1.0 + self.horizon[0] * flat[0] + self.horizon[1] * flat[1];
        let turned = turn(flat.map(|c| c / depth), self.turns);
        [0, 1].map(|i| self.px_per_mm * turned[i] + self.shift_px[i])
    }

    /// Converts pixels to a point of the face frame, mm.
    pub(super) fn face_from_page(&self, pixel: [f64; 2]) -> [f64; 2] {
        let turned = [0, 1].map(|i| (pixel[i] - self.shift_px[i]) / self.px_per_mm);
        let seen = turn(turned, 4 - self.turns % 4);
        let depth = 1.0 - self.horizon[0] * seen[0] - self.horizon[1] * seen[1];
        let warped = self.unlinear.apply(seen.map(|c| c / depth));
        unwarped(warped, INVERSION_STEPS, 1e-9, |uv| self.warp_at(uv))
    }

    /// Returns the displacement by the warp, mm.
    fn warp_at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.waves.map(|waves| {
            let parts = waves.map(|wave| {
                wave.amplitude_mm * (wave.per_mm[0] * u + wave.per_mm[1] * v + wave.phase).sin()
            });
            parts.iter().sum()
        })
    }
}

impl SheetWave {
    fn draw(amplitude_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        let direction = rng.random_range(0.0..std::f64::consts::TAU);
        let per_mm = std::f64::consts::TAU / within(WAVELENGTH_MM, rng);
        Self {
            per_mm: [per_mm * direction.cos(), per_mm * direction.sin()],
            phase: rng.random_range(0.0..std::f64::consts::TAU),
            amplitude_mm,
        }
    }
}

/// Turns a point clockwise about the origin by quarter turns.
const fn turn([x, y]: [f64; 2], turns: u32) -> [f64; 2] {
    match turns % 4 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

#[cfg(test)]
mod tests {
    use super::TruePageMap;
    use crate::block::kind::BlockKind;
    use crate::block::seeding::part_rng;
    use crate::polygon::BoundsMm;

    const VIEW: BoundsMm = BoundsMm {
        min: [-150.0, -110.0],
        max: [150.0, 110.0],
    };

    #[test]
    fn inverse_leads_back_and_the_image_contains_the_view() {
        for (seed, kind) in (0..30).zip(BlockKind::ALL.into_iter().cycle()) {
            let (map, size) = TruePageMap::draw(kind.ranges(), VIEW, &mut part_rng(seed, 0));
            for point in [[0.0, 0.0], [-149.0, 109.0], [149.0, -109.0], [-20.0, 75.0]] {
                let pixel = map.page_from_face(point);
                let back = map.face_from_page(pixel);
                assert!((back[0] - point[0]).hypot(back[1] - point[1]) < 1e-6);
                assert!(pixel[0] >= 0.0 && pixel[0] < size[0] as f64);
                assert!(pixel[1] >= 0.0 && pixel[1] < size[1] as f64);
            }
        }
    }

    #[test]
    fn a_turned_page_is_not_mirrored() {
        for seed in 0..8 {
            let ranges = BlockKind::QuarterTurn.ranges();
            let (map, _) = TruePageMap::draw(ranges, VIEW, &mut part_rng(seed, 0));
            let [origin, right, down] =
                [[0.0, 0.0], [50.0, 0.0], [0.0, 50.0]].map(|point| map.page_from_face(point));
            let [a, b] = [right, down].map(|end| [end[0] - origin[0], end[1] - origin[1]]);
            assert!(a[0] * b[1] - a[1] * b[0] > 0.0);
            assert!((1..=3).contains(&map.turns));
            let is_sideways = a[1].abs() > a[0].abs();
            assert_eq!(is_sideways, map.turns % 2 == 1, "seed {seed}");
        }
    }
}
