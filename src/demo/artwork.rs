//! The carver's drawing: a character's strokes with woodcut character, and what stands around it on the block.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::field::{Field, Frame};
use super::glyph::Glyphs;
use super::noise::Noise;
use super::polygon::BoxMm;
use crate::raster::Grid;

/// How far the frame reaches past the character's ink, mm.
const MARGIN_MM: f64 = 2.2;
/// Distance of the frame's samples: finer than the finest scan.
const STEP_MM: f64 = 0.035;
/// Clear wood the carver leaves between the character and its neighbours, mm.
const CLEARANCE_MM: f64 = 0.35;

/// A character's strokes.
#[derive(Debug, Clone)]
pub(super) struct Artwork {
    /// Signed distance to the strokes' rim in mm, positive in the stroke.
    pub strokes: Field,
    /// The box of the strokes.
    pub ink_box: BoxMm,
    /// Longest side of the ink box, mm.
    pub size_mm: f64,
}

impl Artwork {
    /// A character of the font, its thin strokes thickened to woodblock weight.
    pub(super) fn of_glyph(glyphs: &Glyphs, character: char, rng: &mut ChaCha8Rng) -> Self {
        let size_mm = rng.random_range(8.0..10.2);
        let weight_mm = weight(size_mm, rng);
        let frame = Frame::covering(size_mm / 2.0 + MARGIN_MM, STEP_MM);
        let mut coverage = Grid::new(frame.side, frame.side, 0.0);
        let outline_mm = size_mm - 2.0 * weight_mm;
        glyphs.ink(character, frame, [0.0, 0.0], outline_mm, &mut coverage);
        let mut strokes = carved(&Field::distance_to_rim(frame, &coverage), weight_mm, rng);
        chip(&mut strokes, rng);
        Self::new(strokes, size_mm)
    }

    /// A character given by its mask: `ink` is the share of ink at a point in mm.
    pub(super) fn of_mask(size_mm: f64, ink: impl Fn([f64; 2]) -> f64) -> Self {
        let frame = Frame::covering(size_mm / 2.0 + MARGIN_MM, STEP_MM);
        let coverage = Field::from_fn(frame, |point, _, _| ink(point)).values;
        // A photographed mask has stairs of its own pixels; they are no work of the knife.
        let strokes = Field::distance_to_rim(frame, &coverage).blurred(0.06);
        Self::new(strokes, size_mm)
    }

    fn new(strokes: Field, size_mm: f64) -> Self {
        let frame = strokes.frame;
        let ink = strokes.values.map(|distance| *distance > 0.0);
        let found = ink.bounding_box().map_or(
            BoxMm {
                min: [-size_mm / 2.0; 2],
                max: [size_mm / 2.0; 2],
            },
            |found| BoxMm {
                min: frame.position(found.x0, found.y0),
                max: frame.position(found.x1, found.y1),
            },
        );
        Self {
            strokes,
            ink_box: found,
            size_mm,
        }
    }

    /// Strokes of the characters above, below and beside, and column rules, as signed distances. A neighbour or a
    /// rule may be missing.
    pub(super) fn surroundings(&self, glyphs: &Glyphs, rng: &mut ChaCha8Rng) -> Field {
        let frame = self.strokes.frame;
        let mut coverage = Grid::new(frame.side, frame.side, 0.0);
        let pitch = self.size_mm * rng.random_range(1.0..1.08) + 0.2;
        let column = self.size_mm * rng.random_range(1.04..1.18) + 0.4;
        for offset in [[0.0, -pitch], [0.0, pitch], [-column, 0.0], [column, 0.0]] {
            if rng.random_bool(0.75) {
                let characters = glyphs.characters();
                let character = characters[rng.random_range(0..characters.len())];
                let size = self.size_mm * rng.random_range(0.88..1.0);
                let centre = [0, 1].map(|i| offset[i] + rng.random_range(-0.3..0.3));
                glyphs.ink(character, frame, centre, size, &mut coverage);
            }
        }
        let weight_mm = weight(self.size_mm, rng);
        let mut around = carved(&Field::distance_to_rim(frame, &coverage), weight_mm, rng);
        for u in [-column / 2.0, column / 2.0] {
            if rng.random_bool(0.4) {
                add_rule(&mut around, u, rng);
            }
        }
        keep_clear(&mut around, &self.strokes);
        around
    }

