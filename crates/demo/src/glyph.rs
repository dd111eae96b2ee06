//! Renders characters of the embedded font onto a sample frame.

use ab_glyph::{Font, FontRef, GlyphId, OutlinedGlyph, PxScale, point};

use super::scalar_field::SampleFrame;
use mocban_core::raster::Grid;
use mocban_core::raster::fonts::MINCHO;

/// Minimum ratio of height to width of usable characters. Errors are measured as fractions of the character's height,
/// so flat characters, such as a single horizontal bar, are left out.
const MIN_HEIGHT_BY_WIDTH: f32 = 0.5;

/// The embedded font.
pub(super) struct Glyphs {
    font: FontRef<'static>,
    characters: Vec<char>,
}

/// Position of a character's ink in its em square. Lengths are fractions of the em.
#[derive(Debug, Clone, Copy)]
pub(super) struct GlyphExtent {
    /// Longest side of the ink's bounding box.
    pub longest: f64,
    /// Middle of the bounding box relative to the middle of the em square, right and down.
    pub middle: [f64; 2],
}

impl Glyphs {
    /// Parses the embedded font.
    pub(super) fn embedded() -> Self {
        let font = FontRef::try_from_slice(MINCHO).expect("the embedded font is valid");
        let mut characters: Vec<char> = font
            .codepoint_ids()
            .filter(|(id, character)| !character.is_ascii() && is_usable(&font, *id))
            .map(|(_, character)| character)
            .collect();
        characters.sort_unstable();
        Self { font, characters }
    }

    /// Returns the usable characters, sorted by code point.
    pub(super) fn characters(&self) -> &[char] {
        &self.characters
    }

    /// Returns all characters that have ink, also the flat ones, sorted by code point.
    pub(super) fn with_flat_characters(&self) -> Vec<char> {
        let mut characters: Vec<char> = self
            .font
            .codepoint_ids()
            .filter(|(_, character)| !character.is_ascii() && self.extent(*character).is_some())
            .map(|(_, character)| character)
            .collect();
        characters.sort_unstable();
        characters
    }

    /// Returns the position of a character's ink in its em square, or `None` if it has no ink.
    pub(super) fn extent(&self, character: char) -> Option<GlyphExtent> {
        let id = self.font.glyph_id(character);
        let bounds = outlined(&self.font, id, 1000.0, [0.0, 0.0])?.px_bounds();
        let units_per_px = f64::from(self.font.height_unscaled()) / 1000.0;
        let units_per_em = f64::from(self.font.units_per_em().unwrap_or(1000.0));
        let em = |px: f32| f64::from(px) * units_per_px / units_per_em;
        let middle_u = f64::from(self.font.h_advance_unscaled(id)) / units_per_em / 2.0;
        let ascent = f64::from(self.font.ascent_unscaled()) / units_per_em;
        let longest = em(bounds.width().max(bounds.height()));
        (longest > 0.0).then(|| GlyphExtent {
            longest,
            middle: [
                em(bounds.min.x + bounds.max.x) / 2.0 - middle_u,
                em(bounds.min.y + bounds.max.y) / 2.0 + ascent - 0.5,
            ],
        })
    }

    /// Draws a character into `coverage`, which holds the inked fraction, 0..=1, of each sample's cell. The character's
    /// bounding box is centred on `centre_mm`, and its longest side is `size_mm`.
    pub(super) fn ink(
        &self,
        character: char,
        frame: SampleFrame,
        centre_mm: [f64; 2],
        size_mm: f64,
        coverage: &mut Grid<f32>,
    ) {
        let id = self.font.glyph_id(character);
        let Some(trial) = outlined(&self.font, id, 1000.0, [0.0, 0.0]) else {
            return;
        };
        let bounds = trial.px_bounds();
        let scale = size_mm / frame.step_mm / f64::from(bounds.width().max(bounds.height()));
        let middle = [
            f64::from(bounds.min.x + bounds.max.x) / 2.0,
            f64::from(bounds.min.y + bounds.max.y) / 2.0,
        ];
        let centre = frame.sample(centre_mm);
        let origin = [0, 1].map(|i| (centre[i] - middle[i] * scale + 0.5) as f32);
        if let Some(outline) = outlined(&self.font, id, 1000.0 * scale as f32, origin) {
            draw(&outline, coverage);
        }
    }
}

fn outlined(font: &FontRef, id: GlyphId, scale: f32, at: [f32; 2]) -> Option<OutlinedGlyph> {
    let glyph = id.with_scale_and_position(PxScale::from(scale), point(at[0], at[1]));
    font.outline_glyph(glyph)
}

fn is_usable(font: &FontRef, id: GlyphId) -> bool {
    outlined(font, id, 100.0, [0.0, 0.0]).is_some_and(|outline| {
        let bounds = outline.px_bounds();
        bounds.width() > 0.0 && bounds.height() >= MIN_HEIGHT_BY_WIDTH * bounds.width()
    })
}

fn draw(outline: &OutlinedGlyph, coverage: &mut Grid<f32>) {
    let bounds = outline.px_bounds();
    let (left, top) = (bounds.min.x as i64, bounds.min.y as i64);
    outline.draw(|x, y, share| {
        let (x, y) = (left + i64::from(x), top + i64::from(y));
        if let Some(old) = coverage.get(x, y) {
            coverage.set(x as usize, y as usize, (old + share).min(1.0));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::Glyphs;
    use crate::scalar_field::SampleFrame;
    use mocban_core::raster::Grid;

    #[test]
    fn font_has_nom_characters_outside_the_basic_multilingual_plane() {
        let glyphs = Glyphs::embedded();
        assert!(glyphs.characters().len() > 900);
        assert!(glyphs.characters().iter().any(|c| *c as u32 > 0xFFFF));
        assert!(!glyphs.characters().contains(&'一'));
    }

    #[test]
    fn bounding_box_has_the_requested_size_and_centre() {
        let frame = SampleFrame::covering(6.0, 0.05);
        let mut coverage = Grid::new(frame.side, frame.side, 0.0);
        Glyphs::embedded().ink('國', frame, [1.0, -0.5], 8.0, &mut coverage);
        let found = coverage.map(|share| *share > 0.5).bounding_box();
        let found = found.expect("the glyph has ink");
        let middle = frame.position(
            usize::midpoint(found.x0, found.x1),
            usize::midpoint(found.y0, found.y1),
        );
        assert!((middle[0] - 1.0).abs() < 0.1 && (middle[1] + 0.5).abs() < 0.1);
        let longest = found.width().max(found.height()) as f64 * frame.step_mm;
        assert!((longest - 8.0).abs() < 0.15, "{longest}");
    }
}
