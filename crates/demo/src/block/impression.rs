//! Ink on a page: spread, uneven coverage, dry patches and specks.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::noise::{Noise, lerp, smoothstep};

/// Farthest distance from a stroke at which there can be ink, mm.
pub(super) const INK_REACH_MM: f64 = 0.45;

/// One inked impression of a whole block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Impression {
    colour: [f64; 3],
    spread_mm: f64,
    spread: Noise,
    rim: Noise,
    strength: f64,
    pressure: Noise,
    unevenness: f64,
    blotches: Noise,
    dryness: f64,
    dry_patches: Noise,
    bristles: Noise,
    specks: Noise,
    speck_from: f64,
}

impl Impression {
    /// Draws the ink of an impression.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        let grey = rng.random_range(18.0..46.0);
        Self {
            colour: [0; 3].map(|_: i32| grey + rng.random_range(-4.0..4.0)),
            spread_mm: rng.random_range(-0.01..0.09),
            spread: Noise::draw(rng),
            rim: Noise::draw(rng),
            strength: rng.random_range(0.78..0.98),
            pressure: Noise::draw(rng),
            unevenness: rng.random_range(0.0..0.35),
            blotches: Noise::draw(rng),
            dryness: rng.random_range(0.0..0.7),
            dry_patches: Noise::draw(rng),
            bristles: Noise::draw(rng),
            specks: Noise::draw(rng),
            speck_from: rng.random_range(0.86..0.97),
        }
    }

    /// Draws how much thinner than carved the strokes are printed, with little ink or pressure.
    #[must_use]
    pub(super) fn thinned(self, rng: &mut ChaCha8Rng) -> Self {
        Self {
            spread_mm: rng.random_range(-0.16..-0.05),
            ..self
        }
    }

    /// Returns the colour of the ink, 0..=255 per channel.
    pub(super) const fn colour(&self) -> [f64; 3] {
        self.colour
    }

    /// Returns the fraction of a pixel that lies in a printed stroke, 0..=1. `inside_mm` is the signed distance to the
    /// outline of the carved strokes.
    pub(super) fn cover(&self, [u, v]: [f64; 2], inside_mm: f64, px_mm: f64) -> f64 {
        let spread = self.spread_mm
            + 0.025 * self.spread.at(u / 2.5, v / 2.5)
            + 0.022 * self.rim.two_octaves(u / 0.2, v / 0.2);
        (0.5 + (inside_mm + spread) / px_mm).clamp(0.0, 1.0)
    }

    /// Returns the ink density, 0..=1, of a printed stroke.
    pub(super) fn density(&self, [u, v]: [f64; 2]) -> f64 {
        let pressure = smoothstep(-0.9, 0.4, self.pressure.two_octaves(u / 45.0, v / 45.0));
        let dry =
            self.dryness * smoothstep(0.1, 0.9, self.dry_patches.two_octaves(u / 14.0, v / 14.0));
        let bristle = self.bristles.two_octaves(u / 0.3, v / 0.3);
        let edge = lerp(1.4, 0.2, dry);
        let missing = 0.85 * smoothstep(edge, edge + 0.45, bristle);
        let blotch = 1.0 - 0.1 * (1.0 + self.blotches.two_octaves(u / 0.8, v / 0.8)).max(0.0);
        self.strength
            * lerp(1.0 - self.unevenness, 1.0, pressure)
            * (1.0 - missing)
            * blotch.min(1.0)
    }

    /// Returns the density of specks between the strokes, 0..=1.
    pub(super) fn speck(&self, [u, v]: [f64; 2]) -> f64 {
        let value = self.specks.at(u / 0.5, v / 0.5);
        if value < self.speck_from {
            return 0.0;
        }
        0.7 * smoothstep(self.speck_from, 1.0, value)
    }
}
