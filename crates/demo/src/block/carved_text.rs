//! Carves single characters: strokes of the font with the weight and the irregular edges of a knife.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::face_field::FAR_MM;
use super::text_cell::TextCell;
use crate::artwork::carved_strokes;
use crate::glyph::Glyphs;
use crate::polygon::BoundsMm;
use crate::scalar_field::{SampleFrame, ScalarField};

/// Margin of a character's own samples around its strokes, mm.
const MARGIN_MM: f64 = 1.0;
/// Smallest distance by which an outline is moved outwards, mm. The thinnest strokes of the font vanish without it.
const MIN_WEIGHT_MM: f64 = 0.1;

/// The hand of the carver of one side.
pub(super) struct TextCarver<'a> {
    glyphs: &'a Glyphs,
    /// Distance by which outlines are moved outwards, as a fraction of the em.
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
        let sizes_mm = [size_mm, weight_mm];
        let strokes = carved_strokes(self.glyphs, cell.character, frame, sizes_mm, rng);
        let (sin, cos) = cell.angle_rad.sin_cos();
        let mut carved = CarvedCell {
            strokes,
            centre: [
                cell.centre[0] + cell.em_mm * cell.stretch * middle[0],
                cell.centre[1] + cell.em_mm * middle[1],
            ],
            turn: [sin, cos],
            stretch: cell.stretch * rng.random_range(0.95..1.04),
            bounds: BoundsMm::around([cell.centre]),
            reach: BoundsMm::around([cell.centre]),
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
        let carved = frame
            .samples()
            .filter(|(x, y)| self.strokes.at(*x, *y) > 0.0);
        let found = BoundsMm::around(carved.map(|(x, y)| {
            let [u, v] = frame.position(x, y);
            let u = u * self.stretch;
            [
                self.centre[0] + cos * u - sin * v,
                self.centre[1] + cos * v + sin * u,
            ]
        }));
        if found.min[0] <= found.max[0] {
            self.bounds = found;
        }
        self.reach = self.bounds.with_margin(-FAR_MM);
    }
}
