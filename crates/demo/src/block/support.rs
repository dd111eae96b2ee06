//! What holds a block in its scan: a turntable below it, or a holder with jaws at two sides.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::kind::BlockSupport;
use crate::debris::ring_quads;

/// Distance of the vertices of a support, mm.
const STEP_MM: f64 = 2.5;

/// Surfaces beside and below a block, in the block frame, mm.
#[derive(Debug, Clone, Default)]
pub(super) struct SupportMesh {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl SupportMesh {
    /// Draws the support of a block with the given half sizes and thickness, mm.
    pub(super) fn draw(
        support: BlockSupport,
        half_mm: [f64; 2],
        thickness_mm: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut mesh = Self::default();
        match support {
            BlockSupport::Nothing => {}
            BlockSupport::Turntable => mesh.add_turntable(half_mm, thickness_mm, rng),
            BlockSupport::Holder => mesh.add_holder(half_mm, thickness_mm, rng),
        }
        mesh
    }

    /// Adds a disc around the block and its rim. The block hides the middle of the disc.
    fn add_turntable(&mut self, half_mm: [f64; 2], thickness_mm: f64, rng: &mut ChaCha8Rng) {
        let radius = half_mm[0].hypot(half_mm[1]) + rng.random_range(10.0..70.0);
        let centre = [0; 2].map(|_: i32| rng.random_range(-8.0..8.0_f64));
        let z = -thickness_mm - 0.3;
        let rings = (radius / STEP_MM) as usize;
        let spokes = (std::f64::consts::TAU * radius / STEP_MM) as usize;
        let first = self.vertices.len() as u32;
        for ring in 0..=rings + 2 {
            let along = (ring.min(rings) as f64 / rings as f64).max(1e-3) * radius;
            let down = ring.saturating_sub(rings) as f64 * 3.0;
            for spoke in 0..spokes {
                let (sin, cos) = (std::f64::consts::TAU * spoke as f64 / spokes as f64).sin_cos();
                self.vertices
                    .push([centre[0] + along * cos, centre[1] + along * sin, z - down]);
            }
        }
        let is_hidden = |corner: &u32| {
            let [x, y, _] = self.vertices[*corner as usize];
            x.abs() < half_mm[0] - 3.0 && y.abs() < half_mm[1] - 3.0
        };
        let quads = ring_quads(first, rings as u32 + 2, spokes as u32);
        for [a, b, c, d] in quads.filter(|quad| !quad.iter().all(is_hidden)) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    /// Adds a plate below the block and a jaw at each short side, which is higher than the face.
    fn add_holder(&mut self, half_mm: [f64; 2], thickness_mm: f64, rng: &mut ChaCha8Rng) {
        let top = rng.random_range(5.0..22.0);
        let jaw = rng.random_range(10.0..25.0);
        let share = rng.random_range(0.25..0.8);
        let plate_z = -thickness_mm - rng.random_range(1.0..6.0);
        let depth = share * half_mm[1];
        let middle = rng.random_range(-0.2..0.2) * half_mm[1];
        for side in [-1.0, 1.0] {
            let inner = side * (half_mm[0] + 0.8);
            let outer = side * (half_mm[0] + 0.8 + jaw);
            self.add_box(
                [inner.min(outer), middle - depth, plate_z - 1.0],
                [inner.max(outer), middle + depth, top],
            );
        }
        let over = rng.random_range(8.0..40.0);
        self.add_box(
            [-half_mm[0] - jaw - 5.0, -half_mm[1] - over, plate_z - 10.0],
            [half_mm[0] + jaw + 5.0, half_mm[1] + over, plate_z],
        );
    }

    /// Adds the six sides of a box.
    fn add_box(&mut self, min: [f64; 3], max: [f64; 3]) {
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            for (level, is_max) in [(min[axis], false), (max[axis], true)] {
                let steps = [a, b].map(|i| ((max[i] - min[i]) / STEP_MM).ceil().max(1.0) as usize);
                let first = self.vertices.len() as u32;
                for row in 0..=steps[1] {
                    for column in 0..=steps[0] {
                        let mut point = [level; 3];
                        point[a] = min[a] + (max[a] - min[a]) * column as f64 / steps[0] as f64;
                        point[b] = min[b] + (max[b] - min[b]) * row as f64 / steps[1] as f64;
                        self.vertices.push(point);
                    }
                }
                let width = steps[0] as u32 + 1;
                for row in 0..steps[1] as u32 {
                    for column in 0..steps[0] as u32 {
                        let at = first + row * width + column;
                        let quad = [at, at + 1, at + width + 1, at + width];
                        self.add_quad(quad, is_max);
                    }
                }
            }
        }
    }

    /// Adds two triangles. The corners run counterclockwise as seen from outside if `is_outward` is set.
    fn add_quad(&mut self, [a, b, c, d]: [u32; 4], is_outward: bool) {
        if is_outward {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            self.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
}
