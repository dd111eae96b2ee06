//! The size of an image by its header, before it is decoded.

use std::io::{BufRead, Read, Seek, SeekFrom};

use image::metadata::Orientation;

use super::error::{DecodeError, broken};
use super::limits::ImageLimits;
use super::orientation::{StatedOrientation, of_tag, swaps_sides};
use super::tags::TagFileWindow;
use super::tiff;
use crate::domain::cancel::poll;
use crate::domain::{FileKind, has_only_zeros};
use crate::page_vec::fill;

/// Bytes at the end of a JPEG in which the mark of its end is searched. Some programs write metadata behind it.
const TAIL_BYTES: u64 = 1 << 16;
/// Most segments of a JPEG before its frame header.
const MAX_SEGMENTS: usize = 1000;
/// Most chunks of a PNG.
const MAX_CHUNKS: usize = 100_000;
/// Longest chunk of EXIF or text that is read.
const MAX_CHUNK_BYTES: u64 = 1 << 20;

/// The size of the stored image, and how it is turned.
type StoredSize = ([u32; 2], Orientation);

/// Returns width and height of the upright image in pixels, by its header. `len` is the length of the file in bytes.
///
/// # Errors
/// Returns an error if the file is no PNG, JPEG or TIFF image, or exceeds the limits. [`DecodeError::Truncated`] means only that
/// the file may end before its image does, because the mark of its end or a part of it is not found: the decoder accepts some
/// of these files.
pub fn header_size(
    mut file: impl BufRead + Seek,
    len: u64,
    limits: &ImageLimits,
) -> Result<[u32; 2], DecodeError> {
    limits.check_bytes(len)?;
    let kind = match file.fill_buf() {
        Ok(head) => FileKind::of(head),
        Err(error) => return Err(broken(FileKind::Binary, &error.to_string())),
    };
    let stored = match kind {
        FileKind::Tiff => {
            let window = TagFileWindow::new(&mut file);
            let (size, turned) = tiff::stored_size(&window, len, limits)?;
            Some((size, of_tag(turned)))
        }
        FileKind::Jpeg => jpeg_size(&mut file, len),
        FileKind::Png => png_size(&mut file),
        FileKind::Binary if has_only_zeros(&mut file).unwrap_or(false) => {
            return Err(DecodeError::OnlyZeros);
        }
        other => return Err(DecodeError::NotAnImage(other)),
    };
    let ([width, height], orientation) = stored.ok_or(DecodeError::Truncated(kind))?;
    limits.check_size(width, height)?;
    Ok(if swaps_sides(orientation) {
        [height, width]
    } else {
        [width, height]
    })
}

/// Reads the frame header of a JPEG, and what precedes it. `None` if it is not found, or if no mark of the end follows.
fn jpeg_size(file: &mut (impl Read + Seek), len: u64) -> Option<StoredSize> {
    let mut at = 2;
    let mut turned = StatedOrientation::default();
    for _ in 0..MAX_SEGMENTS {
        let head: [u8; 9] = array_at(file, at)?;
        let number = |at: usize| u16::from_be_bytes([head[at], head[at + 1]]);
        let segment = u64::from(number(2));
        match (head[0], head[1]) {
            (0xff, 0xff) => at += 1,
            (0xff, 0x01 | 0xd0..=0xd8) => at += 2,
            (0xff, 0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf) => {
                let size = [number(7), number(5)].map(u32::from);
                let has_end = has_jpeg_end(file, at.max(len.saturating_sub(TAIL_BYTES)))?;
                return has_end.then(|| (size, turned.orientation()));
            }
            // The end, or a scan before the frame.
            (0xff, 0x00 | 0xd9 | 0xda) => return None,
            (0xff, marker) => {
                if marker == 0xe1 {
                    turned.add_segment(&block_at(file, at + 4, segment.saturating_sub(2))?);
                }
                at += 2 + segment;
            }
            _ => return None,
        }
    }
    None
}

/// Returns whether the mark that ends a JPEG is at an offset or behind it. Before the frame header, it may be that of a
/// thumbnail.
fn has_jpeg_end(file: &mut (impl Read + Seek), start: u64) -> Option<bool> {
    let tail = block_at(file, start, TAIL_BYTES)?;
    Some(tail.windows(2).any(|bytes| bytes == [0xff, 0xd9]))
}

/// Reads the chunks of a PNG. `None` if the last one is not found.
fn png_size(file: &mut (impl Read + Seek)) -> Option<StoredSize> {
    let mut size = None;
    let mut turned = StatedOrientation::default();
    let mut at = 8;
    for _ in 0..MAX_CHUNKS {
        poll();
        let head: [u8; 8] = array_at(file, at)?;
        let [len, kind] = *head.as_chunks::<4>().0 else {
            return None;
        };
        let len = u64::from(u32::from_be_bytes(len));
        match &kind {
            b"IHDR" => {
                let sides: [u8; 8] = array_at(file, at + 8)?;
                let [width, height] = *sides.as_chunks::<4>().0 else {
                    return None;
                };
                size = Some([width, height].map(u32::from_be_bytes));
            }
            b"eXIf" | b"tEXt" | b"zTXt" | b"iTXt" => {
                turned.add_chunk(kind, &block_at(file, at + 8, len.min(MAX_CHUNK_BYTES))?);
            }
            b"IEND" => return Some((size?, turned.orientation())),
            _ => {}
        }
        at += 12 + len;
    }
    None
}

