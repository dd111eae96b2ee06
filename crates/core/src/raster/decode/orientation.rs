//! The EXIF orientation of an image: how the stored pixels are turned to show the image upright.

use image::metadata::Orientation;

use super::tags::TaggedFile;
use crate::domain::cancel::PollCounter;
use crate::raster::Grid;

const ORIENTATION: u64 = 274;

/// Returns the orientation of a PNG.
pub(super) fn of_png(bytes: &[u8]) -> Orientation {
    of_exif(png_chunk(bytes, *b"eXIf"))
}

/// Returns the content of the first chunk of a kind, which may stand before or after the pixels.
pub(super) fn png_chunk(bytes: &[u8], wanted: [u8; 4]) -> Option<&[u8]> {
    let mut counter = PollCounter::default();
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        counter.tick();
        let (len, kind) = head.split_at(4);
        let len = len
            .iter()
            .fold(0, |sum, byte| sum << 8 | usize::from(*byte));
        if kind == wanted {
            return bytes.get(at + 8..at + 8 + len);
        }
        at += 12 + len;
    }
    None
}

/// Returns an EXIF block without the prefix of JPEG segments, which some programs copy to other formats.
pub(super) fn without_prefix(block: &[u8]) -> &[u8] {
    block.strip_prefix(b"Exif\0\0").unwrap_or(block)
}

/// Returns the orientation in an EXIF block, whatever integer type it is stored as. An unreadable one counts as upright.
pub(super) fn of_exif(block: Option<&[u8]>) -> Orientation {
    let block = block.map(without_prefix).unwrap_or_default();
    let directory = TaggedFile::new(&block).and_then(|file| file.first_directory());
    of_tag(directory.and_then(|directory| directory.number(ORIENTATION)))
}

/// Returns the orientation with a number from a tag. A number that is not in 1..=8 counts as upright.
pub(super) fn of_tag(number: Option<u64>) -> Orientation {
    number
        .and_then(|number| u8::try_from(number).ok())
        .and_then(Orientation::from_exif)
        .unwrap_or(Orientation::NoTransforms)
}

/// Returns whether the upright image is as wide as the stored one is high.
pub(super) fn swaps_sides(orientation: Orientation) -> bool {
    orientation.to_exif() >= 5
}

/// Returns the pixels of the upright image.
pub(super) fn upright<T: Copy>(stored: Grid<T>, orientation: Orientation) -> Grid<T> {
    let (width, height) = (stored.width(), stored.height());
    let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
    let same = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(width, height, pixel);
    let turned = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(height, width, pixel);
    match orientation {
        Orientation::NoTransforms => stored,
        Orientation::FlipHorizontal => same(&|x, y| stored.at(right - x, y)),
        Orientation::Rotate180 => same(&|x, y| stored.at(right - x, bottom - y)),
        Orientation::FlipVertical => same(&|x, y| stored.at(x, bottom - y)),
        Orientation::Rotate90FlipH => turned(&|x, y| stored.at(y, x)),
        Orientation::Rotate90 => turned(&|x, y| stored.at(y, bottom - x)),
        Orientation::Rotate270FlipH => turned(&|x, y| stored.at(right - y, bottom - x)),
        Orientation::Rotate270 => turned(&|x, y| stored.at(right - y, x)),
    }
}

#[cfg(test)]
mod tests {
    use image::DynamicImage;
    use image::metadata::Orientation;

    use super::{of_exif, of_png, of_tag, upright};
    use crate::raster::Grid;

    #[test]
    fn every_orientation_is_applied_as_by_the_image_crate() {
        for number in 1..=8 {
            let orientation = Orientation::from_exif(number).expect("an orientation");
            let stored = Grid::from_fn(3, 2, |x, y| (10 * y + x) as u8);
            let grey = image::GrayImage::from_raw(3, 2, stored.data().to_vec());
            let mut wanted = DynamicImage::ImageLuma8(grey.expect("six pixels"));
            wanted.apply_orientation(orientation);
            let found = upright(stored, orientation);
            let size = (wanted.width() as usize, wanted.height() as usize);
            assert_eq!((found.width(), found.height()), size, "{number}");
            assert_eq!(found.data(), wanted.as_bytes(), "{number}");
        }
    }

    /// Returns an EXIF block with an orientation of an integer type of a length, and nothing else.
    fn exif(is_big_endian: bool, kind: u16, len: usize, number: u8) -> Vec<u8> {
        let ordered = |value: u32, len: usize| {
            let mut bytes = value.to_le_bytes()[..len].to_vec();
            if is_big_endian {
                bytes.reverse();
            }
            bytes
        };
        let mut value = ordered(u32::from(number), len);
        value.resize(4, 0);
        [
            if is_big_endian {
                b"MM".to_vec()
            } else {
                b"II".to_vec()
            },
            ordered(42, 2),
            ordered(8, 4),
            ordered(1, 2),
            ordered(274, 2),
            ordered(u32::from(kind), 2),
            ordered(1, 4),
            value,
            ordered(0, 4),
        ]
        .concat()
    }

    #[test]
    fn the_orientation_is_read_from_every_integer_type_in_both_byte_orders() {
        for (kind, len) in [(1, 1), (3, 2), (4, 4), (6, 1), (8, 2), (9, 4)] {
            for is_big_endian in [false, true] {
                let block = exif(is_big_endian, kind, len, 6);
                let prefixed = [b"Exif\0\0", &block[..]].concat();
                let png = |block: &[u8]| {
                    let len = (block.len() as u32).to_be_bytes();
                    [b"\x89PNG\r\n\x1a\n", &len[..], b"eXIf", block, &[0; 4]].concat()
                };
                for found in [
                    of_exif(Some(&block)),
                    of_exif(Some(&prefixed)),
                    of_png(&png(&block)),
                    of_png(&png(&prefixed)),
                ] {
                    assert_eq!(found, Orientation::Rotate90, "type {kind}");
                }
            }
        }
        for unreadable in [
            &exif(false, 3, 2, 6)[..18],
            &exif(false, 11, 4, 6),
            b"",
            b"II",
        ] {
            assert_eq!(of_exif(Some(unreadable)), Orientation::NoTransforms);
        }
    }

    #[test]
    fn an_unknown_number_counts_as_upright() {
        for number in [None, Some(0), Some(9), Some(300)] {
            assert_eq!(of_tag(number), Orientation::NoTransforms);
        }
    }
}
