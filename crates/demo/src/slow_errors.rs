//! Height errors of a scan that change slowly with place: drift, and a step between two stitched views.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draw::within;
use super::ellipse::Axis;
use super::kind::DemoKind;
use super::noise::{Noise, smoothstep};

/// Range of the size of drift features, mm. A character has 8 to 10 mm.
const DRIFT_SIZE_MM: [f64; 2] = [3.5, 10.0];
/// Largest angle between two stitched views, as a slope.
const MAX_TILT: f64 = 0.025;
/// Range of the width over which the height changes between two stitched views, mm.
const SEAM_MM: [f64; 2] = [0.05, 0.4];
/// Largest distance of the seam from the middle of the character, mm.
const SEAM_OFFSET_MM: f64 = 2.5;

/// Slow height errors of one scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlowErrors {
    drift_mm: f64,
    drift: Noise,
    size_mm: f64,
    seam: Axis,
    offset_mm: f64,
    width_mm: f64,
    step_mm: f64,
    tilt: f64,
}

impl SlowErrors {
    /// Draws the errors of a kind. Returns `None` and draws no random numbers if the kind has none.
    pub(super) fn draw(kind: &DemoKind, rng: &mut ChaCha8Rng) -> Option<Self> {
        let has_step = kind.step_mm[1] > 0.0;
        if !has_step && kind.drift_mm[1] <= 0.0 {
            return None;
        }
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        Some(Self {
            drift_mm: within(kind.drift_mm, rng),
            drift: Noise::draw(rng),
            size_mm: within(DRIFT_SIZE_MM, rng),
            seam: Axis::draw_any(rng),
            offset_mm: within([-SEAM_OFFSET_MM, SEAM_OFFSET_MM], rng),
            width_mm: within(SEAM_MM, rng),
            step_mm: sign * within(kind.step_mm, rng),
            tilt: if has_step {
                within([-MAX_TILT, MAX_TILT], rng)
            } else {
                0.0
            },
        })
    }

    /// Returns the error at a point in mm.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> f64 {
        let drift = self.drift_mm * self.drift.at(u / self.size_mm, v / self.size_mm);
        let across = self.seam.along_across([u, v])[1] - self.offset_mm;
        let step = self.step_mm * smoothstep(0.0, self.width_mm, across);
        drift + step + self.tilt * across.max(0.0)
    }
}
