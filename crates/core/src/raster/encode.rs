//! Encodes and decodes artifacts as lossless PNG, and encodes images for viewing as JPEG. Equal grids give equal bytes.

use std::io::{Cursor, Write as _};

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

use super::{Grid, Mask};
use crate::domain::cancel::{PolledReader, poll};

/// Most pixels of a map that is read back: 16,384 x 16,384. No stage makes a larger one.
const MAX_MAP_PIXELS: u64 = 1 << 28;
/// Most pixels of a mask that is read back. Masks have the size of prints, which `limits.image.max_pixels` limits to this.
const MAX_MASK_PIXELS: u64 = 1_000_000_000;
/// Most bytes that one byte of a PNG decodes to: the highest ratio of deflate (RFC 1951).
const MAX_DEFLATE_RATIO: u64 = 1032;

/// Why an artifact could not be read back.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// More pixels than any map or mask has.
    #[error(
        "the PNG is {width} x {height} pixels, and the largest that a stage stores has {limit} pixels"
    )]
    TooLarge {
        /// Columns in the header.
        width: u32,
        /// Rows in the header.
        height: u32,
        /// Largest number of pixels.
        limit: u64,
    },
    /// More pixels than a file of this length can hold.
    #[error("the PNG of {bytes} bytes is too short for its {width} x {height} pixels")]
    TooShort {
        /// Columns in the header.
        width: u32,
        /// Rows in the header.
        height: u32,
        /// Length of the file.
        bytes: usize,
    },
    /// Not a complete PNG.
    #[error("the PNG is damaged: {0}")]
    Damaged(#[from] png::DecodingError),
    /// A PNG of another kind than expected.
    #[error("the PNG holds {found:?} of {bits:?} bits, not grey of {wanted} bits")]
    Kind {
        /// Colour type found.
        found: png::ColorType,
        /// Bits per channel found.
        bits: png::BitDepth,
        /// Bits per channel expected.
        wanted: u8,
    },
}

/// Encodes a grid as a 16-bit grey PNG.
///
/// ```
/// use mocban_core::raster::{Grid, decode_grey16, png_grey16};
///
/// let levels = Grid::from_fn(3, 2, |x, y| (1000 * x + y) as u16);
/// assert_eq!(decode_grey16(&png_grey16(&levels))?, levels);
/// # Ok::<(), mocban_core::raster::PngError>(())
/// ```
///
/// # Panics
/// Panics if the grid has no pixels, as every encoder of this module does. Every stage produces grids with pixels.
pub fn png_grey16(grid: &Grid<u16>) -> Vec<u8> {
    let mut samples = Vec::with_capacity(2 * grid.data().len());
    for part in grid.data().chunks(SAMPLES_PER_POLL) {
        poll();
        samples.extend(part.iter().flat_map(|v| v.to_be_bytes()));
    }
    png_of(
        grid,
        png::ColorType::Grayscale,
        png::BitDepth::Sixteen,
        &samples,
    )
}

/// Encodes a grid as an 8-bit grey PNG.
pub fn png_grey8(grid: &Grid<u8>) -> Vec<u8> {
    png_of(
        grid,
        png::ColorType::Grayscale,
        png::BitDepth::Eight,
        grid.data(),
    )
}

/// Encodes a mask as an 8-bit grey PNG: 255 where it is set (stroke), 0 elsewhere.
///
/// ```
/// use mocban_core::raster::{Mask, decode_grey8, png_mask};
///
/// let mask = Mask::from_fn(4, 4, |x, y| x == y);
/// let png = png_mask(&mask);
/// assert_eq!(decode_grey8(&png)?, mask.map(|set| if *set { 255 } else { 0 }));
/// # Ok::<(), mocban_core::raster::PngError>(())
/// ```
pub fn png_mask(mask: &Mask) -> Vec<u8> {
    png_grey8(&mask.map(|set| if *set { 255 } else { 0 }))
}

/// Encodes a grid as an 8-bit RGB PNG.
pub fn png_rgb8(grid: &Grid<[u8; 3]>) -> Vec<u8> {
    let samples = grid.data().as_flattened();
    png_of(grid, png::ColorType::Rgb, png::BitDepth::Eight, samples)
}

