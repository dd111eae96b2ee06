//! A part of a block that slid along a crack through the character after printing, and sank.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draw::within;
use super::ellipse::Axis;
use super::kind::{DemoKind, NumberRange};
use mocban_core::mesh::Mesh;

/// Distance of the crack from the middle of the character, mm. The part beyond the crack is the smaller one.
const OFFSET_MM: NumberRange = [0.4, 2.6];
/// Width of the crack, mm.
const GAP_MM: NumberRange = [0.05, 0.5];
/// Distance by which the part sank, mm.
const SUNK_MM: NumberRange = [0.0, 0.8];

/// The part beyond a straight crack.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlidPart {
    crack: Axis,
    offset_mm: f64,
    along_mm: f64,
    gap_mm: f64,
    sunk_mm: f64,
}

impl SlidPart {
    /// Draws the part of a kind. Returns `None` and draws no random numbers if the kind has none.
    pub(super) fn draw(kind: &DemoKind, rng: &mut ChaCha8Rng) -> Option<Self> {
        if kind.slid_mm[1] <= 0.0 {
            return None;
        }
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let turn = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        Some(Self {
            crack: Axis::at(turn * rng.random_range(0.0..std::f64::consts::PI)),
            offset_mm: within(OFFSET_MM, rng),
            along_mm: sign * within(kind.slid_mm, rng),
            gap_mm: within(GAP_MM, rng),
            sunk_mm: within(SUNK_MM, rng),
        })
    }

    /// Returns whether a point (u, v) of the print, mm, lies on the part before it slid.
    fn contains(&self, point: [f64; 2]) -> bool {
        self.crack.along_across(point)[1] > self.offset_mm
    }

    /// Returns whether a point lies on the part before or after it slid, or within `margin_mm` of it.
    pub(super) fn is_near(&self, point: [f64; 2], margin_mm: f64) -> bool {
        self.crack.along_across(point)[1] > self.offset_mm - margin_mm
    }

    /// Moves the part of a scan in the block frame, mm, and removes the faces across the crack.
    pub(super) fn slide(&self, mesh: &mut Mesh) {
        let is_beyond: Vec<bool> = mesh
            .vertices
            .iter()
            .map(|[x, y, _]| self.contains([-x, -y]))
            .collect();
        let whole = mesh.triangles.iter().copied().filter(|corners| {
            let [a, b, c] = corners.map(|corner| is_beyond[corner as usize]);
            a == b && b == c
        });
        mesh.triangles = whole.collect::<Vec<_>>().into();
        let [du, dv] = self.crack.point([self.along_mm, self.gap_mm]);
        mesh.vertices.map_in_place(|[x, y, z]| {
            if self.contains([-x, -y]) {
                [x - du, y - dv, z - self.sunk_mm]
            } else {
                [x, y, z]
            }
        });
    }
}
