//! Damage to the block after printing: broken strokes and cracks.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::artwork::Artwork;
use super::ellipse::{Axis, Ellipse};
use super::kind::NumberRange;
use super::noise::Noise;
use super::scalar_field::ScalarField;

/// Minimum and maximum fraction of the stroke area lost on a damaged block.
const LOST_SHARE: NumberRange = [0.05, 0.20];

/// Damage to one block.
#[derive(Debug, Clone, Default)]
pub(super) struct Damage {
    /// Signed distance in mm to the edge of the lost regions, positive inside. `None` if nothing is lost.
    pub lost: Option<ScalarField>,
    /// Cracks through the wood.
    pub cracks: Vec<Crack>,
}

/// A nearly straight crack across the whole sample frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crack {
    normal: Axis,
    offset_mm: f64,
    path_noise: Noise,
    /// Half the width at the top, mm.
    pub half_width_mm: f64,
    /// Depth, mm.
    pub depth_mm: f64,
}

impl Damage {
    /// Draws the damage of a block of the `hard` tier.
    pub(super) fn draw(artwork: &Artwork, rng: &mut ChaCha8Rng) -> Self {
        Self::draw_with(LOST_SHARE, artwork, rng)
    }

    /// Draws the damage of a block that lost a fraction of its stroke area within `share`. The block has up to two
    /// cracks.
    pub(super) fn draw_with(share: NumberRange, artwork: &Artwork, rng: &mut ChaCha8Rng) -> Self {
        let lost = Some(draw_lost_regions(share, artwork, rng));
        let cracks = (0..rng.random_range(0..3_u32))
            .map(|_| Crack::draw(rng))
            .collect();
        Self { lost, cracks }
    }

    /// Returns the signed distance in mm to the strokes left on the block.
    pub(super) fn remaining(&self, strokes: &ScalarField) -> ScalarField {
        ScalarField::from_fn(strokes.frame, |_, x, y| {
            let lost = self
                .lost
                .as_ref()
                .map_or(f64::NEG_INFINITY, |lost| lost.at(x, y));
            strokes.at(x, y).min(-lost)
        })
    }

    /// Returns whether a point lies in a crack or within `margin_mm` of one.
    pub(super) fn is_cracked(&self, point: [f64; 2], margin_mm: f64) -> bool {
        self.cracks
            .iter()
            .any(|crack| crack.distance_mm(point) < crack.half_width_mm + margin_mm)
    }
}

impl Crack {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        Self {
            normal: Axis::draw_any(rng),
            offset_mm: rng.random_range(-4.0..4.0),
            path_noise: Noise::draw(rng),
            half_width_mm: rng.random_range(0.03..0.09),
            depth_mm: rng.random_range(0.3..1.0),
        }
    }

    /// Returns the distance of a point to the centre line of the crack, mm.
    pub(super) fn distance_mm(&self, point: [f64; 2]) -> f64 {
        let [out, across] = self.normal.along_across(point);
        let offset = 0.35 * self.path_noise.two_octaves(-across / 1.7, 0.0);
        (out - self.offset_mm - offset).abs()
    }
}

/// Draws ragged blobs over the strokes until a random fraction of the stroke area is lost.
fn draw_lost_regions(share: NumberRange, artwork: &Artwork, rng: &mut ChaCha8Rng) -> ScalarField {
    let strokes = &artwork.strokes;
    let frame = strokes.frame;
    let ink = frame.samples().filter(|(x, y)| strokes.at(*x, *y) > 0.0);
    let ink: Vec<(usize, usize)> = ink.collect();
    let target = rng.random_range(share[0]..share[1] - 0.04);
    let edge_noise = Noise::draw(rng);
    let mut lost = ScalarField::from_fn(frame, |_, _, _| -9.0);
    for _ in 0..200 {
        if lost_share(&lost, &ink) >= target || ink.is_empty() {
            break;
        }
        let (x, y) = ink[rng.random_range(0..ink.len())];
        let blob = draw_blob(frame.position(x, y), rng);
        let with_blob = ScalarField::from_fn(frame, |[u, v], x, y| {
            let ragged_mm = 0.15 * edge_noise.two_octaves(u / 0.5, v / 0.5);
            lost.at(x, y).max(blob.inside_mm([u, v]) + ragged_mm)
        });
        if lost_share(&with_blob, &ink) <= share[1] {
            lost = with_blob;
        }
    }
    lost
}

fn lost_share(lost: &ScalarField, ink: &[(usize, usize)]) -> f64 {
    let lost_count = ink.iter().filter(|(x, y)| lost.at(*x, *y) > 0.0).count();
    lost_count as f64 / ink.len().max(1) as f64
}

fn draw_blob(centre: [f64; 2], rng: &mut ChaCha8Rng) -> Ellipse {
    let axis = Axis::draw_any(rng);
    let long_mm = rng.random_range(0.5..1.5);
    Ellipse {
        centre,
        axis,
        long_mm,
        short_mm: long_mm * rng.random_range(0.4..0.9),
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::Damage;
    use crate::artwork::Artwork;
    use crate::glyph::Glyphs;
    use crate::kind::Crop;

    #[test]
    fn between_a_twentieth_and_a_fifth_of_the_strokes_is_lost() {
        let glyphs = Glyphs::embedded();
        for seed in 0..4 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let artwork = Artwork::of_glyph(&glyphs, '國', Crop::Character, &mut rng);
            let damage = Damage::draw(&artwork, &mut rng);
            let area = |field: &crate::scalar_field::ScalarField| {
                field.values.data().iter().filter(|d| **d > 0.0).count() as f64
            };
            let left = area(&damage.remaining(&artwork.strokes)) / area(&artwork.strokes);
            assert!((0.80..=0.95).contains(&left), "seed {seed}: {left}");
        }
    }
}
