//! The pairs of a tier and seed, each made in memory when it is asked for.

use image::ImageError;

use super::calligraphy;
use super::glyph::Glyphs;
use super::pair::{Pair, drawn_pair};
use super::tier::Tier;

/// The pairs of a tier and seed. A pair is a function of both and its index, not of how many there are.
pub struct Pairs {
    glyphs: Glyphs,
    tier: Tier,
    seed: u64,
    vertices: Option<u32>,
}

impl Pairs {
    /// The pairs of a tier and seed.
    pub fn new(tier: Tier, seed: u64) -> Self {
        Self {
            glyphs: Glyphs::embedded(),
            tier,
            seed,
            vertices: None,
        }
    }

    /// The same pairs with scans of about so many vertices, where `None` leaves the number to chance.
    #[must_use]
    pub fn with_vertices(self, vertices: Option<u32>) -> Self {
        Self { vertices, ..self }
    }

    /// Their tier.
    pub const fn tier(&self) -> Tier {
        self.tier
    }

    /// Their seed.
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// About how many vertices a scan has, if that is not left to chance.
    pub(super) const fn vertices(&self) -> Option<u32> {
        self.vertices
    }

    /// Makes a pair; those of the real tier repeat after its last.
    ///
    /// # Errors
    /// When a picture cannot be encoded or, from the program itself, decoded.
    pub fn pair(&self, index: u64) -> Result<Pair, ImageError> {
        match self.tier {
            Tier::Real => calligraphy::pair(self.seed, index, self.vertices),
            Tier::Upright | Tier::Pose | Tier::Hard => {
                drawn_pair(&self.glyphs, self.tier, self.seed, index, self.vertices)
            }
        }
    }
}
