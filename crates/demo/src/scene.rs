//! The subject of a pair: a character, its neighbours and the damage of the block.

use std::fmt::Write as _;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::conditions::Conditions;
use super::damage::Damage;
use super::glyph::Glyphs;
use super::kind::Crop;
use super::scalar_field::ScalarField;
use super::tier::Tier;
use mocban_core::domain::ContentHash;

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
    /// Signed distance to neighbours and column rules on the block, mm, positive inside.
    pub block_neighbours: ScalarField,
    /// Signed distance to neighbours and column rules on the print, mm, positive inside.
    pub print_neighbours: ScalarField,
    /// Damage of the block after printing.
    pub damage: Damage,
    /// Conditions of carving, scan, print and crop.
    pub conditions: Conditions,
}

/// Creates the random number generator for one attempt to draw a pair. It depends only on seed, tier, index and
/// `attempt`, which counts from 0.
pub(super) fn pair_rng(seed: u64, tier: Tier, index: u64, attempt: u32) -> ChaCha8Rng {
    let mut name = format!("mocban demo {tier} {seed} {index}");
    if attempt > 0 {
        let _ = write!(name, " {attempt}");
    }
    ChaCha8Rng::from_seed(*ContentHash::of(name.as_bytes()).as_bytes())
}

/// Returns the id of a pair, which is also its file stem.
pub(super) fn pair_id(tier: Tier, index: u64) -> String {
    format!("{tier}-{index:04}")
}

impl Scene {
    /// Draws one of the characters with neighbours, and the conditions and damage of the tier.
    pub(super) fn draw(
        glyphs: &Glyphs,
        characters: &[char],
        tier: Tier,
        index: u64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let id = pair_id(tier, index);
        let conditions = Conditions::draw(tier.kind(), rng);
        Self::draw_with(glyphs, characters, tier, id, conditions, rng)
    }

    /// Draws another scene of the same tier and id: one of all characters under plain conditions.
    pub(super) fn another(&self, glyphs: &Glyphs, rng: &mut ChaCha8Rng) -> Self {
        let (characters, id) = (glyphs.characters(), self.id.clone());
        Self::draw_with(
            glyphs,
            characters,
            self.tier,
            id,
            Conditions::default(),
            rng,
        )
    }

    /// Draws one of the characters with neighbours and the damage of the tier under given conditions.
    fn draw_with(
        glyphs: &Glyphs,
        characters: &[char],
        tier: Tier,
        id: String,
        conditions: Conditions,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let character = characters[rng.random_range(0..characters.len())];
        let crop = conditions.crop;
        let artwork = Artwork::of_glyph(glyphs, character, crop, rng);
        let mut block_neighbours = artwork.draw_neighbours(glyphs, crop, rng);
        if conditions.raised_mm > 0.0 {
            artwork.add_close_rules(&mut block_neighbours, rng);
        }
        let (print_neighbours, damage) = if tier.is_damaged() {
            let other = artwork.draw_neighbours(glyphs, crop, rng);
            (other, Damage::draw(&artwork, rng))
        } else {
            let lost = conditions.lost;
            let damage = lost.map(|share| Damage::draw_with(share, &artwork, rng));
            let on_print = if crop == Crop::WideRim {
                artwork.empty_neighbours()
            } else {
                block_neighbours.clone()
            };
            (on_print, damage.unwrap_or_default())
        };
        Self {
            id,
            tier,
            character,
            artwork,
            block_neighbours,
            print_neighbours,
            damage,
            conditions,
        }
    }
}
