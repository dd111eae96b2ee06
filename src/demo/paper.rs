//! The paper: colour, texture, stains.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::noise::{Noise, mix, ramp};

/// A sheet of old paper.
pub(super) struct Paper {
    colour: [f64; 3],
    slope: [f64; 2],
    clouds: Noise,
    fibres: Noise,
    grain: Noise,
    stains: Vec<Stain>,
}

/// A brown patch with a ragged rim.
struct Stain {
    centre: [f64; 2],
    radius_mm: f64,
    keep: f64,
    rag: Noise,
}

impl Paper {
    /// Yellowish, bluish or greyish paper, with up to `stains` stains.
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

    /// Colour at a point, 0..=255 a channel.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let shade = self.slope[0] * u
            + self.slope[1] * v
            + 5.0 * self.clouds.rough(u / 3.0, v / 3.0)
            + 5.0 * self.fibres.at(u / 0.9, v / 0.09)
            + 4.0 * self.grain.at(u / 0.1, v / 0.1);
        let stained: f64 = self
            .stains
            .iter()
            .map(|stain| stain.keeps([u, v]))
            .product();
        // Stains take blue first: they are brown.
        [1.0, 0.94, 0.82]
            .map(|hue| mix(hue, 1.0, ramp(0.6, 1.0, stained)))
            .iter()
            .zip(self.colour)
            .map(|(hue, colour)| (colour + shade) * hue * stained)
            .collect::<Vec<_>>()
            .try_into()
            .unwrap_or(self.colour)
    }
}

impl Stain {
    fn draw(half_mm: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            centre: [0; 2].map(|_: i32| rng.random_range(-half_mm..half_mm)),
            radius_mm: rng.random_range(1.0..3.5),
            keep: rng.random_range(0.68..0.88),
            rag: Noise::draw(rng),
        }
    }

    /// Share of the light that is left.
    fn keeps(&self, [u, v]: [f64; 2]) -> f64 {
        let distance = (u - self.centre[0]).hypot(v - self.centre[1]);
        let rim = self.radius_mm + 0.6 * self.rag.rough(u / 1.1, v / 1.1);
        mix(self.keep, 1.0, ramp(rim - 0.5, rim, distance))
    }
}
