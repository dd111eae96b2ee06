//! Decoder of print images: PNG, JPEG and TIFF, recognised by their content.

mod colour_profile;
mod error;
mod header_size;
mod jpeg;
mod light_curve;
mod limits;
mod orientation;
mod png_chunks;
mod print_image;
mod resolution;
mod samples;
mod tags;
mod tiff;

use std::io::{BufRead, Cursor, Seek};

use flate2::Crc;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use crate::domain::cancel::PolledReader;
use crate::domain::{FileKind, are_zeros};

use colour_profile::FileProfile;
use error::{broken, damaged};
use light_curve::LightCurve;
use orientation::StatedOrientation;
use png_chunks::png_colour_chunk;
use print_image::{colours_on_white, widen_narrow};
use tags::TagFileWindow;

pub use error::DecodeError;
pub use header_size::header_size;
pub use limits::ImageLimits;
pub(super) use png_chunks::{png_chunks, png_text};
pub use print_image::{PrintImage, profile_warning};
pub use resolution::{file_dpi, stated_dpi};
pub use samples::{PrintSamples, SampleSlice};

/// Decodes a grey, RGB or palette image of a print. Transparent pixels are composited on white.
///
/// The image is returned upright: an EXIF orientation is applied. The size in the header is checked before any pixel is
/// decoded.
///
/// ```
/// use mocban_core::raster::{Grid, ImageLimits, decode, png_rgb8};
///
/// let png = png_rgb8(&Grid::new(2, 1, [255, 0, 51]));
/// let image = decode(&png, &ImageLimits::SUGGESTED)?;
/// assert_eq!(image.rgb.at(1, 0), [65535, 0, 51 * 257]);
/// # Ok::<(), mocban_core::raster::DecodeError>(())
/// ```
///
/// # Errors
/// Returns an error if the bytes are not a complete PNG, JPEG or TIFF image, or exceed the limits.
pub fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<PrintImage, DecodeError> {
    limits.check_bytes(bytes.len() as u64)?;
    let (rgb, orientation, profile, curve) = match FileKind::of(bytes) {
        FileKind::Tiff => {
            let image = tiff::decode(bytes, limits)?;
            let orientation = orientation::of_tag(image.orientation);
            (image.rgb, orientation, image.profile, image.light_curve)
        }
        FileKind::Png => {
            let (pixels, profile) = decode_png(bytes, limits)?;
            let has_16_bits = matches!(
                pixels,
                DynamicImage::ImageLuma16(_) | DynamicImage::ImageRgb16(_)
            );
            let mut rgb = colours_on_white(pixels);
            if has_16_bits {
                rgb.change(|rgb| widen_narrow(rgb, false));
            }
            let stated = StatedOrientation::of_png(bytes);
            let curve = LightCurve::of_png(bytes);
            (rgb, stated.orientation(), profile, curve)
        }
        FileKind::Jpeg => {
            let image = jpeg::decode(bytes, limits)?;
            (image.rgb, image.orientation, image.profile, None)
        }
        _ if are_zeros(bytes) => return Err(DecodeError::OnlyZeros),
        other => return Err(DecodeError::NotAnImage(other)),
    };
    let mut image = PrintImage {
        rgb: orientation::upright(rgb, orientation),
        turned: Some(orientation.to_exif()).filter(|number| *number != 1),
        ignored_profile: None,
    };
    let applied = match (profile, curve) {
        (Some(profile), _) => profile.apply(&mut image.rgb),
        (None, Some(curve)) => curve.apply(&mut image.rgb),
        (None, None) => Ok(()),
    };
    image.ignored_profile = applied.err();
    Ok(image)
}

/// Returns the number of pixels according to an image's header, or `None` if the header cannot be read.
pub fn header_pixel_count(mut file: impl BufRead + Seek) -> Option<u64> {
    if FileKind::of(file.fill_buf().ok()?) == FileKind::Tiff {
        return tiff::pixel_count(&TagFileWindow::new(file));
    }
    let reader = ImageReader::new(file).with_guessed_format().ok()?;
    let (width, height) = reader.into_dimensions().ok()?;
    Some(u64::from(width) * u64::from(height))
}

