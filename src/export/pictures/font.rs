//! A built-in font of 5 x 7 dots, for ids and numbers on images.

use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Width of a glyph, dots.
pub(super) const WIDTH: usize = 5;
/// Height of a glyph, dots.
pub(super) const HEIGHT: usize = 7;

/// The rows of each glyph, from the top. Bit 4 of a row is the leftmost dot.
///
/// In the font file, each glyph is a line with the letter in quotes, followed by the rows. A `#` is a dot.
static GLYPHS: LazyLock<BTreeMap<char, [u8; HEIGHT]>> = LazyLock::new(|| {
    let lines: Vec<&str> = include_str!("../../../assets/export/font.txt")
        .lines()
        .collect();
    let bits = |row: &str| {
        row.bytes()
            .fold(0, |bits, dot| bits << 1 | u8::from(dot == b'#'))
    };
    let glyphs = lines.chunks(HEIGHT + 1);
    glyphs
        .filter_map(|glyph| {
            let rows = glyph[1..].iter().map(|row| bits(row)).collect::<Vec<_>>();
            Some((glyph[0].chars().nth(1)?, rows.try_into().ok()?))
        })
        .collect()
});

/// Returns the rows of a glyph, from the top. Bit 4 of a row is the leftmost dot. An unknown letter is an empty box.
pub(super) fn glyph(letter: char) -> [u8; HEIGHT] {
    let known = GLYPHS.get(&letter);
    known.copied().unwrap_or([31, 17, 17, 17, 17, 17, 31])
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{GLYPHS, WIDTH, glyph};

    #[test]
    fn every_letter_of_an_id_has_a_distinct_glyph() {
        let letters = ('0'..='9')
            .chain('A'..='Z')
            .chain('a'..='z')
            .chain(['_', '-']);
        for letter in letters {
            assert!(GLYPHS.contains_key(&letter), "{letter}");
        }
        assert_eq!(GLYPHS.len(), 83);
        assert!(GLYPHS.values().flatten().all(|row| *row < 1 << WIDTH));
        let distinct: BTreeSet<_> = GLYPHS.values().collect();
        assert_eq!(distinct.len(), GLYPHS.len());
        assert_eq!(glyph('F'), [31, 16, 16, 30, 16, 16, 16]);
    }

    #[test]
    fn an_unknown_letter_is_a_box() {
        assert_eq!(glyph('\u{5b57}')[0], 31);
    }
}
