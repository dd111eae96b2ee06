//! Wear of the stroke tops and dirt in the valleys, between carving and scanning.

use rand_chacha::ChaCha8Rng;

use super::draw::within;
use super::kind::DemoKind;
use super::noise::{Noise, smoothstep};
use super::scalar_field::ScalarField;

/// Largest fraction of the carved depth that wear removes from the tops.
const MAX_WORN_SHARE: f64 = 0.45;
/// Smallest fraction of the carved depth that dirt leaves free below the lowest tops.
const MIN_FREE_SHARE: f64 = 0.2;

/// Wear and dirt of one block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weathering {
    abrasion_mm: f64,
    patches: Noise,
    rounding_mm: f64,
    rim_mm: f64,
    fill: f64,
    dirt: Noise,
    grain: Noise,
}

impl Weathering {
    /// Draws the wear and dirt of a kind. Returns `None` if the kind has none.
    pub(super) fn draw(kind: &DemoKind, rng: &mut ChaCha8Rng) -> Option<Self> {
        let most = [kind.abrasion_mm[1], kind.rounding_mm[1], kind.fill[1]];
        most.iter().any(|value| *value > 0.0).then(|| Self {
            abrasion_mm: within(kind.abrasion_mm, rng),
            patches: Noise::draw(rng),
            rounding_mm: within(kind.rounding_mm, rng),
            rim_mm: within([0.15, 0.4], rng),
            fill: within(kind.fill, rng),
            dirt: Noise::draw(rng),
            grain: Noise::draw(rng),
        })
    }

    /// Returns the surface after wear and dirt. `surface` has heights in mm over the unworn tops. `strokes` is the
    /// signed distance to all strokes in mm, positive inside, and `depth_mm` the carved depth.
    pub(super) fn applied(
        &self,
        surface: &ScalarField,
        strokes: &ScalarField,
        depth_mm: f64,
    ) -> ScalarField {
        let most_worn_mm = (self.abrasion_mm + self.rounding_mm).min(MAX_WORN_SHARE * depth_mm);
        let highest_dirt_mm = -most_worn_mm - MIN_FREE_SHARE * depth_mm;
        ScalarField::from_fn(surface.frame, |point, x, y| {
            let height = surface.at(x, y);
            let worn_mm = self.worn_mm(point, strokes.at(x, y), depth_mm);
            // Removes `worn_mm` at the level of the tops, less from the walls, and nothing below twice this depth.
            let worn =
                height - worn_mm * (1.0 + height / (2.0 * worn_mm).max(1e-9)).clamp(0.0, 1.0);
            if self.fill <= 0.0 {
                return worn;
            }
            worn.max(self.dirt_height_mm(point, depth_mm).min(highest_dirt_mm))
        })
    }

    /// Returns the height that wear removes from a stroke top `inside_mm` from the edge.
    fn worn_mm(&self, [u, v]: [f64; 2], inside_mm: f64, depth_mm: f64) -> f64 {
        let patch = 0.5 + 0.5 * self.patches.at(u / 3.0, v / 3.0);
        let rim = 1.0 - smoothstep(0.0, self.rim_mm, inside_mm);
        let worn = self.abrasion_mm * patch + self.rounding_mm * rim;
        worn.min(MAX_WORN_SHARE * depth_mm)
    }

    /// Returns the height of the dirt's surface over the unworn tops, mm.
    fn dirt_height_mm(&self, [u, v]: [f64; 2], depth_mm: f64) -> f64 {
        let share = self.fill * (0.8 + 0.4 * self.dirt.two_octaves(u / 1.8, v / 1.8) / 1.5);
        -depth_mm * (1.0 - share) + 0.02 * self.grain.two_octaves(u / 0.2, v / 0.2)
    }
}