/// Checks the size at its fixed offset in a PNG, because the decoder first reads all chunks that precede the pixels.
fn check_png_header(bytes: &[u8], limits: &ImageLimits) -> Result<(), DecodeError> {
    let side = |at: usize| {
        let field = bytes.get(at..).and_then(|rest| rest.first_chunk());
        let side = field.map(|field| u32::from_be_bytes(*field));
        side.ok_or(DecodeError::Truncated(FileKind::Png))
    };
    let checked = limits.check_size(side(16)?, side(20)?);
    checked.map_err(|error| {
        let mut checksum = Crc::new();
        checksum.update(bytes.get(12..29).unwrap_or_default());
        match side(29) {
            Ok(stored) if stored != checksum.sum() => {
                damaged(FileKind::Png, "a wrong checksum of its header")
            }
            _ => error,
        }
    })
}

/// Decodes the pixels of a PNG in stored order, and returns them with its ICC profile.
fn decode_png(
    bytes: &[u8],
    limits: &ImageLimits,
) -> Result<(DynamicImage, Option<FileProfile>), DecodeError> {
    check_png_header(bytes, limits)?;
    let source = PolledReader(Cursor::new(bytes));
    let mut reader = ImageReader::with_format(source, ImageFormat::Png);
    let mut memory = image::Limits::no_limits();
    memory.max_alloc = Some(limits.max_decoder_bytes());
    reader.limits(memory);
    let mut decoder = reader
        .into_decoder()
        .map_err(|error| png_error(&error, bytes))?;
    // The decoder skips a profile that it cannot decompress, and reads one behind the palette.
    let profile = png_colour_chunk(bytes, *b"iCCP")
        .map(|_| decoder.icc_profile().ok().flatten().unwrap_or_default());
    let pixels = DynamicImage::from_decoder(decoder).map_err(|error| png_error(&error, bytes))?;
    let profile = profile.map(|bytes| FileProfile {
        bytes,
        is_of_inks: false,
    });
    Ok((pixels, profile))
}

/// Bytes at the end of a PNG that are not all zero. Those of a file that was not written to its end may be.
const PNG_END: usize = 12;

/// Begins what the decoder says of a PNG.
const DECODER_WORDS: &str = "Format error decoding Png: ";

