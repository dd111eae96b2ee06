//! The resolution that an image file states.

use std::io::{BufRead, Read as _, Seek};

use image::metadata::Orientation;

use super::orientation::StatedOrientation;
use super::png_chunks::png_chunk;
use super::tags::{TagFileWindow, TagSource, TagValues, TaggedFile};
use super::{jpeg, orientation, tiff};
use crate::domain::FileKind;

const X_RESOLUTION: u64 = 282;
const Y_RESOLUTION: u64 = 283;
const RESOLUTION_UNIT: u64 = 296;
const INCH: f64 = 2.0;
const CENTIMETRE: f64 = 3.0;
const CM_PER_INCH: f64 = 2.54;
const METRES_PER_INCH: f64 = 0.0254;
/// Bytes at the beginning of a PNG or JPEG file in which its resolution is searched.
const HEAD_BYTES: u64 = 1 << 20;

/// The resolution of the stored pixels, and how they are turned.
type StoredDpi = (Option<[f64; 2]>, Orientation);

/// Returns how many pixels per inch the upright image has, from left to right and from top to bottom, if the file says so:
/// in the `pHYs` chunk of a PNG, the JFIF header of a JPEG, the tags of a TIFF, or EXIF. Numbers without a unit do not count.
pub fn stated_dpi(bytes: &[u8]) -> Option<[f64; 2]> {
    upright_dpi(match FileKind::of(bytes) {
        FileKind::Png => {
            let physical = png_chunk(bytes, *b"pHYs").and_then(of_phys);
            let exif = || of_exif(png_chunk(bytes, *b"eXIf")?);
            let turned = StatedOrientation::of_png(bytes);
            (physical.or_else(exif), turned.orientation())
        }
        FileKind::Jpeg => {
            let found = jpeg::metadata(bytes);
            let exif = || found.exif.iter().find_map(|block| of_exif(block));
            let stored = found.jfif.and_then(of_jfif).or_else(exif);
            (stored, found.orientation.orientation())
        }
        FileKind::Tiff => of_tiff(&bytes)?,
        _ => return None,
    })
}

/// Returns the resolution like [`stated_dpi`], but reads only the tags of a TIFF file, and only the beginning of any other file.
pub fn file_dpi(mut file: impl BufRead + Seek) -> Option<[f64; 2]> {
    if FileKind::of(file.fill_buf().ok()?) == FileKind::Tiff {
        return upright_dpi(of_tiff(&TagFileWindow::new(file))?);
    }
    let mut head = Vec::new();
    file.take(HEAD_BYTES).read_to_end(&mut head).ok()?;
    stated_dpi(&head)
}

fn of_tiff(file: &dyn TagSource) -> Option<StoredDpi> {
    let (stored, turned) = tiff::with_print_tags(file, |print| {
        let tag = |tag| print.inherited_values(tag);
        (of_tags(tag), print.orientation())
    })?;
    Some((stored, orientation::of_tag(turned)))
}

/// Returns the resolution of the upright image, if it is one.
fn upright_dpi((stored, orientation): StoredDpi) -> Option<[f64; 2]> {
    let [x, y] = stored.filter(|dpi| dpi.iter().all(|dpi| dpi.is_finite() && *dpi > 0.0))?;
    Some(if orientation::swaps_sides(orientation) {
        [y, x]
    } else {
        [x, y]
    })
}

/// Returns the resolution of a `pHYs` chunk: two numbers of pixels, and 1 if they are per metre.
fn of_phys(chunk: &[u8]) -> Option<[f64; 2]> {
    let (sides, [1]) = chunk.split_at_checked(8)? else {
        return None;
    };
    let [x, y] = sides.as_chunks::<4>().0 else {
        return None;
    };
    Some([x, y].map(|side| f64::from(u32::from_be_bytes(*side)) * METRES_PER_INCH))
}

/// Returns the resolution of a JFIF header behind its name: version, unit and two numbers of pixels.
fn of_jfif(header: &[u8]) -> Option<[f64; 2]> {
    let [_, _, unit, x0, x1, y0, y1, ..] = *header else {
        return None;
    };
    let per_inch = match unit {
        1 => 1.0,
        2 => CM_PER_INCH,
        _ => return None,
    };
    Some([[x0, x1], [y0, y1]].map(|side| f64::from(u16::from_be_bytes(side)) * per_inch))
}

fn of_exif(block: &[u8]) -> Option<[f64; 2]> {
    let block = orientation::without_prefix(block);
    let directory = TaggedFile::new(&block)?.first_directory()?;
    of_tags(|tag| directory.values(tag))
}

