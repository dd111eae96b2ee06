//! Text chunks of PNG files.

use flate2::Crc;

use super::decode::{png_chunks, png_text};

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Bytes of the signature and the chunk of the header.
const HEADER: usize = 33;
/// Bytes of a chunk without its data: length, type and checksum.
const CHUNK: usize = 12;
const TEXT: [u8; 4] = *b"tEXt";

/// Returns a PNG with a text chunk behind its header. `keyword` and `text` are ASCII.
///
/// ```
/// use mocban_core::raster::{Grid, png_rgb8, split_png_text, with_png_text};
///
/// let png = png_rgb8(&Grid::new(2, 2, [9, 80, 7]));
/// let titled = with_png_text(&png, "Title", "a sheet");
/// assert_eq!(split_png_text(&titled, "Title"), Some((png, "a sheet".to_owned())));
/// assert_eq!(split_png_text(&titled, "Author"), None);
/// ```
pub fn with_png_text(png: &[u8], keyword: &str, text: &str) -> Vec<u8> {
    let data = [&TEXT[..], keyword.as_bytes(), b"\0", text.as_bytes()].concat();
    let length = (data.len() - TEXT.len()) as u32;
    let mut crc = Crc::new();
    crc.update(&data);
    let (head, rest) = png.split_at(HEADER.min(png.len()));
    let (length, crc) = (length.to_be_bytes(), crc.sum().to_be_bytes());
    [head, &length, &data, &crc, rest].concat()
}

/// Finds a text chunk in the beginning of a PNG. Returns the bytes without the chunk, and its text.
pub fn split_png_text(beginning: &[u8], keyword: &str) -> Option<(Vec<u8>, String)> {
    let mut at = SIGNATURE.len();
    if !beginning.starts_with(SIGNATURE) {
        return None;
    }
    for (kind, content) in png_chunks(beginning) {
        let end = at + CHUNK + content.len();
        if kind == TEXT
            && let Some((_, text)) = png_text(kind, content, &[keyword.as_bytes()])
        {
            let without = [&beginning[..at], beginning.get(end..)?].concat();
            return Some((without, String::from_utf8_lossy(&text).into_owned()));
        }
        at = end;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{split_png_text, with_png_text};
    use crate::raster::{Grid, ImageLimits, decode, png_rgb8, png_rgb8_of};

    #[test]
    fn a_png_with_a_text_is_the_same_picture() {
        let grid = Grid::from_fn(30, 20, |x, y| [(x * y) as u8, 80, 7]);
        let png = png_rgb8_of(&grid, "a program");
        let titled = with_png_text(&png, "Title", "a sheet");
        let read = |png: &[u8]| decode(png, &ImageLimits::SUGGESTED).expect("a picture").rgb;
        assert_eq!(read(&titled), read(&png));
        let split = split_png_text(&titled, "Software").expect("the other text");
        assert_eq!(split.1, "a program");
        let plain = with_png_text(&png_rgb8(&grid), "Title", "a sheet");
        assert_eq!(split.0, plain);
    }

    #[test]
    fn the_beginning_of_a_file_is_enough_and_other_bytes_have_no_text() {
        let png = png_rgb8(&Grid::from_fn(30, 20, |x, y| [(x * y) as u8, 80, 7]));
        let titled = with_png_text(&png, "Title", "a sheet");
        for len in 0..titled.len() {
            let found = split_png_text(&titled[..len], "Title");
            let is_whole = len >= 33 + 12 + "Title\0a sheet".len();
            assert_eq!(found.is_some(), is_whole, "{len}");
        }
        assert_eq!(split_png_text(&png, "Title"), None);
        assert_eq!(
            split_png_text(b"\x89PNG\r\n\x1a\n\xff\xff\xff\xfftEXt", "Title"),
            None
        );
        assert_eq!(split_png_text(b"", "Title"), None);
    }
}
