//! Outlines of a character and of its neighbours on the block, with the irregular edges of carved strokes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::glyph::Glyphs;
use super::kind::Crop;
use super::noise::Noise;
use super::polygon::BoundsMm;
use super::scalar_field::{SampleFrame, ScalarField};
use mocban_core::raster::Grid;

/// Margin of the sample frame around the character's strokes, mm.
const MARGIN_MM: f64 = 2.2;
/// Sample spacing, mm; finer than the densest scan.
const STEP_MM: f64 = 0.035;
/// Sample spacing for scenes that show 3 x 3 characters, mm.
const WIDE_STEP_MM: f64 = 0.05;
/// Margin of crops that show 3 x 3 characters, as a fraction of the character's size.
pub(super) const WIDE_MARGIN: f64 = 1.1;
/// Minimum gap between the character and its neighbours, mm.
const CLEARANCE_MM: f64 = 0.35;

/// Distance of a close rule from the character, mm.
const CLOSE_RULE_MM: f64 = 0.5;

/// The strokes of one character.
#[derive(Debug, Clone)]
pub(super) struct Artwork {
    /// Signed distance to the stroke outline in mm, positive inside a stroke.
    pub strokes: ScalarField,
    /// Bounding box of the strokes.
    pub stroke_bounds: BoundsMm,
    /// Longest side of the bounding box, mm.
    pub size_mm: f64,
}

impl Artwork {
    /// Draws a character of the font, with strokes as thick as those on woodblocks.
    pub(super) fn of_glyph(
        glyphs: &Glyphs,
        character: char,
        crop: Crop,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let size_mm = rng.random_range(8.0..10.2);
        let weight_mm = draw_stroke_weight(size_mm, rng);
        let frame = match crop {
            Crop::Character => SampleFrame::covering(size_mm / 2.0 + MARGIN_MM, STEP_MM),
            Crop::WideMesh | Crop::WidePrint | Crop::WideRim => {
                let half_mm = size_mm * (0.5 + WIDE_MARGIN) + MARGIN_MM;
                SampleFrame::covering(half_mm, WIDE_STEP_MM)
            }
        };
        let strokes = carved_strokes(glyphs, character, frame, [size_mm, weight_mm], rng);
        Self::new(strokes, size_mm)
    }

    /// Builds a character from a mask. `ink` returns the ink coverage, 0..=1, at a point in mm.
    pub(super) fn of_mask(size_mm: f64, ink: impl Fn([f64; 2]) -> f64) -> Self {
        let frame = SampleFrame::covering(size_mm / 2.0 + MARGIN_MM, STEP_MM);
        let coverage = ScalarField::from_fn(frame, |point, _, _| ink(point)).values;
        // The blur removes the pixel staircase of a photographed mask.
        let strokes = ScalarField::signed_distance(frame, &coverage).blurred(0.06);
        Self::new(strokes, size_mm)
    }

    fn new(strokes: ScalarField, size_mm: f64) -> Self {
        let frame = strokes.frame;
        let ink = strokes.values.map(|distance| *distance > 0.0);
        let found = ink.bounding_box().map_or(
            BoundsMm {
                min: [-size_mm / 2.0; 2],
                max: [size_mm / 2.0; 2],
            },
            |found| BoundsMm {
                min: frame.position(found.x0, found.y0),
                max: frame.position(found.x1, found.y1),
            },
        );
        Self {
            strokes,
            stroke_bounds: found,
            size_mm,
        }
    }

    /// Returns the character as another hand writes it: its strokes have other widths, lengths and places.
    pub(super) fn by_another_hand(&self, rng: &mut ChaCha8Rng) -> Self {
        let (place, weight) = ([Noise::draw(rng), Noise::draw(rng)], Noise::draw(rng));
        let place_mm = rng.random_range(0.4..0.9);
        let size_mm = rng.random_range(2.0..4.5);
        let weight_mm = rng.random_range(0.03..0.1);
        let strokes = ScalarField::from_fn(self.strokes.frame, |[u, v], _, _| {
            let [du, dv] = place.map(|noise| place_mm * noise.at(u / size_mm, v / size_mm));
            self.strokes.value([u + du, v + dv]) + weight_mm * weight.at(u / 1.2, v / 1.2)
        });
        Self::new(strokes, self.size_mm)
    }