/// Returns the resolution in tags, which are per inch unless they say otherwise.
fn of_tags<'b>(values: impl Fn(u64) -> Option<TagValues<'b>>) -> Option<[f64; 2]> {
    let number = |tag| values(tag)?.ratio(0);
    let unit = number(RESOLUTION_UNIT).unwrap_or(INCH);
    let per_inch = if unit == INCH {
        1.0
    } else if unit == CENTIMETRE {
        CM_PER_INCH
    } else {
        return None;
    };
    Some([
        number(X_RESOLUTION)? * per_inch,
        number(Y_RESOLUTION)? * per_inch,
    ])
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::{file_dpi, stated_dpi};

    /// Returns a block of tags in the byte order of Intel: a resolution of `x` and `y` tenths, a unit and an orientation.
    fn tags(x: u32, y: u32, unit: Option<u16>, orientation: u16) -> Vec<u8> {
        let short = |tag: u16, value: u16| {
            let value = u32::from(value).to_le_bytes();
            [&tag.to_le_bytes()[..], &[3, 0], &[1, 0, 0, 0], &value].concat()
        };
        let mut entries = vec![short(274, orientation)];
        let count = 3 + usize::from(unit.is_some());
        let behind = (8 + 2 + 12 * count + 4) as u32;
        for (tag, at) in [(282_u16, behind), (283, behind + 8)] {
            entries.push(
                [
                    &tag.to_le_bytes()[..],
                    &[5, 0],
                    &[1, 0, 0, 0],
                    &at.to_le_bytes(),
                ]
                .concat(),
            );
        }
        entries.extend(unit.map(|unit| short(296, unit)));
        let ratios = [x, 10, y, 10].map(u32::to_le_bytes).concat();
        let count = (count as u16).to_le_bytes();
        [
            b"II\x2a\0\x08\0\0\0",
            &count[..],
            &entries.concat(),
            &[0; 4],
            &ratios,
        ]
        .concat()
    }

    fn png(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        for (kind, body) in chunks {
            let len = (body.len() as u32).to_be_bytes();
            file.extend([&len[..], &kind[..], body, &[0; 4]].concat());
        }
        file
    }

    fn jpeg(segments: &[(u8, Vec<u8>)]) -> Vec<u8> {
        let mut file = b"\xff\xd8".to_vec();
        for (marker, body) in segments {
            let len = (body.len() as u16 + 2).to_be_bytes();
            file.extend([&[0xff, *marker], &len[..], body].concat());
        }
        file
    }

    fn phys(x: u32, y: u32, unit: u8) -> Vec<u8> {
        [&x.to_be_bytes()[..], &y.to_be_bytes(), &[unit]].concat()
    }

    fn jfif(unit: u8, x: u16, y: u16) -> (u8, Vec<u8>) {
        let sides = [x.to_be_bytes(), y.to_be_bytes()].concat();
        (
            0xe0,
            [b"JFIF\0\x01\x02", &[unit][..], &sides, &[0, 0]].concat(),
        )
    }

    fn exif(block: &[u8]) -> (u8, Vec<u8>) {
        (0xe1, [b"Exif\0\0", block].concat())
    }

    #[test]
    fn every_place_of_a_resolution_is_read_in_its_unit() {
        let block = tags(3000, 6000, Some(2), 1);
        for (file, expected) in [
            (png(&[(b"pHYs", &phys(10_000, 20_000, 1))]), [254.0, 508.0]),
            (png(&[(b"eXIf", &block)]), [300.0, 600.0]),
            (jpeg(&[jfif(1, 300, 600)]), [300.0, 600.0]),
            (jpeg(&[jfif(2, 100, 200)]), [254.0, 508.0]),
            (jpeg(&[jfif(0, 1, 1), exif(&block)]), [300.0, 600.0]),
            (jpeg(&[jfif(1, 72, 72), exif(&block)]), [72.0, 72.0]),
            (block.clone(), [300.0, 600.0]),
            (tags(3000, 6000, None, 1), [300.0, 600.0]),
            (tags(1000, 2000, Some(3), 1), [254.0, 508.0]),
        ] {
            let found = stated_dpi(&file).expect("a resolution");
            assert_eq!(file_dpi(Cursor::new(&file)), Some(found));
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }

    #[test]
    fn the_resolution_turns_with_the_image() {
        for orientation in 1..=8 {
            let block = tags(3000, 6000, Some(2), orientation);
            let expected = if orientation < 5 {
                [300.0, 600.0]
            } else {
                [600.0, 300.0]
            };
            for file in [
                block.clone(),
                jpeg(&[jfif(1, 300, 600), exif(&block)]),
                png(&[(b"eXIf", &block)]),
            ] {
                assert_eq!(stated_dpi(&file), Some(expected), "{orientation}");
                assert_eq!(file_dpi(Cursor::new(&file)), Some(expected));
            }
        }
    }

    #[test]
    fn a_resolution_without_a_unit_or_a_number_does_not_count() {
        for file in [
            png(&[(b"pHYs", &phys(10_000, 10_000, 0))]),
            png(&[(b"pHYs", &phys(0, 10_000, 1))]),
            png(&[(b"pHYs", &phys(1, 1, 1)[..8])]),
            png(&[]),
            jpeg(&[jfif(0, 1, 1)]),
            jpeg(&[]),
            tags(3000, 3000, Some(1), 1),
            tags(0, 3000, Some(2), 1),
            tags(3000, 3000, Some(2), 1)[..60].to_vec(),
            b"text".to_vec(),
            Vec::new(),
        ] {
            assert_eq!(stated_dpi(&file), None, "{file:?}");
            assert_eq!(file_dpi(Cursor::new(&file)), None, "{file:?}");
        }
    }
}