    /// Nothing around the character.
    pub(super) fn no_surroundings(&self) -> Field {
        Field::from_fn(self.strokes.frame, |_, _, _| -self.size_mm)
    }
}

/// By how much the outline moves out to each side: strokes gain twice that, 2.6-4.4 % of the character's size.
fn weight(size_mm: f64, rng: &mut ChaCha8Rng) -> f64 {
    size_mm * rng.random_range(0.013..0.022)
}

/// The outline as a knife leaves it: heavier, corners rounded, the line a little unsteady.
fn carved(distance: &Field, weight_mm: f64, rng: &mut ChaCha8Rng) -> Field {
    let (slow, quick) = (Noise::draw(rng), Noise::draw(rng));
    let (sway, nick) = (rng.random_range(0.03..0.07), rng.random_range(0.015..0.035));
    let round = distance.blurred(rng.random_range(0.05..0.09));
    Field::from_fn(distance.frame, |[u, v], x, y| {
        round.at(x, y)
            + weight_mm
            + sway * slow.at(u / 0.9, v / 0.9)
            + nick * quick.at(u / 0.22, v / 0.22)
    })
}

/// Small bites out of the strokes' rims.
fn chip(strokes: &mut Field, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(2..9_u32) {
        let Some([u, v]) = rim_point(strokes, rng) else {
            return;
        };
        bite(strokes, [u, v], rng.random_range(0.08..0.24));
    }
}

/// Takes a disc out of the strokes.
fn bite(strokes: &mut Field, [u, v]: [f64; 2], radius_mm: f64) {
    let frame = strokes.frame;
    let reach = radius_mm + 0.3;
    for (x, y) in frame.box_around([u, v], reach) {
        let [pu, pv] = frame.position(x, y);
        let outside = (pu - u).hypot(pv - v) - radius_mm;
        let value = strokes.at(x, y).min(outside);
        strokes.values.set(x, y, value as f32);
    }
}

/// A random point next to the rim, if one is found.
fn rim_point(strokes: &Field, rng: &mut ChaCha8Rng) -> Option<[f64; 2]> {
    let side = strokes.frame.side;
    (0..4000).find_map(|_| {
        let (x, y) = (rng.random_range(0..side), rng.random_range(0..side));
        (strokes.at(x, y).abs() < 0.05).then(|| strokes.frame.position(x, y))
    })
}

/// A vertical rule between two columns.
fn add_rule(around: &mut Field, at_mm: f64, rng: &mut ChaCha8Rng) {
    let noise = Noise::draw(rng);
    let half_width = rng.random_range(0.10..0.2);
    let lean = rng.random_range(-0.02..0.02);
    let frame = around.frame;
    for y in 0..frame.side {
        for x in 0..frame.side {
            let [u, v] = frame.position(x, y);
            let middle = at_mm + lean * v + 0.08 * noise.at(v / 1.5, 0.0);
            let inside = half_width + 0.04 * noise.at(v / 0.4, 7.0) - (u - middle).abs();
            let value = around.at(x, y).max(inside);
            around.values.set(x, y, value as f32);
        }
    }
}

/// Cuts back what would touch the character.
fn keep_clear(around: &mut Field, strokes: &Field) {
    let pairs = around.values.data_mut().iter_mut();
    for (value, stroke) in pairs.zip(strokes.values.data()) {
        *value = value.min(-stroke - CLEARANCE_MM as f32);
    }
}

/// Half the longest side of the strokes' box, mm.
pub(super) fn reach_mm(strokes: &Field) -> f64 {
    let ink = strokes.values.map(|distance| *distance > 0.0);
    let longest = ink.bounding_box().map_or(strokes.frame.side, |found| {
        found.width().max(found.height())
    });
    longest as f64 * strokes.frame.step_mm / 2.0
}