/// Returns bytes at an offset, or `None` if they are not all there.
fn array_at<const N: usize>(file: &mut (impl Read + Seek), at: u64) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    file.seek(SeekFrom::Start(at)).ok()?;
    (fill(file, &mut bytes).ok()? == N).then_some(bytes)
}

/// Returns up to `len` bytes at an offset.
fn block_at(file: &mut (impl Read + Seek), at: u64, len: u64) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(at)).ok()?;
    let mut block = file.by_ref().take(len);
    block.read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::header_size;
    use crate::domain::FileKind;
    use crate::raster::{DecodeError, Grid, ImageLimits, decode, jpeg_rgb8, png_rgb8};

    fn size(bytes: &[u8]) -> Result<[u32; 2], DecodeError> {
        let len = bytes.len() as u64;
        header_size(Cursor::new(bytes), len, &ImageLimits::SUGGESTED)
    }

    fn picture() -> Grid<[u8; 3]> {
        Grid::new(120, 80, [200, 100, 50])
    }

    /// Returns an EXIF block with an orientation.
    fn exif(orientation: u8) -> Vec<u8> {
        let head = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0";
        [&head[..], &[orientation, 0, 0, 0], &[0; 4]].concat()
    }

    /// Returns a JPEG with more bytes in its EXIF segment, such as a thumbnail.
    fn jpeg_with_exif(orientation: u8, more: &[u8]) -> Vec<u8> {
        let plain = jpeg_rgb8(&picture(), 85);
        let block = [b"Exif\0\0", &exif(orientation)[..], more].concat();
        let len = (block.len() as u16 + 2).to_be_bytes();
        let (start, rest) = plain.split_at(2);
        [start, &[0xff, 0xe1], &len, &block, rest].concat()
    }

    /// Returns a grey TIFF whose directory precedes its strip.
    fn tiff(orientation: u32) -> Vec<u8> {
        let (width, height, data) = (12_u32, 8_u32, 134);
        let tags = [
            (256_u16, width),
            (257, height),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, data),
            (274, orientation),
            (277, 1),
            (278, height),
            (279, width * height),
        ];
        let mut bytes = b"II*\0\x08\0\0\0\x0a\0".to_vec();
        for (tag, value) in tags {
            bytes.extend(tag.to_le_bytes());
            bytes.extend([4, 0, 1, 0, 0, 0]);
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0; 4]);
        bytes.extend(vec![200; (width * height) as usize]);
        bytes
    }

    #[test]
    fn sizes_and_cut_files_are_known_by_headers_and_ends() {
        for bytes in [png_rgb8(&picture()), jpeg_rgb8(&picture(), 85)] {
            assert_eq!(size(&bytes), Ok([120, 80]));
            let cut = size(&bytes[..bytes.len() - 13]).expect_err("cut");
            assert!(matches!(cut, DecodeError::Truncated(_)), "{cut}");
            assert_eq!(size(&[]), Err(DecodeError::Empty));
            let pointer = size(b"version https://git-lfs.github.com/spec/v1\noid x\n");
            let pointer = pointer.expect_err("a pointer").to_string();
            assert!(pointer.contains("Git LFS"), "{pointer}");
        }
    }

    #[test]
    fn the_size_is_that_of_the_upright_image() {
        let png = png_rgb8(&picture());
        let block = exif(6);
        let len = (block.len() as u32).to_be_bytes();
        let chunk = [&len[..], b"eXIf", &block, &[0; 4]].concat();
        let png = [&png[..33], &chunk, &png[33..]].concat();
        assert_eq!(size(&png), Ok([80, 120]));
        for (bytes, upright) in [
            (jpeg_with_exif(1, &[]), [120, 80]),
            (jpeg_with_exif(6, &[]), [80, 120]),
            (tiff(1), [12, 8]),
            (tiff(8), [8, 12]),
        ] {
            assert_eq!(size(&bytes), Ok(upright));
            let decoded = decode(&bytes, &ImageLimits::SUGGESTED).expect("decodes");
            let sides = [decoded.rgb.width(), decoded.rgb.height()];
            assert_eq!(sides.map(|side| side as u32), upright);
        }
    }

    #[test]
    fn the_orientation_of_a_later_segment_turns_the_image() {
        let later = jpeg_with_exif(6, &[]);
        let (start, rest) = later.split_at(2);
        for first in [&b"Exif\0\0"[..], b"http://ns.adobe.com/xap/1.0/\0<x/>"] {
            let len = (first.len() as u16 + 2).to_be_bytes();
            let bytes = [start, &[0xff, 0xe1], &len, first, rest].concat();
            assert_eq!(size(&bytes), Ok([80, 120]));
            let decoded = decode(&bytes, &ImageLimits::SUGGESTED).expect("decodes");
            assert_eq!(decoded.turned, Some(6));
        }
    }

    #[test]
    fn a_tiff_that_ends_within_its_strips_may_be_cut() {
        let whole = tiff(1);
        for len in [whole.len() - 1, 140, 130] {
            let cut = size(&whole[..len]);
            assert_eq!(cut, Err(DecodeError::Truncated(FileKind::Tiff)), "{len}");
        }
    }

    #[test]
    fn the_end_of_a_thumbnail_is_not_that_of_the_image() {
        let whole = jpeg_with_exif(1, &[0xff, 0xd8, 0xff, 0xd9]);
        assert_eq!(size(&whole), Ok([120, 80]));
        let cut = size(&whole[..whole.len() - 2]);
        assert_eq!(cut, Err(DecodeError::Truncated(FileKind::Jpeg)));
    }
}
