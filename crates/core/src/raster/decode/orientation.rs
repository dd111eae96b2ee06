//! The orientation of an image: how the stored pixels are turned to show the image upright.

use image::metadata::Orientation;

use super::png_chunks::{png_chunks, png_text};
use super::tags::TaggedFile;
use crate::raster::{Colours, Grid};

/// Number of the tag in TIFF and EXIF.
pub(super) const ORIENTATION: u64 = 274;
/// Begins a segment of XMP in a JPEG.
const XMP_PREFIX: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
const XMP_KEYWORD: &[u8] = b"XML:com.adobe.xmp";
/// Keywords of texts that may state an orientation: that of XMP, and those of the hexadecimal digits of a segment of a JPEG, as
/// `ImageMagick` writes them.
const KEYWORDS: [&[u8]; 4] = [
    XMP_KEYWORD,
    b"Raw profile type exif",
    b"Raw profile type APP1",
    b"Raw profile type xmp",
];

/// The EXIF orientations, 1 to 8, that parts of a file state.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StatedOrientation {
    exif: Option<u64>,
    /// In EXIF that is stored as text.
    raw_profile: Option<u64>,
    xmp: Option<u64>,
}

impl StatedOrientation {
    /// Returns what the chunks of a PNG state.
    pub(super) fn of_png(bytes: &[u8]) -> Self {
        let mut stated = Self::default();
        for (kind, content) in png_chunks(bytes) {
            stated.add_chunk(kind, content);
        }
        stated
    }

    /// Adds what a chunk of a PNG states.
    pub(super) fn add_chunk(&mut self, kind: [u8; 4], content: &[u8]) {
        if kind == *b"eXIf" {
            self.exif = self.exif.or_else(|| exif_number(content));
        }
        match png_text(kind, content, &KEYWORDS) {
            Some((XMP_KEYWORD, packet)) => self.xmp = self.xmp.or_else(|| xmp_number(&packet)),
            Some((_, text)) => {
                let segment = raw_profile(&text).unwrap_or_default();
                let number = || exif_number(&segment);
                self.raw_profile = self.raw_profile.or_else(number);
                self.xmp = self.xmp.or_else(|| xmp_number(&segment));
            }
            None => {}
        }
    }

    /// Adds what an application segment of a JPEG states, which may be EXIF or XMP.
    pub(super) fn add_segment(&mut self, segment: &[u8]) {
        if segment.starts_with(b"Exif\0\0") {
            self.exif = self.exif.or_else(|| exif_number(segment));
        } else if segment.starts_with(XMP_PREFIX) {
            self.xmp = self.xmp.or_else(|| xmp_number(segment));
        }
    }

    /// Returns the orientation; upright if none is stated.
    pub(super) fn orientation(self) -> Orientation {
        of_tag(self.exif.or(self.raw_profile).or(self.xmp))
    }
}

/// Returns an EXIF block without the prefix of JPEG segments, which some programs copy to other formats.
pub(super) fn without_prefix(block: &[u8]) -> &[u8] {
    block.strip_prefix(b"Exif\0\0").unwrap_or(block)
}

/// Returns the orientation in an EXIF block, whatever integer type it is stored as.
fn exif_number(block: &[u8]) -> Option<u64> {
    let block = without_prefix(block);
    let directory = TaggedFile::new(&block)?.first_directory()?;
    let number = directory.number(ORIENTATION)?;
    (1..=8).contains(&number).then_some(number)
}

/// Returns the orientation in XMP: an attribute or an element of one digit.
pub(super) fn xmp_number(packet: &[u8]) -> Option<u64> {
    const NAME: &[u8] = b"tiff:Orientation";
    let start = memchr::memmem::find(packet, NAME)? + NAME.len();
    let value = match packet[start..].trim_ascii_start() {
        [b'>', value @ ..] => value,
        [b'=', value @ ..] => value.trim_ascii_start().get(1..)?,
        _ => return None,
    };
    match value.trim_ascii_start() {
        [digit @ b'1'..=b'8', next, ..] if !next.is_ascii_digit() => Some(u64::from(digit - b'0')),
        _ => None,
    }
}

