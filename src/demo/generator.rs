//! Makes the pairs of a tier and seed in memory.

use image::ImageError;

use super::calligraphy;
use super::glyph::Glyphs;
use super::pair::{DemoPair, drawn_pair};
use super::tier::Tier;

/// Generator of the pairs of a tier and seed. A pair depends on tier, seed and index only, not on the number of pairs.
pub struct PairGenerator {
    glyphs: Glyphs,
    tier: Tier,
    seed: u64,
    vertices: Option<u32>,
}

impl PairGenerator {
    /// Creates the generator of a tier and seed.
    pub fn new(tier: Tier, seed: u64) -> Self {
        Self {
            glyphs: Glyphs::embedded(),
            tier,
            seed,
            vertices: None,
        }
    }

    /// Sets the approximate number of vertices per scan; `None` draws it at random.
    #[must_use]
    pub fn with_vertices(self, vertices: Option<u32>) -> Self {
        Self { vertices, ..self }
    }

    /// Returns the tier.
    pub const fn tier(&self) -> Tier {
        self.tier
    }

    /// Makes a pair. Indices of the `real` tier wrap around after its last pair.
    ///
    /// # Errors
    /// Fails when an image cannot be encoded, or an embedded one not decoded.
    pub fn pair(&self, index: u64) -> Result<DemoPair, ImageError> {
        match self.tier {
            Tier::Real => calligraphy::pair(self.seed, index, self.vertices),
            Tier::Upright | Tier::Pose | Tier::Hard => {
                drawn_pair(&self.glyphs, self.tier, self.seed, index, self.vertices)
            }
        }
    }
}
