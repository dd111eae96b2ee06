//! Print images into [`PrintImage`]s: PNG, JPEG and TIFF told apart by content, never by name.

mod error;
mod tiff;

use std::io::{BufRead, Cursor, Seek};

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::{Grid, ImageLimits, PrintImage};
use crate::domain::{FileKind, sanitize};

pub use error::DecodeError;

/// Decodes a print image: grey, RGB or a palette, with or without transparency, which is laid on white paper.
///
/// The image is taken as given: an EXIF orientation is not applied, so that print pixels mean the same to every
/// program. The header's size is checked before any pixel is decoded.
///
/// # Errors
/// When the bytes are no whole PNG, JPEG or TIFF image, or exceed the limits.
pub fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<PrintImage, DecodeError> {
    let kind = kind_within_limits(bytes, limits)?;
    let format = format_of(kind)?;
    if kind == FileKind::Png {
        check_png_header(bytes, limits)?;
    }
    let rgb = colours(bytes, format, kind, limits)?;
    Ok(PrintImage { rgb })
}

/// How many pixels the header of an image promises; `None` where it does not tell.
pub fn header_pixel_count(file: impl BufRead + Seek) -> Option<u64> {
    let reader = ImageReader::new(file).with_guessed_format().ok()?;
    let (width, height) = reader.into_dimensions().ok()?;
    Some(u64::from(width) * u64::from(height))
}

fn colours(
    bytes: &[u8],
    format: ImageFormat,
    kind: FileKind,
    limits: &ImageLimits,
) -> Result<Grid<[u16; 3]>, DecodeError> {
    if kind == FileKind::Tiff
        && let Some(colours) = tiff::rare(bytes, limits)?
    {
        return Ok(colours);
    }
    let image = decode_pixels(bytes, format, kind, limits)?;
    Ok(colours_on_white(&image))
}

fn kind_within_limits(bytes: &[u8], limits: &ImageLimits) -> Result<FileKind, DecodeError> {
    let size = bytes.len() as u64;
    if size == 0 {
        return Err(DecodeError::Empty);
    }
    if size > limits.max_bytes {
        return Err(DecodeError::TooManyBytes {
            bytes: size,
            limit: limits.max_bytes,
        });
    }
    Ok(FileKind::of(bytes))
}

fn format_of(kind: FileKind) -> Result<ImageFormat, DecodeError> {
    match kind {
        FileKind::Png => Ok(ImageFormat::Png),
        FileKind::Jpeg => Ok(ImageFormat::Jpeg),
        FileKind::Tiff => Ok(ImageFormat::Tiff),
        FileKind::OtherImage(_)
        | FileKind::Ply
        | FileKind::OtherMesh(_)
        | FileKind::Other(_)
        | FileKind::Text
        | FileKind::Binary => Err(DecodeError::NotAnImage(kind)),
    }
}

/// A PNG's size stands at a fixed place, and is checked there: its decoder wants to see pixels first.
fn check_png_header(bytes: &[u8], limits: &ImageLimits) -> Result<(), DecodeError> {
    let side = |at: usize| {
        let field = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        field
            .map(u32::from_be_bytes)
            .ok_or(DecodeError::Truncated(FileKind::Png))
    };
    check_size(side(16)?, side(20)?, limits)
}

fn check_size(width: u32, height: u32, limits: &ImageLimits) -> Result<(), DecodeError> {
    if width == 0 || height == 0 {
        return Err(DecodeError::NoPixels { width, height });
    }
    if u64::from(width) * u64::from(height) > limits.max_pixels {
        return Err(DecodeError::TooManyPixels {
            width,
            height,
            limit: limits.max_pixels,
        });
    }
    Ok(())
}

fn decode_pixels(
    bytes: &[u8],
    format: ImageFormat,
    kind: FileKind,
    limits: &ImageLimits,
) -> Result<DynamicImage, DecodeError> {
    let whole = kind != FileKind::Jpeg || has_end_marker(bytes);
    let refused = |error: ImageError| {
        if whole {
            decoder_error(kind, &error)
        } else {
            DecodeError::Truncated(kind)
        }
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut memory = image::Limits::no_limits();
    // Sixteen bytes are the widest pixel a decoder hands over; the rest is for its own tables.
    memory.max_alloc = Some(
        limits
            .max_pixels
            .saturating_mul(16)
            .saturating_add(64 << 20),
    );
    reader.limits(memory);
    let decoder = reader.into_decoder().map_err(refused)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, limits)?;
    if !whole {
        return Err(DecodeError::Truncated(kind));
    }
    DynamicImage::from_decoder(decoder).map_err(refused)
}

fn decoder_error(kind: FileKind, error: &ImageError) -> DecodeError {
    let reason = error.to_string();
    let early_end = match error {
        ImageError::IoError(io) => io.kind() == std::io::ErrorKind::UnexpectedEof,
        _ => reason.contains("unexpected end of file") || reason.contains("UnexpectedEof"),
    };
    if early_end {
        return DecodeError::Truncated(kind);
    }
    broken(kind, &reason)
}

