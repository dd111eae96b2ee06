//! Text on images, in outline fonts that are compiled in.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont, point};

use super::paint::{Rgb, fill};
use mocban_core::raster::fonts::{LABEL_SANS, MINCHO};

/// Height of a line, in sizes of the font.
const LINE: f32 = 1.36;
/// Distance of the baseline from the top of a line, in sizes of the font.
const BASELINE: f32 = 1.07;
/// Replaces the letters that are left out.
const ELLIPSIS: char = '\u{2026}';

/// Fonts in the order in which they are searched for a letter.
static FONTS: LazyLock<[FontRef<'static>; 2]> = LazyLock::new(|| {
    [LABEL_SANS, MINCHO]
        .map(|bytes| FontRef::try_from_slice(bytes).expect("an embedded font is valid"))
});

/// Returns the font that has a letter, and its glyph.
fn glyph(letter: char) -> Option<(&'static FontRef<'static>, GlyphId)> {
    let glyphs = FONTS.iter().map(|font| (font, font.glyph_id(letter)));
    glyphs.into_iter().find(|(_, id)| id.0 != 0)
}

/// Returns the scale at which the em of a font has `size` pixels.
fn scale(font: &FontRef, size: f32) -> PxScale {
    let em = font.units_per_em().unwrap_or(1000.0);
    PxScale::from(size * font.height_unscaled() / em)
}

/// Returns the width of a letter in pixels. A letter without glyph is a box.
fn advance(letter: char, size: f32) -> f32 {
    match glyph(letter) {
        Some((font, id)) => font.as_scaled(scale(font, size)).h_advance(id),
        None => size,
    }
}

/// Returns whether there is a glyph for every letter of a text.
pub(super) fn has_glyphs(text: &str) -> bool {
    text.chars().all(|letter| glyph(letter).is_some())
}

/// Returns the width of a text in pixels. `size` is the size of the font in pixels.
pub(super) fn text_width(text: &str, size: f32) -> usize {
    let width: f32 = text.chars().map(|letter| advance(letter, size)).sum();
    width.ceil() as usize
}

/// Returns the height of a line in pixels.
pub(super) fn line_height(size: f32) -> usize {
    (LINE * size).round() as usize
}

/// Shortens a text to a width in pixels by an ellipsis at its end.
pub(super) fn cut_at_end(text: &str, width: usize, size: f32) -> String {
    shortened(text, width, size, |kept| (kept, 0))
}

/// Shortens a text to a width in pixels by an ellipsis in its middle, so that the beginnings and the ends of ids stay.
pub(super) fn cut_in_middle(text: &str, width: usize, size: f32) -> String {
    shortened(text, width, size, |kept| (kept.div_ceil(2), kept / 2))
}

/// Shortens a text. `split` divides the number of letters that are kept into those at the start and at the end.
fn shortened(
    text: &str,
    width: usize,
    size: f32,
    split: impl Fn(usize) -> (usize, usize),
) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    let with = |kept: usize| {
        let (start, end) = split(kept);
        let end = &letters[letters.len() - end..];
        let all = letters[..start].iter().chain([&ELLIPSIS]).chain(end);
        all.collect::<String>()
    };
    let fits = |kept: &usize| text_width(&with(*kept), size) <= width;
    with((0..letters.len()).rev().find(fits).unwrap_or(0))
}

/// Breaks a text into lines of at most `width` pixels, between words and within words that are longer.
pub(super) fn lines(text: &str, width: usize, size: f32) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_inclusive([' ', '/', '-', '_']) {
        let last = lines.last_mut().expect("there is a line");
        if text_width(&(last.clone() + word.trim_end()), size) <= width {
            last.push_str(word);
            continue;
        }
        lines.push(String::new());
        for letter in word.chars() {
            let last = lines.last_mut().expect("there is a line");
            if text_width(last, size) + advance(letter, size).ceil() as usize <= width {
                last.push(letter);
            } else {
                lines.push(letter.to_string());
            }
        }
    }
    lines.retain(|line| !line.trim().is_empty());
    lines
}

/// Draws a text with its top left corner at `at`.
pub(super) fn write(onto: &mut Rgb, text: &str, at: [usize; 2], size: f32, colour: [u8; 3]) {
    let mut x = at[0] as f32;
    let baseline = at[1] as f32 + (BASELINE * size).round();
    for letter in text.chars() {
        match glyph(letter) {
            Some((font, id)) => {
                let placed = id.with_scale_and_position(scale(font, size), point(x, baseline));
                draw(onto, font, placed, colour);
            }
            None => draw_box(onto, [x, baseline], size, colour),
        }
        x += advance(letter, size);
    }
}