/// Encodes like [`png_rgb8`], and names what made the file in a text chunk `Software` behind the header. `software` is ASCII.
///
/// ```
/// use mocban_core::raster::{Grid, png_rgb8_of};
///
/// let png = png_rgb8_of(&Grid::new(2, 2, [9, 80, 7]), "a program");
/// assert!(png.windows(18).any(|part| part == b"Software\0a program"));
/// ```
pub fn png_rgb8_of(grid: &Grid<[u8; 3]>, software: &str) -> Vec<u8> {
    encode(
        grid,
        (png::ColorType::Rgb, png::BitDepth::Eight),
        grid.data().as_flattened(),
        png::DeflateCompression::FdeflateUltraFast,
        Some(software),
    )
}

/// Encodes like [`png_rgb8`] a sixth smaller and five times as slowly, for pictures in which pixels are repeated.
///
/// ```
/// use mocban_core::raster::{Grid, ImageLimits, compact_rgb8, decode, png_rgb8};
///
/// let enlarged = Grid::from_fn(400, 300, |x, y| [(37 * (x / 4) * (y / 4) % 251) as u8, 80, 9]);
/// let png = compact_rgb8(&enlarged);
/// assert!(png.len() < png_rgb8(&enlarged).len());
/// let read = decode(&png, &ImageLimits::SUGGESTED)?.rgb;
/// assert_eq!(*read.to_rgb8(), enlarged);
/// # Ok::<(), mocban_core::raster::DecodeError>(())
/// ```
pub fn compact_rgb8(grid: &Grid<[u8; 3]>) -> Vec<u8> {
    encode(
        grid,
        (png::ColorType::Rgb, png::BitDepth::Eight),
        grid.data().as_flattened(),
        png::DeflateCompression::Level(2),
        None,
    )
}

/// Encodes a grid as an 8-bit RGB JPEG of quality 1..=100, for viewing.
pub fn jpeg_rgb8(grid: &Grid<[u8; 3]>, quality: u8) -> Vec<u8> {
    let mut out = Vec::new();
    let (width, height) = (grid.width() as u32, grid.height() as u32);
    let samples = grid.data().as_flattened();
    JpegEncoder::new_with_quality(&mut out, quality)
        .encode(samples, width, height, ExtendedColorType::Rgb8)
        .expect("a grid with pixels is written to memory");
    out
}

/// Images of at least this many bytes are encoded row by row, so that a cancellation is noticed. 4 MiB take about 6 ms, and
/// 30 ms with [`compact_rgb8`].
const STREAMED_BYTES: usize = 4 << 20;
/// Samples that are converted between two polls for a cancellation.
const SAMPLES_PER_POLL: usize = 1 << 16;
/// Length of the chunks of such images.
const STREAMED_CHUNK: usize = 1 << 20;

fn png_of<T: Copy>(
    grid: &Grid<T>,
    color: png::ColorType,
    depth: png::BitDepth,
    samples: &[u8],
) -> Vec<u8> {
    // A depth map of 512 px takes 0.8 ms and 278 kB with this setting, and 2.2 ms and 251 kB with level 1 of miniz.
    let deflate = png::DeflateCompression::FdeflateUltraFast;
    encode(grid, (color, depth), samples, deflate, None)
}