fn png_error(error: &ImageError, bytes: &[u8]) -> DecodeError {
    let reason = error.to_string();
    let early_end = match error {
        ImageError::IoError(io) => io.kind() == std::io::ErrorKind::UnexpectedEof,
        _ => reason.contains("unexpected end of file") || reason.contains("UnexpectedEof"),
    };
    if early_end || bytes.ends_with(&[0; PNG_END]) {
        return DecodeError::Truncated(FileKind::Png);
    }
    match error {
        ImageError::Unsupported(_) | ImageError::Limits(_) => broken(FileKind::Png, &reason),
        _ => {
            let found = reason.strip_prefix(DECODER_WORDS).unwrap_or(&reason);
            damaged(FileKind::Png, found)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{DynamicImage, ImageFormat};
    use proptest::prelude::*;

    use super::error::{broken, damaged};
    use super::{DecodeError, decode};

    #[test]
    fn decoder_messages_are_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(161)] {
            let said = broken(FileKind::of(b""), &rude).to_string();
            assert!(!said.contains(&rude), "{said:?}");
        }
    }

    use crate::domain::FileKind;
    use crate::raster::ImageLimits;
    use crate::raster::test_images::encoded_chunk;

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
        let [width, height] = [width, height].map(u32::to_be_bytes);
        let header = [&width[..], &height, &[8, 0, 0, 0, 0]].concat();
        let chunk = encoded_chunk(*b"IHDR", &header);
        [&b"\x89PNG\r\n\x1a\n"[..], &chunk].concat()
    }

    #[test]
    fn a_damaged_profile_of_a_png_is_named() {
        let plain = file(&DynamicImage::ImageLuma8(grey_ramp()), ImageFormat::Png);
        let chunk = encoded_chunk(*b"iCCP", b"name\0\0no profile");
        // The first chunk, with the size, ends here.
        let (head, rest) = plain.split_at(33);
        let read = decode(&[head, &chunk, rest].concat(), &LIMITS).expect("decodes");
        let wanted = "an ICC profile that cannot be read";
        assert_eq!(read.ignored_profile.as_deref(), Some(wanted));
        assert_eq!(read.rgb, decode(&plain, &LIMITS).expect("decodes").rgb);
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
    fn transparency_is_white() {
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
        assert_eq!(
            picture.rgb.to_rgb16().data(),
            [[0; 3], [65535; 3], [0; 3], [65535; 3]]
        );
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
    fn error_names_the_type_of_other_files() {
        assert_eq!(decode(b"", &LIMITS), Err(DecodeError::Empty));
        assert_eq!(decode(&[0; 700], &LIMITS), Err(DecodeError::OnlyZeros));
        assert_eq!(
            decode(b"id,mesh,print\n", &LIMITS),
            Err(DecodeError::NotAnImage(FileKind::Text))
        );
        for (bytes, says) in [
            (
                &b"GIF89a\x01\0\x01\0\x80.."[..],
                "the file is a GIF image; PNG, JPEG and TIFF images are read: convert it, such as \
                with ImageMagick: `magick mogrify -format png FILE`, and use the new file",
            ),
            (
                b"%PDF-1.7\n",
                "the file is a PDF document; PNG, JPEG and TIFF images are read: open them in a program and save \
                their pages as PNG; for many files: `pdftoppm -r 600 -png FILE.pdf page`",
            ),
            (
                b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n",
                "the file is a pointer of Git LFS \
                and does not hold the image; fetch the image with `git lfs pull`",
            ),
        ] {
            assert_eq!(
                decode(bytes, &LIMITS).expect_err("not read").to_string(),
                says
            );
        }
    }

    #[test]
    fn damaged_images_are_named_with_what_to_do() {
        let rgb = image::RgbImage::from_fn(64, 64, |x, y| {
            image::Rgb([(x * 37 % 251) as u8, (y * x % 83) as u8, (y * 7) as u8])
        });
        let whole = file(&DynamicImage::ImageRgb8(rgb), ImageFormat::Png);
        let middle = whole.len() / 2;
        // In the data, and in the width.
        for at in [middle, 16] {
            let mut bytes = whole.clone();
            bytes[at] ^= 0xff;
            let said = decode(&bytes, &LIMITS).expect_err("damaged").to_string();
            let start = "the PNG image is damaged; copy it again, or open it in another program and save it as PNG (the \
                         decoder found: ";
            assert!(said.starts_with(start), "{said}");
            assert!(!said.contains("Format error"), "{said}");
        }
        assert_eq!(
            damaged(FileKind::Tiff, "a; b.").to_string(),
            "the TIFF image is damaged; copy it again, or open it in another program and save it as PNG (the decoder \
             found: a, b)"
        );
    }

    #[test]
    fn truncated_images_are_reported_as_such() {
        for (format, kind) in [
            (ImageFormat::Png, FileKind::Png),
            (ImageFormat::Jpeg, FileKind::Jpeg),
            (ImageFormat::Tiff, FileKind::Tiff),
        ] {
            let whole = file(&DynamicImage::ImageLuma8(grey_ramp()), format);
            let picture = decode(&whole, &LIMITS).expect("decodes");
            for len in 1..whole.len() {
                // A PNG or JPEG is complete once its pixels are, even without its last chunk or its end marker.
                if let Ok(cut) = decode(&whole[..len], &LIMITS) {
                    let has_pixels = kind != FileKind::Tiff && len + 16 >= whole.len();
                    assert!(has_pixels && cut == picture, "{format:?} of {len} bytes");
                }
            }
            let half = &whole[..whole.len() / 2];
            let error = decode(half, &LIMITS);
            assert_eq!(error, Err(DecodeError::Truncated(kind)), "{format:?}");
            if kind == FileKind::Png {
                let zeros = vec![0; whole.len() - half.len()];
                let error = decode(&[half, &zeros].concat(), &LIMITS);
                assert_eq!(error, Err(DecodeError::Truncated(kind)));
            }
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
                prop_assert!((picture.rgb.width() * picture.rgb.height()) as u64 <= LIMITS.max_pixels);
            }
        }
    }
}
