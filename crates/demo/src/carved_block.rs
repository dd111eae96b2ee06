//! The carved block at the time of the scan.

use rand_chacha::ChaCha8Rng;

use super::carving::carve;
use super::scalar_field::ScalarField;
use super::scene::Scene;
use super::truth_line::TruthSource;

/// The block at the time of the scan.
pub(super) struct CarvedBlock {
    /// Signed distance to the strokes left on the block, mm.
    remaining: ScalarField,
    /// Heights of the surface, mm.
    surface: ScalarField,
    /// The surface as smoothed by the scanner, if it smooths.
    smoothed: Option<ScalarField>,
}

impl CarvedBlock {
    /// Carves the damaged block.
    pub(super) fn draw(scene: &Scene, rng: &mut ChaCha8Rng) -> Self {
        let remaining = scene.damage.remaining(&scene.artwork.strokes);
        let surface = carve(scene, &remaining, rng);
        let sigma_mm = scene.conditions.scan.smoothing_mm;
        Self {
            smoothed: (sigma_mm > 0.0).then(|| surface.blurred(sigma_mm)),
            remaining,
            surface,
        }
    }

    /// Returns the heights that the scanner sees, mm.
    pub(super) fn scanned(&self) -> &ScalarField {
        self.smoothed.as_ref().unwrap_or(&self.surface)
    }

    /// Returns what the ground truth is computed from.
    pub(super) fn truth<'a>(&'a self, scene: &'a Scene) -> TruthSource<'a> {
        TruthSource {
            scene,
            remaining: &self.remaining,
            surface: self.scanned(),
        }
    }
}