fn encode<T: Copy>(
    grid: &Grid<T>,
    (color, depth): (png::ColorType, png::BitDepth),
    samples: &[u8],
    deflate: png::DeflateCompression,
    software: Option<&str>,
) -> Vec<u8> {
    let mut out = Vec::with_capacity(samples.len() / 2 + 1024);
    let mut encoder = png::Encoder::new(&mut out, grid.width() as u32, grid.height() as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_deflate_compression(deflate);
    encoder.set_filter(png::Filter::Paeth);
    let named = software.map_or(Ok(()), |software| {
        encoder.add_text_chunk("Software".to_owned(), software.to_owned())
    });
    named
        .and_then(|()| encoder.write_header())
        .and_then(|mut writer| {
            if samples.len() < STREAMED_BYTES {
                writer.write_image_data(samples)?;
            } else {
                let mut rows = writer.stream_writer_with_size(STREAMED_CHUNK)?;
                for row in samples.chunks(samples.len() / grid.height()) {
                    poll();
                    rows.write_all(row)?;
                }
                rows.finish()?;
            }
            writer.finish()
        })
        .expect("a grid with pixels is written to memory");
    out
}

/// Decodes a PNG that [`png_grey16`] encoded.
///
/// # Errors
/// Returns an error if the bytes are damaged, or are not a 16-bit grey PNG.
pub fn decode_grey16(bytes: &[u8]) -> Result<Grid<u16>, PngError> {
    let (width, height, samples) = grey_samples(bytes, png::BitDepth::Sixteen)?;
    let (pairs, _) = samples.as_chunks::<2>();
    let mut levels = Vec::with_capacity(pairs.len());
    for part in pairs.chunks(SAMPLES_PER_POLL) {
        poll();
        levels.extend(part.iter().map(|pair| u16::from_be_bytes(*pair)));
    }
    Ok(Grid::from_vec(width, height, levels).expect("two bytes for each pixel"))
}

/// Decodes a PNG that [`png_grey8`] encoded.
///
/// # Errors
/// Returns an error if the bytes are damaged, or are not an 8-bit grey PNG.
pub fn decode_grey8(bytes: &[u8]) -> Result<Grid<u8>, PngError> {
    let (width, height, samples) = grey_samples(bytes, png::BitDepth::Eight)?;
    Ok(Grid::from_vec(width, height, samples).expect("one byte for each pixel"))
}

/// Decodes a grey PNG of the given bit depth. Returns its width, height and bytes.
fn grey_samples(bytes: &[u8], depth: png::BitDepth) -> Result<(usize, usize, Vec<u8>), PngError> {
    let wanted = depth as u8;
    let mut reader = png::Decoder::new(PolledReader(Cursor::new(bytes))).read_info()?;
    let info = reader.info();
    check_size([info.width, info.height], wanted, bytes.len())?;
    let (width, height) = (info.width as usize, info.height as usize);
    if info.color_type != png::ColorType::Grayscale || info.bit_depth != depth {
        return Err(PngError::Kind {
            found: info.color_type,
            bits: info.bit_depth,
            wanted,
        });
    }
    let mut samples = vec![0; width * height * usize::from(wanted / 8)];
    reader.next_frame(&mut samples)?;
    reader.finish()?;
    Ok((width, height, samples))
}

/// Checks the size in the header before memory is allocated for it.
fn check_size([width, height]: [u32; 2], bits: u8, bytes: usize) -> Result<(), PngError> {
    let pixels = u64::from(width) * u64::from(height);
    let limit = if bits == 8 {
        MAX_MASK_PIXELS
    } else {
        MAX_MAP_PIXELS
    };
    if pixels > limit {
        return Err(PngError::TooLarge {
            width,
            height,
            limit,
        });
    }
    if pixels * u64::from(bits / 8) > MAX_DEFLATE_RATIO * bytes as u64 {
        return Err(PngError::TooShort {
            width,
            height,
            bytes,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{
        PngError, STREAMED_BYTES, decode_grey8, decode_grey16, jpeg_rgb8, png_grey8, png_grey16,
        png_mask, png_rgb8,
    };
    use crate::domain::cancel::{CancelToken, Cancelled};
    use crate::raster::{Grid, ImageLimits, Mask, decode};

    #[test]
    fn mask_is_white_where_stroke_is() {
        let mask = Mask::from_fn(5, 3, |x, y| x == y);
        let bytes = png_mask(&mask);
        let grey = decode_grey8(&bytes).expect("reads");
        assert_eq!(grey, mask.map(|set| if *set { 255 } else { 0 }));
    }

    #[test]
    fn an_image_of_another_depth_is_refused() {
        let bytes = png_grey8(&Grid::new(2, 2, 7));
        assert!(matches!(decode_grey16(&bytes), Err(PngError::Kind { .. })));
    }

    #[test]
    fn colours_are_read_back_by_the_print_decoder() {
        let grid = Grid::from_fn(4, 4, |x, y| [x as u8 * 60, y as u8 * 60, 9]);
        let picture = decode(&png_rgb8(&grid), &ImageLimits::SUGGESTED).expect("reads");
        assert_eq!(
            picture.rgb,
            grid.map(|c| c.map(|value| u16::from(value) * 257)).into()
        );
    }

    #[test]
    fn large_images_are_read_back_exactly_and_their_encoding_is_cancelled() {
        let noise = |x: usize, y: usize| (x * 40_503) as u16 ^ (y * 30_011) as u16;
        let wide = Grid::from_fn(2000, 1100, noise);
        assert!(2 * wide.data().len() >= STREAMED_BYTES);
        let png = png_grey16(&wide);
        assert_eq!(decode_grey16(&png).expect("reads"), wide);
        let token = CancelToken::cancelled_at(500);
        assert_eq!(token.run(|| png_grey16(&wide)), Err(Cancelled));
        let token = CancelToken::cancelled_at(50);
        assert_eq!(token.run(|| decode_grey16(&png).is_ok()), Err(Cancelled));
    }

    #[test]
    fn a_forged_size_is_refused_before_memory_is_allocated() {
        let forged = |width, height| {
            let mut out = Vec::new();
            let mut encoder = png::Encoder::new(&mut out, width, height);
            encoder.set_depth(png::BitDepth::Sixteen);
            let mut writer = encoder.write_header().expect("writes");
            writer
                .write_chunk(png::chunk::IDAT, &[0x78, 1, 3, 0])
                .expect("writes");
            drop(writer);
            let error = decode_grey16(&out).expect_err("refused").to_string();
            (error, out.len())
        };
        assert_eq!(
            forged(60_000, 60_000).0,
            "the PNG is 60000 x 60000 pixels, and the largest that a stage stores has 268435456 pixels"
        );
        let (error, bytes) = forged(16_384, 16_384);
        assert_eq!(
            error,
            format!("the PNG of {bytes} bytes is too short for its 16384 x 16384 pixels")
        );
        let flat = Grid::new(3000, 2000, 7_u16);
        assert_eq!(decode_grey16(&png_grey16(&flat)).expect("reads"), flat);
    }

    #[test]
    fn jpeg_is_close_to_its_source() {
        let grid = Grid::from_fn(40, 24, |x, y| [x as u8 * 5, y as u8 * 9, 90]);
        let picture = decode(&jpeg_rgb8(&grid, 85), &ImageLimits::SUGGESTED).expect("reads");
        assert_eq!((picture.rgb.width(), picture.rgb.height()), (40, 24));
        let far = |(a, b): (&[u16; 3], &[u8; 3])| {
            let apart = a
                .iter()
                .zip(b)
                .map(|(a, b)| (a / 257).abs_diff(u16::from(*b)));
            apart.max().unwrap_or(0)
        };
        let read = picture.rgb.to_rgb16();
        let pixels = read.data().iter().zip(grid.data());
        assert!(pixels.map(far).max().expect("pixels") < 16);
    }

    #[test]
    fn truncated_artifact_is_damaged() {
        let bytes = png_grey16(&Grid::from_fn(40, 30, |x, y| (x * y) as u16));
        for len in 0..bytes.len() {
            assert!(decode_grey16(&bytes[..len]).is_err(), "{len} bytes");
        }
    }

    proptest! {
        #[test]
        fn grey_is_read_back_exactly(
            width in 1_usize..20, height in 1_usize..20, seed in any::<u32>(),
        ) {
            let noise = |x: usize, y: usize| {
                (seed ^ (x as u32).wrapping_mul(0x9e37_79b1)).wrapping_mul(y as u32 | 1)
            };
            let wide = Grid::from_fn(width, height, |x, y| (noise(x, y) >> 16) as u16);
            prop_assert_eq!(&decode_grey16(&png_grey16(&wide)).expect("reads"), &wide);
            let narrow = wide.map(|value| (value >> 8) as u8);
            prop_assert_eq!(&decode_grey8(&png_grey8(&narrow)).expect("reads"), &narrow);
        }
    }
}
