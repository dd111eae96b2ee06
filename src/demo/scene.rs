//! The subject of a pair: a character, its neighbours and the damage of the block.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::damage::Damage;
use super::glyph::Glyphs;
use super::scalar_field::ScalarField;
use super::tier::Tier;
use crate::domain::ContentHash;

/// What is carved and printed.
pub(super) struct Scene {
    /// Manifest id and file stem.
    pub id: String,
    /// Difficulty.
    pub tier: Tier,
    /// The character.
    pub character: char,
    /// Strokes of the character.
    pub artwork: Artwork,
    /// Signed distance to neighbours and column rules on the block, mm.
    pub block_neighbours: ScalarField,
    /// Signed distance to neighbours and column rules on the print, mm.
    pub print_neighbours: ScalarField,
    /// Damage of the block after printing.
    pub damage: Damage,
}

/// Creates the random generator of one pair from seed, tier and index.
pub(super) fn pair_rng(seed: u64, tier: Tier, index: u64) -> ChaCha8Rng {
    let name = format!("mocban demo {tier} {seed} {index}");
    ChaCha8Rng::from_seed(*ContentHash::of(name.as_bytes()).as_bytes())
}

/// Returns the id of a pair, which is also its file stem.
pub(super) fn pair_id(tier: Tier, index: u64) -> String {
    format!("{tier}-{index:04}")
}

impl Scene {
    /// Draws a character of the font with neighbours and, in the `hard` tier, damage.
    pub(super) fn draw(glyphs: &Glyphs, tier: Tier, index: u64, rng: &mut ChaCha8Rng) -> Self {
        let characters = glyphs.characters();
        let character = characters[rng.random_range(0..characters.len())];
        let artwork = Artwork::of_glyph(glyphs, character, rng);
        let block_neighbours = artwork.draw_neighbours(glyphs, rng);
        let (print_neighbours, damage) = if tier.is_damaged() {
            let other = artwork.draw_neighbours(glyphs, rng);
            (other, Damage::draw(&artwork, rng))
        } else {
            (block_neighbours.clone(), Damage::default())
        };
        Self {
            id: pair_id(tier, index),
            tier,
            character,
            artwork,
            block_neighbours,
            print_neighbours,
            damage,
        }
    }
}