/// The decoder's words on one line; some list all they found.
fn broken(kind: FileKind, reason: &str) -> DecodeError {
    DecodeError::Broken {
        kind,
        reason: sanitize(reason, 160),
    }
}

/// Whether a JPEG's own segments lead to its end marker. The decoder fills what a truncated file lacks with grey,
/// and a thumbnail has an end marker of its own, so the segments are walked.
fn has_end_marker(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(marker) = bytes.get(at..at + 2) {
        match (marker[0], marker[1]) {
            (0xff, 0xd9) => return true,
            (0xff, 0xff | 0x00 | 0x01 | 0xd0..=0xd8) => at += 1,
            (0xff, _) => match bytes.get(at + 2..at + 4) {
                Some(length) => at += 2 + usize::from(u16::from_be_bytes([length[0], length[1]])),
                None => return false,
            },
            // Coded pixels: on to the next byte that may begin a marker.
            _ => match bytes[at..].iter().position(|byte| *byte == 0xff) {
                Some(step) => at += step,
                None => return false,
            },
        }
    }
    false
}

/// Laid on white: `c a + 65535 (65535 - a)`, over 65535, rounded.
fn on_white([c @ .., a]: [u16; 4]) -> [u16; 3] {
    const FULL: u64 = u16::MAX as u64;
    let a = u64::from(a);
    c.map(|c| ((u64::from(c) * a + FULL * (FULL - a) + FULL / 2) / FULL) as u16)
}

const fn wide(value: u8) -> u16 {
    value as u16 * 257
}