/// Returns the bytes of a text with a name, their number, and two hexadecimal digits for each of them.
fn raw_profile(text: &[u8]) -> Option<Vec<u8>> {
    let mut words = text
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    let _name = words.next()?;
    let len: usize = std::str::from_utf8(words.next()?).ok()?.parse().ok()?;
    let digits: Option<Vec<u32>> = words
        .flatten()
        .map(|byte| char::from(*byte).to_digit(16))
        .collect();
    let digits = digits?;
    let pairs = digits.as_chunks::<2>().0.iter().take(len);
    Some(pairs.map(|[high, low]| (high << 4 | low) as u8).collect())
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

/// Returns the colours of the upright image.
pub(super) fn upright(stored: Colours, orientation: Orientation) -> Colours {
    match stored {
        Colours::Grey8(stored) => Colours::Grey8(turned(stored, orientation)),
        Colours::Rgb8(stored) => Colours::Rgb8(turned(stored, orientation)),
        Colours::Rgb16(stored) => Colours::Rgb16(turned(stored, orientation)),
    }
}

fn turned<T: Copy>(stored: Grid<T>, orientation: Orientation) -> Grid<T> {
    let (width, height) = (stored.width(), stored.height());
    let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
    let same = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(width, height, pixel);
    let swapped = |pixel: &dyn Fn(usize, usize) -> T| Grid::from_fn(height, width, pixel);
    match orientation {
        Orientation::NoTransforms => stored,
        Orientation::FlipHorizontal => same(&|x, y| stored.at(right - x, y)),
        Orientation::Rotate180 => same(&|x, y| stored.at(right - x, bottom - y)),
        Orientation::FlipVertical => same(&|x, y| stored.at(x, bottom - y)),
        Orientation::Rotate90FlipH => swapped(&|x, y| stored.at(y, x)),
        Orientation::Rotate90 => swapped(&|x, y| stored.at(y, bottom - x)),
        Orientation::Rotate270FlipH => swapped(&|x, y| stored.at(right - y, bottom - x)),
        Orientation::Rotate270 => swapped(&|x, y| stored.at(right - y, x)),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use image::DynamicImage;
    use image::metadata::Orientation;

    use super::{KEYWORDS, StatedOrientation, XMP_KEYWORD, XMP_PREFIX, of_tag, turned};
    use crate::raster::Grid;
    use crate::raster::test_images::encoded_chunk;

    fn of_chunks(chunks: &[Vec<u8>]) -> Orientation {
        let png = [b"\x89PNG\r\n\x1a\n".to_vec(), chunks.concat()].concat();
        StatedOrientation::of_png(&png).orientation()
    }

    fn of_segments(segments: &[&[u8]]) -> Orientation {
        let mut stated = StatedOrientation::default();
        for segment in segments {
            stated.add_segment(segment);
        }
        stated.orientation()
    }

    fn compressed(text: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(text).expect("encodes");
        encoder.finish().expect("encodes")
    }

    /// Returns the text of a segment as `ImageMagick` writes it.
    fn raw_text(segment: &[u8]) -> Vec<u8> {
        let digits: Vec<String> = segment.iter().map(|byte| format!("{byte:02x}")).collect();
        let lines: Vec<String> = digits.chunks(36).map(<[String]>::concat).collect();
        format!("\nexif\n{:8}\n{}\n", segment.len(), lines.join("\n")).into_bytes()
    }

    #[test]
    fn every_orientation_is_applied_as_by_the_image_crate() {
        for number in 1..=8 {
            let orientation = Orientation::from_exif(number).expect("an orientation");
            let stored = Grid::from_fn(3, 2, |x, y| (10 * y + x) as u8);
            let grey = image::GrayImage::from_raw(3, 2, stored.data().to_vec());
            let mut wanted = DynamicImage::ImageLuma8(grey.expect("six pixels"));
            wanted.apply_orientation(orientation);
            let found = turned(stored, orientation);
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
                for found in [
                    of_segments(&[&prefixed]),
                    of_chunks(&[encoded_chunk(*b"eXIf", &block)]),
                    of_chunks(&[encoded_chunk(*b"eXIf", &prefixed)]),
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
            let found = of_chunks(&[encoded_chunk(*b"eXIf", unreadable)]);
            assert_eq!(found, Orientation::NoTransforms);
        }
    }

    #[test]
    fn the_first_segment_that_states_an_orientation_counts() {
        let prefixed = |number| [b"Exif\0\0", &exif(false, 3, 2, number)[..]].concat();
        let without = [b"Exif\0\0", &exif(false, 11, 4, 6)[..]].concat();
        let xmp = |text: &str| [XMP_PREFIX, text.as_bytes()].concat();
        let attribute = xmp("<rdf:Description tiff:Orientation=\"8\"/>");
        let [three, six, nine] = [3, 6, 9].map(prefixed);
        let pairs: [[&[u8]; 2]; 5] = [
            [b"Exif\0\0", &six],
            [&without, &six],
            [&six, &three],
            [&nine, &six],
            [&attribute, &six],
        ];
        for segments in pairs {
            assert_eq!(of_segments(&segments), Orientation::Rotate90);
        }
        for text in [
            "<rdf:Description tiff:Orientation=\"6\"/>",
            "<rdf:Description tiff:Orientation = '6'>",
            "<tiff:Orientation>6</tiff:Orientation>",
        ] {
            let segment = xmp(text);
            let found = of_segments(&[&without, &segment]);
            assert_eq!(found, Orientation::Rotate90, "{text}");
        }
        for text in ["<tiff:Orientation>16</tiff:Orientation>", "<x>6</x>"] {
            assert_eq!(of_segments(&[&xmp(text)]), Orientation::NoTransforms);
        }
    }

    #[test]
    fn an_orientation_in_a_text_of_a_png_counts_after_that_of_exif() {
        let segment = [b"Exif\0\0", &exif(true, 3, 2, 6)[..]].concat();
        let raw = raw_text(&segment);
        let packet = b"<rdf:Description tiff:Orientation=\"6\"/>";
        let plain = [KEYWORDS[1], b"\0", &raw].concat();
        let packed = [KEYWORDS[2], b"\0\0", &compressed(&raw)].concat();
        let xmp = [XMP_KEYWORD, b"\0\0\0\0\0", &packet[..]].concat();
        let packed_xmp = [XMP_KEYWORD, b"\0\x01\0en\0\0", &compressed(packet)].concat();
        let texts = [
            encoded_chunk(*b"tEXt", &plain),
            encoded_chunk(*b"zTXt", &packed),
            encoded_chunk(*b"iTXt", &xmp),
            encoded_chunk(*b"iTXt", &packed_xmp),
        ];
        let stated = |number| encoded_chunk(*b"eXIf", &exif(false, 3, 2, number));
        for text in texts {
            let other = encoded_chunk(*b"tEXt", b"Title\0tiff:Orientation=\"3\"");
            let found = of_chunks(&[other, text.clone()]);
            assert_eq!(found, Orientation::Rotate90);
            assert_eq!(of_chunks(&[stated(0), text.clone()]), found);
            assert_eq!(of_chunks(&[text, stated(3)]), Orientation::Rotate180);
        }
        let damaged = [KEYWORDS[1], b"\0\nexif\n 9\n45xx"].concat();
        let found = of_chunks(&[encoded_chunk(*b"tEXt", &damaged)]);
        assert_eq!(found, Orientation::NoTransforms);
    }

    #[test]
    fn an_unknown_number_counts_as_upright() {
        for number in [None, Some(0), Some(9), Some(300)] {
            assert_eq!(of_tag(number), Orientation::NoTransforms);
        }
    }
}