    /// Draws the neighbouring characters and the column rules. Returns the signed distance to their outlines in mm,
    /// positive inside. Each of the four nearest neighbours and each rule is present with a fixed probability. If mesh
    /// or print shows 3 x 3 characters, all eight neighbours are present.
    pub(super) fn draw_neighbours(
        &self,
        glyphs: &Glyphs,
        crop: Crop,
        rng: &mut ChaCha8Rng,
    ) -> ScalarField {
        let frame = self.strokes.frame;
        let mut coverage = Grid::new(frame.side, frame.side, 0.0);
        let pitch = self.size_mm * rng.random_range(1.0..1.08) + 0.2;
        let column = self.size_mm * rng.random_range(1.04..1.18) + 0.4;
        let beside = [[0.0, -pitch], [0.0, pitch], [-column, 0.0], [column, 0.0]];
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
            .map(|[across, down]| [across * column, down * pitch]);
        let (offsets, probability) = match crop {
            Crop::Character => (beside.to_vec(), 0.75),
            Crop::WideRim => return self.draw_rim(rng),
            Crop::WideMesh | Crop::WidePrint => ([beside, corners].concat(), 1.0),
        };
        for offset in offsets {
            if rng.random_bool(probability) {
                let characters = glyphs.characters();
                let character = characters[rng.random_range(0..characters.len())];
                let size = self.size_mm * rng.random_range(0.88..1.0);
                let centre = [0, 1].map(|i| offset[i] + rng.random_range(-0.3..0.3));
                glyphs.ink(character, frame, centre, size, &mut coverage);
            }
        }
        let weight_mm = draw_stroke_weight(self.size_mm, rng);
        let mut neighbours = knife_outline(frame, &coverage, weight_mm, rng);
        for u in [-column / 2.0, column / 2.0] {
            if rng.random_bool(0.4) {
                add_rule(&mut neighbours, u, rng);
            }
        }
        clear_around(&mut neighbours, &self.strokes);
        neighbours
    }

    /// Draws the uncarved wood around the carved area, as signed distances in mm, positive inside.
    fn draw_rim(&self, rng: &mut ChaCha8Rng) -> ScalarField {
        let carved_mm = self.size_mm * rng.random_range(0.1..0.6);
        let carved = self.stroke_bounds.with_margin(carved_mm);
        let edge = Noise::draw(rng);
        ScalarField::from_fn(self.strokes.frame, |point, _, _| {
            let [du, dv] = [0, 1].map(|k| {
                let beyond = (carved.min[k] - point[k]).max(point[k] - carved.max[k]);
                beyond + 0.3 * edge.at(point[0] / 2.0, point[1] / 2.0)
            });
            du.max(dv)
        })
    }

    /// Adds a rule on either side of the character, so close that crops contain it.
    pub(super) fn add_close_rules(&self, neighbours: &mut ScalarField, rng: &mut ChaCha8Rng) {
        let (left, right) = (self.stroke_bounds.min[0], self.stroke_bounds.max[0]);
        for u in [left - CLOSE_RULE_MM, right + CLOSE_RULE_MM] {
            add_rule(neighbours, u, rng);
        }
        clear_around(neighbours, &self.strokes);
    }

    /// Returns the distance field of a scene without neighbours: `-size_mm` everywhere.
    pub(super) fn empty_neighbours(&self) -> ScalarField {
        ScalarField::from_fn(self.strokes.frame, |_, _, _| -self.size_mm)
    }
}

/// Draws the distance in mm by which the outline is moved outwards. A stroke widens by twice this distance, which is
/// 2.6 to 4.4 % of the character's size.
fn draw_stroke_weight(size_mm: f64, rng: &mut ChaCha8Rng) -> f64 {
    size_mm * rng.random_range(0.013..0.022)
}

