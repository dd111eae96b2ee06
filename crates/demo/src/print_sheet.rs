//! The sheet that is printed on: colour, texture and stains.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::{Noise, lerp, smoothstep};

/// A sheet of old paper.
pub(super) struct PrintSheet {
    colour: [f64; 3],
    slope: [f64; 2],
    clouds: Noise,
    fibres: Noise,
    grain: Noise,
    stains: Vec<Stain>,
}

/// A brown stain with a ragged edge.
struct Stain {
    centre: [f64; 2],
    radius_mm: f64,
    min_transmittance: f64,
    edge_noise: Noise,
}

impl PrintSheet {
    /// Draws a yellowish, bluish or greyish sheet. Its stains lie within `half_mm` of the centre.
    pub(super) fn draw(stains: u32, half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        let base = match rng.random_range(0..10_u32) {
            0..=5 => [228.0, 210.0, 172.0],
            6..=7 => [196.0, 208.0, 216.0],
            _ => [222.0, 220.0, 212.0],
        };
        let light = rng.random_range(-18.0..14.0);
        Self {
            colour: base.map(|c: f64| c + light + rng.random_range(-6.0..6.0)),
            slope: [0; 2].map(|_: i32| rng.random_range(-1.6..1.6)),
            clouds: Noise::draw(rng),
            fibres: Noise::draw(rng),
            grain: Noise::draw(rng),
            stains: (0..stains).map(|_| Stain::draw(half_mm, rng)).collect(),
        }
    }

    /// Returns the colour at a point, 0..=255 per channel.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let shade = self.slope[0] * u
            + self.slope[1] * v
            + 5.0 * self.clouds.two_octaves(u / 3.0, v / 3.0)
            + 5.0 * self.fibres.at(u / 0.9, v / 0.09)
            + 4.0 * self.grain.at(u / 0.1, v / 0.1);
        let stained: f64 = self
            .stains
            .iter()
            .map(|stain| stain.transmittance([u, v]))
            .product();
        // Stains are brown: they absorb blue most.
        let hues = [1.0, 0.94, 0.82].map(|hue| lerp(hue, 1.0, smoothstep(0.6, 1.0, stained)));
        [0, 1, 2].map(|i| (self.colour[i] + shade) * hues[i] * stained)
    }
}

impl Stain {
    fn draw(half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            centre: [0; 2].map(|_: i32| rng.random_range(-half_mm..half_mm)),
            radius_mm: rng.random_range(1.0..3.5),
            min_transmittance: rng.random_range(0.68..0.88),
            edge_noise: Noise::draw(rng),
        }
    }

    /// Returns the fraction of reflected light, 0..=1.
    fn transmittance(&self, [u, v]: [f64; 2]) -> f64 {
        let distance = (u - self.centre[0]).hypot(v - self.centre[1]);
        let rim = self.radius_mm + 0.6 * self.edge_noise.two_octaves(u / 1.1, v / 1.1);
        lerp(
            self.min_transmittance,
            1.0,
            smoothstep(rim - 0.5, rim, distance),
        )
    }
}