fn draw(onto: &mut Rgb, font: &FontRef, glyph: ab_glyph::Glyph, colour: [u8; 3]) {
    let Some(outline) = font.outline_glyph(glyph) else {
        return;
    };
    let corner = outline.px_bounds().min;
    outline.draw(|column, row, coverage| {
        let (x, y) = (corner.x + column as f32, corner.y + row as f32);
        let is_inside = x >= 0.0 && y >= 0.0 && x < onto.width() as f32 && y < onto.height() as f32;
        if is_inside {
            let (x, y) = (x as usize, y as usize);
            let below = onto.at(x, y);
            let share = coverage.clamp(0.0, 1.0);
            let mixed = |i: usize| {
                let (from, to) = (f32::from(below[i]), f32::from(colour[i]));
                (from + share * (to - from)).round() as u8
            };
            onto.set(x, y, [0, 1, 2].map(mixed));
        }
    });
}

/// Draws the outline of a box in place of a letter without glyph.
fn draw_box(onto: &mut Rgb, [x, baseline]: [f32; 2], size: f32, colour: [u8; 3]) {
    let side = (0.76 * size) as usize;
    let [x, y] = [x + 0.12 * size, baseline - 0.8 * size].map(|place| place.max(0.0) as usize);
    fill(onto, [x, y], [side, 1], colour);
    fill(onto, [x, y + side], [side + 1, 1], colour);
    fill(onto, [x, y], [1, side], colour);
    fill(onto, [x + side, y], [1, side], colour);
}

#[cfg(test)]
mod tests {
    use super::{Rgb, cut_at_end, cut_in_middle, has_glyphs, lines, text_width, write};

    fn ink(text: &str) -> u32 {
        let mut image = Rgb::new(200, 40, [255; 3]);
        write(&mut image, text, [2, 2], 20.0, [0; 3]);
        let dark = image.data().iter().map(|[red, ..]| 255 - u32::from(*red));
        dark.sum()
    }

    #[test]
    fn letters_of_ids_and_characters_of_the_demo_are_drawn() {
        assert!(has_glyphs("b01-0002 chữ số ĐỖ ơ ư × ° – … 明"));
        assert!(!has_glyphs("\u{20000}"));
        for letter in ["l", "ỗ", "明", "\u{20000}"] {
            assert!(ink(letter) > 500, "{letter}");
        }
        assert_eq!(ink(" "), 0);
        // The marks of a Vietnamese letter add to the ink of the letter.
        assert!(ink("ỗ") > ink("o") + 500);
    }

    #[test]
    fn drawing_beyond_the_image_is_cut_off() {
        let mut image = Rgb::new(16, 16, [255; 3]);
        write(&mut image, "Wỗ明\u{20000}", [4, 2], 20.0, [0; 3]);
        assert!(image.data().iter().any(|colour| *colour != [255; 3]));
    }

    #[test]
    fn ids_keep_both_ends_and_notes_their_start() {
        let id = "collection-2024-block-0012-character-0007";
        let width = text_width("collection-2024-block", 20.0);
        let cut = cut_in_middle(id, width, 20.0);
        assert!(
            cut.starts_with("collect") && cut.ends_with("-0007"),
            "{cut}"
        );
        assert!(
            cut.contains('…') && text_width(&cut, 20.0) <= width,
            "{cut}"
        );
        let cut = cut_at_end(id, width, 20.0);
        assert!(
            cut.starts_with("collection-2024") && cut.ends_with('…'),
            "{cut}"
        );
        assert_eq!(cut_in_middle("b01", width, 20.0), "b01");
        assert_eq!(cut_at_end(id, 0, 20.0), "…");
    }

    #[test]
    fn lines_are_not_wider_than_their_space() {
        let text = format!("bad_input: meshes/a.ply {} is empty", "x".repeat(90));
        let broken = lines(&text, 150, 14.0);
        assert!(broken.len() > 4);
        assert!(
            broken
                .iter()
                .all(|line| text_width(line.trim_end(), 14.0) <= 150),
            "{broken:?}"
        );
        assert_eq!(broken.concat(), text);
    }
}
