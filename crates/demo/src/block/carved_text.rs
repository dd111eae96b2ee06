//! Carves single characters: strokes of the font with the weight and the irregular edges of a knife.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::face_field::FAR_MM;
use super::text_cell::TextCell;
use crate::artwork::{chip_edges, knife_outline};
use crate::glyph::Glyphs;
use crate::polygon::BoundsMm;
use crate::scalar_field::{SampleFrame, ScalarField};
use mocban_core::raster::Grid;

/// Margin of a character's own samples around its strokes, mm.
const MARGIN_MM: f64 = 1.0;
/// Smallest distance by which an outline is moved outwards, mm. The thinnest strokes of the font vanish without it.
const MIN_WEIGHT_MM: f64 = 0.1;

/// The hand of the carver of one side.
pub(super) struct TextCarver<'a> {
    glyphs: &'a Glyphs,
    /// Distance by which outlines are moved outwards, as a share of the em.
    weight: f64,
}

/// A carved character.
pub(super) struct CarvedCell {
    strokes: ScalarField,
    /// Middle of the strokes' bounding box before rotation, mm.
    centre: [f64; 2],
    /// Sine and cosine of the rotation.
    turn: [f64; 2],
    /// Factor of the width.
    stretch: f64,
    /// Bounding box of the strokes.
    pub bounds: BoundsMm,
    /// Box within which the character may change the field.
    pub reach: BoundsMm,
}

impl<'a> TextCarver<'a> {
    /// Draws the weight of the strokes.
    pub(super) fn draw(glyphs: &'a Glyphs, rng: &mut ChaCha8Rng) -> Self {
        Self {
            glyphs,
            weight: rng.random_range(0.012..0.022),
        }
    }

    /// Carves a character.
    pub(super) fn carve(&self, cell: &TextCell, rng: &mut ChaCha8Rng) -> CarvedCell {
        let extent = self.glyphs.extent(cell.character);
        let (share, middle) = extent.map_or((1.0, [0.0; 2]), |found| (found.longest, found.middle));
        let weight_mm =
            (cell.em_mm * self.weight * rng.random_range(0.88..1.12)).max(MIN_WEIGHT_MM);
        let size_mm = (cell.em_mm * share).max(4.0 * weight_mm);
        let step_mm = (0.006 * size_mm).clamp(0.03, 0.07);
        let frame = SampleFrame::covering(size_mm / 2.0 + MARGIN_MM, step_mm);
        let mut coverage = Grid::new(frame.side, frame.side, 0.0);
        let outline_mm = size_mm - 2.0 * weight_mm;
        let glyphs = self.glyphs;
        glyphs.ink(cell.character, frame, [0.0; 2], outline_mm, &mut coverage);
        let distance = ScalarField::signed_distance(frame, &coverage);
        let mut strokes = knife_outline(&distance, weight_mm, rng);
        chip_edges(&mut strokes, rng);
        let (sin, cos) = cell.angle_rad.sin_cos();
        let mut carved = CarvedCell {
            strokes,
            centre: [0, 1].map(|i| cell.centre[i] + cell.em_mm * middle[i]),
            turn: [sin, cos],
            stretch: rng.random_range(0.95..1.04),
            bounds: BoundsMm {
                min: cell.centre,
                max: cell.centre,
            },
            reach: BoundsMm {
                min: cell.centre,
                max: cell.centre,
            },
        };
        carved.measure();
        carved
    }
}

impl CarvedCell {
    /// Returns the signed distance to the outline at a point of the face, mm, positive inside. Outside the character's
    /// own samples, this is a lower bound.
    pub(super) fn inside_mm(&self, point: [f64; 2]) -> f64 {
        let [du, dv] = [0, 1].map(|i| point[i] - self.centre[i]);
        let [sin, cos] = self.turn;
        let local = [(cos * du + sin * dv) / self.stretch, cos * dv - sin * du];
        let half = self.strokes.frame.half_mm();
        let near = local.map(|c| c.clamp(-half, half));
        let beyond = (local[0] - near[0]).hypot(local[1] - near[1]);
        if beyond > -FAR_MM {
            return FAR_MM;
        }
        self.strokes.value(near) - beyond
    }

    /// Measures the bounding box of the strokes on the face.
    fn measure(&mut self) {
        let frame = self.strokes.frame;
        let [sin, cos] = self.turn;
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for y in 0..frame.side {
            for x in 0..frame.side {
                if self.strokes.at(x, y) > 0.0 {
                    let [u, v] = frame.position(x, y);
                    let u = u * self.stretch;
                    let point = [
                        self.centre[0] + cos * u - sin * v,
                        self.centre[1] + cos * v + sin * u,
                    ];
                    for i in 0..2 {
                        min[i] = min[i].min(point[i]);
                        max[i] = max[i].max(point[i]);
                    }
                }
            }
        }
        if min[0] <= max[0] {
            self.bounds = BoundsMm { min, max };
        }
        let margin = -FAR_MM;
        self.reach = BoundsMm {
            min: self.bounds.min.map(|c| c - margin),
            max: self.bounds.max.map(|c| c + margin),
        };
    }
}
