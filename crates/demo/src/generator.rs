//! Makes the pairs of a tier and seed in memory.

use image::ImageError;

use super::calligraphy;
use super::glyph::Glyphs;
use super::pair::{DemoPair, drawn_pair, print_by_another_hand};
use super::tier::Tier;

/// Generates the pairs of a tier from a seed. Each pair depends only on its index and the generator's settings.
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

    /// Sets the approximate number of vertices per scan. If it is `None`, each scan has a random number.
    #[must_use]
    pub fn with_vertices(self, vertices: Option<u32>) -> Self {
        Self { vertices, ..self }
    }

    /// Returns the tier.
    pub const fn tier(&self) -> Tier {
        self.tier
    }

    /// Makes a pair. In the `real` tier, the photographs repeat after 20 pairs.
    pub fn pair(&self, index: u64) -> Result<DemoPair, ImageError> {
        let (kind, index) = self.tier.tier_and_index(index);
        if kind == Tier::Real {
            return calligraphy::pair(&self.glyphs, self.seed, index, self.vertices);
        }
        self.drawn(kind, index, self.glyphs.characters())
    }

    /// Makes a pair of a character, which must be in the font. In the `real` tier, the print is drawn, not a
    /// photograph.
    pub fn pair_of(&self, character: char, index: u64) -> Result<DemoPair, ImageError> {
        let (kind, index) = self.tier.tier_and_index(index);
        self.drawn(kind, index, &[character])
    }

    /// Makes the encoded print of a character, which must be in the font, as another hand writes it: with strokes of
    /// other widths, lengths and places. No pair has this print.
    pub fn print_by_another_hand(
        &self,
        character: char,
        index: u64,
    ) -> Result<Vec<u8>, ImageError> {
        let (kind, index) = self.tier.tier_and_index(index);
        print_by_another_hand(&self.glyphs, character, kind, self.seed, index)
    }

    fn drawn(&self, kind: Tier, index: u64, characters: &[char]) -> Result<DemoPair, ImageError> {
        let glyphs = &self.glyphs;
        drawn_pair(glyphs, characters, kind, self.seed, index, self.vertices)
    }
}