/// Carves a character of the font, centred on the frame. Returns the signed distance to its outline in mm, positive
/// inside. Its longest side has `size_mm`, and its outline is moved outwards by about `weight_mm`.
pub(super) fn carved_strokes(
    glyphs: &Glyphs,
    character: char,
    frame: SampleFrame,
    [size_mm, weight_mm]: [f64; 2],
    rng: &mut ChaCha8Rng,
) -> ScalarField {
    let mut coverage = Grid::new(frame.side, frame.side, 0.0);
    let outline_mm = size_mm - 2.0 * weight_mm;
    glyphs.ink(character, frame, [0.0; 2], outline_mm, &mut coverage);
    let mut strokes = knife_outline(frame, &coverage, weight_mm, rng);
    chip_edges(&mut strokes, rng);
    strokes
}

/// Returns the signed distance to the outline as a knife would cut it. The outline of the ink is moved outwards by about
/// `weight_mm`, and has rounded corners and a slightly irregular edge.
fn knife_outline(
    frame: SampleFrame,
    coverage: &Grid<f32>,
    weight_mm: f64,
    rng: &mut ChaCha8Rng,
) -> ScalarField {
    let distance = ScalarField::signed_distance(frame, coverage);
    let (coarse, fine) = (Noise::draw(rng), Noise::draw(rng));
    let (coarse_mm, fine_mm) = (rng.random_range(0.03..0.07), rng.random_range(0.015..0.035));
    let round = distance.blurred(rng.random_range(0.05..0.09));
    ScalarField::from_fn(frame, |[u, v], x, y| {
        round.at(x, y)
            + weight_mm
            + coarse_mm * coarse.at(u / 0.9, v / 0.9)
            + fine_mm * fine.at(u / 0.22, v / 0.22)
    })
}

/// Removes small chips along the stroke outline.
fn chip_edges(strokes: &mut ScalarField, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(2..9_u32) {
        let Some([u, v]) = random_boundary_point(strokes, rng) else {
            return;
        };
        remove_disc(strokes, [u, v], rng.random_range(0.08..0.24));
    }
}

/// Removes a disc from the strokes.
fn remove_disc(strokes: &mut ScalarField, [u, v]: [f64; 2], radius_mm: f64) {
    let around = strokes.frame.box_around([u, v], radius_mm + 0.3);
    strokes.change(around, |[pu, pv], before| {
        before.min((pu - u).hypot(pv - v) - radius_mm)
    });
}

/// Returns a random point within 0.05 mm of the outline, or `None` if 4000 draws find none.
fn random_boundary_point(strokes: &ScalarField, rng: &mut ChaCha8Rng) -> Option<[f64; 2]> {
    let side = strokes.frame.side;
    (0..4000).find_map(|_| {
        let (x, y) = (rng.random_range(0..side), rng.random_range(0..side));
        (strokes.at(x, y).abs() < 0.05).then(|| strokes.frame.position(x, y))
    })
}

/// Adds a vertical rule between two columns.
fn add_rule(neighbours: &mut ScalarField, at_mm: f64, rng: &mut ChaCha8Rng) {
    let noise = Noise::draw(rng);
    let half_width = rng.random_range(0.10..0.2);
    let lean = rng.random_range(-0.02..0.02);
    neighbours.change(neighbours.frame.samples(), |[u, v], before| {
        let middle = at_mm + lean * v + 0.08 * noise.at(v / 1.5, 0.0);
        before.max(half_width + 0.04 * noise.at(v / 0.4, 7.0) - (u - middle).abs())
    });
}

/// Removes neighbours closer than [`CLEARANCE_MM`] to the character.
fn clear_around(neighbours: &mut ScalarField, strokes: &ScalarField) {
    let pairs = neighbours.values.data_mut().iter_mut();
    for (value, stroke) in pairs.zip(strokes.values.data()) {
        *value = value.min(-stroke - CLEARANCE_MM as f32);
    }
}

/// Returns half the longest side of the strokes' bounding box, mm.
pub(super) fn half_extent_mm(strokes: &ScalarField) -> f64 {
    let ink = strokes.values.map(|distance| *distance > 0.0);
    let longest = ink.bounding_box().map_or(strokes.frame.side, |found| {
        found.width().max(found.height())
    });
    longest as f64 * strokes.frame.step_mm / 2.0
}