fn colours_on_white(image: &DynamicImage) -> Grid<[u16; 3]> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let colours = match image {
        DynamicImage::ImageLuma8(i) => i.pixels().map(|p| [wide(p[0]); 3]).collect(),
        DynamicImage::ImageRgb8(i) => i.pixels().map(|p| p.0.map(wide)).collect(),
        DynamicImage::ImageLuma16(i) => i.pixels().map(|p| [p[0]; 3]).collect(),
        DynamicImage::ImageRgb16(i) => i.pixels().map(|p| p.0).collect(),
        DynamicImage::ImageLumaA8(i) => {
            let grey = |p: &image::LumaA<u8>| {
                let [l, a] = p.0.map(wide);
                on_white([l, l, l, a])
            };
            i.pixels().map(grey).collect()
        }
        DynamicImage::ImageRgba8(i) => i.pixels().map(|p| on_white(p.0.map(wide))).collect(),
        // The rest is rare enough for a copy: 16 bits with transparency, 32-bit floats in 0..=1.
        other => other.to_rgba16().pixels().map(|p| on_white(p.0)).collect(),
    };
    // An image of w x h pixels yields as many colours.
    Grid::from_vec(width, height, colours).expect("one colour for each pixel")
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{DynamicImage, ImageFormat};
    use proptest::prelude::*;

    use super::{DecodeError, broken, decode};

    #[test]
    fn words_of_a_decoder_come_plain_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(161)] {
            let said = broken(FileKind::of(b""), &rude).to_string();
            assert!(!said.contains(&rude), "{said:?}");
        }
    }

    use crate::domain::FileKind;
    use crate::raster::ImageLimits;

    const LIMITS: ImageLimits = ImageLimits {
        max_bytes: 1 << 20,
        max_pixels: 10_000,
    };

    fn file(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, format).expect("encodes");
        out.into_inner()
    }

    fn grey_ramp() -> image::GrayImage {
        image::GrayImage::from_fn(16, 9, |x, y| image::Luma([(x * 16 + y) as u8]))
    }

    fn png_header(width: u32, height: u32) -> Vec<u8> {
        let mut body = b"IHDR".to_vec();
        body.extend(width.to_be_bytes());
        body.extend(height.to_be_bytes());
        body.extend([8, 0, 0, 0, 0]);
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
        bytes.extend(&body);
        bytes.extend(crc32(&body).to_be_bytes());
        bytes
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |c, _| {
                (c >> 1) ^ (0xedb8_8320 & (c & 1).wrapping_neg())
            })
        })
    }

    #[test]
    fn eight_and_sixteen_bits_give_the_same_grey() {
        let narrow = DynamicImage::ImageLuma8(grey_ramp());
        let wide = DynamicImage::ImageLuma16(narrow.to_luma16());
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            let a = decode(&file(&narrow, format), &LIMITS).expect("decodes");
            let b = decode(&file(&wide, format), &LIMITS).expect("decodes");
            assert_eq!(a, b, "{format:?}");
            assert_eq!(a.rgb.at(15, 8), [248 * 257; 3]);
        }
    }

    #[test]
    fn colours_survive_without_loss() {
        let rgb = image::RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8, y as u8, 200]));
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            let bytes = file(&DynamicImage::ImageRgb8(rgb.clone()), format);
            let picture = decode(&bytes, &LIMITS).expect("decodes");
            assert_eq!(picture.rgb.at(6, 4), [6 * 257, 4 * 257, 200 * 257]);
        }
    }

    #[test]
    fn transparency_is_paper() {
        let at = |a| image::RgbaImage::from_pixel(2, 2, image::Rgba([0, 255, 0, a]));
        let read = |a| {
            let bytes = file(&DynamicImage::ImageRgba8(at(a)), ImageFormat::Png);
            decode(&bytes, &LIMITS).expect("decodes").rgb.at(1, 1)
        };
        assert_eq!(read(0), [65535; 3]);
        assert_eq!(read(255), [0, 65535, 0]);
        assert_eq!(read(51), [52428, 65535, 52428]);
        let grey = image::GrayAlphaImage::from_pixel(2, 2, image::LumaA([0, 0]));
        let bytes = file(&DynamicImage::ImageLumaA8(grey), ImageFormat::Png);
        assert_eq!(
            decode(&bytes, &LIMITS).expect("decodes").rgb.at(0, 0),
            [65535; 3]
        );
    }

    #[test]
    fn palette_and_one_bit_images_decode() {
        let encode = |depth, palette: Option<&[u8]>, data: &[u8]| {
            let mut out = Vec::new();
            let mut encoder = png::Encoder::new(&mut out, 4, 1);
            encoder.set_depth(depth);
            encoder.set_color(match palette {
                Some(_) => png::ColorType::Indexed,
                None => png::ColorType::Grayscale,
            });
            if let Some(colours) = palette {
                encoder.set_palette(colours.to_vec());
            }
            let mut writer = encoder.write_header().expect("writes");
            writer.write_image_data(data).expect("writes");
            writer.finish().expect("writes");
            out
        };
        let one_bit = encode(png::BitDepth::One, None, &[0b0101_0000]);
        let picture = decode(&one_bit, &LIMITS).expect("decodes");
        assert_eq!(picture.rgb.data(), [[0; 3], [65535; 3], [0; 3], [65535; 3]]);
        let colours = [255, 0, 0, 0, 0, 255];
        let indexed = encode(png::BitDepth::Two, Some(&colours), &[0b0001_0001]);
        let picture = decode(&indexed, &LIMITS).expect("decodes");
        assert_eq!(picture.rgb.at(1, 0), [0, 0, 65535]);
    }

    #[test]
    fn huge_header_is_refused_before_decoding() {
        for bytes in [png_header(60_000, 60_000), {
            let mut jpeg = file(&DynamicImage::ImageLuma8(grey_ramp()), ImageFormat::Jpeg);
            let frame = jpeg
                .windows(2)
                .position(|w| w == [0xff, 0xc0])
                .expect("SOF");
            jpeg[frame + 5..frame + 9].copy_from_slice(&[0xea, 0x60, 0xea, 0x60]);
            jpeg
        }] {
            let error = decode(&bytes, &LIMITS).expect_err("refused");
            assert_eq!(
                error.to_string(),
                "the image is 60000 x 60000 pixels; limits.image.max_pixels is 10000"
            );
        }
    }

    #[test]
    fn image_without_pixels_is_refused() {
        assert_eq!(
            decode(&png_header(0, 5), &LIMITS),
            Err(DecodeError::NoPixels {
                width: 0,
                height: 5
            })
        );
    }

    #[test]
    fn what_is_no_image_is_named() {
        assert_eq!(decode(b"", &LIMITS), Err(DecodeError::Empty));
        assert_eq!(
            decode(b"id,mesh,print\n", &LIMITS),
            Err(DecodeError::NotAnImage(FileKind::Text))
        );
        let error = decode(b"GIF89a......", &LIMITS).expect_err("not read");
        assert_eq!(
            error.to_string(),
            "the file is a GIF image; PNG, JPEG and TIFF images are read"
        );
    }

    #[test]
    fn truncated_images_say_so() {
        for (format, kind) in [
            (ImageFormat::Png, FileKind::Png),
            (ImageFormat::Jpeg, FileKind::Jpeg),
            (ImageFormat::Tiff, FileKind::Tiff),
        ] {
            let whole = file(&DynamicImage::ImageLuma8(grey_ramp()), format);
            assert!(decode(&whole, &LIMITS).is_ok(), "{format:?}");
            for len in 1..whole.len() {
                let error = decode(&whole[..len], &LIMITS);
                // A PNG is whole once its pixels are there, whatever its last chunk.
                if kind == FileKind::Png && len + 16 >= whole.len() {
                    continue;
                }
                assert!(error.is_err(), "{format:?} of {len} bytes");
            }
            let error = decode(&whole[..whole.len() / 2], &LIMITS);
            assert_eq!(error, Err(DecodeError::Truncated(kind)), "{format:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn flipped_bytes_never_panic(
            format in prop_oneof![
                Just(ImageFormat::Png), Just(ImageFormat::Jpeg), Just(ImageFormat::Tiff)
            ],
            flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        ) {
            let mut bytes = file(&DynamicImage::ImageLuma8(grey_ramp()), format);
            for (at, value) in flips {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if let Ok(picture) = decode(&bytes, &LIMITS) {
                prop_assert!(picture.rgb.data().len() as u64 <= LIMITS.max_pixels);
            }
        }
    }
}
