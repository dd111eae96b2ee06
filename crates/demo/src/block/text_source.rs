//! Draws characters as often as they occur in a text: few are frequent, most are rare.

use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::glyph::Glyphs;

/// Offset of the ranks in the Zipf-Mandelbrot law. With it, the most frequent character makes up about 3 % of a text.
const RANK_OFFSET: f64 = 6.0;

/// The characters of the font with their cumulated frequencies.
#[derive(Debug, Clone)]
pub(super) struct TextSource {
    characters: Vec<char>,
    cumulated: Vec<f64>,
}

impl TextSource {
    /// Draws which characters are frequent.
    pub(super) fn draw(glyphs: &Glyphs, rng: &mut ChaCha8Rng) -> Self {
        let mut characters = glyphs.with_flat_characters();
        characters.shuffle(rng);
        let mut sum = 0.0;
        let cumulated = (0..characters.len())
            .map(|rank| {
                sum += 1.0 / (rank as f64 + RANK_OFFSET);
                sum
            })
            .collect();
        Self {
            characters,
            cumulated,
        }
    }

    /// Draws a character.
    pub(super) fn character(&self, rng: &mut ChaCha8Rng) -> char {
        let total = self.cumulated.last().copied().unwrap_or_default();
        let drawn = total * rng.random::<f64>();
        let rank = self.cumulated.partition_point(|sum| *sum < drawn);
        self.characters[rank.min(self.characters.len() - 1)]
    }
}
