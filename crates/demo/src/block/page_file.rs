//! Encodes a page image as JPEG or PNG, in colour or grey.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use mocban_core::raster::{Grid, jpeg_rgb8, png_grey8, png_rgb8};

/// An encoded page image.
#[derive(Debug, Clone)]
pub struct PageFileBytes {
    /// Bytes of the file.
    pub bytes: Vec<u8>,
    /// Extension of the file's name.
    pub extension: &'static str,
    /// Width and height, pixels.
    pub size: [usize; 2],
}

/// Encodes a page in a random format, mostly colour JPEG.
pub(super) fn encode_page(picture: &Grid<[u8; 3]>, rng: &mut ChaCha8Rng) -> PageFileBytes {
    let grey = |[r, g, b]: [u8; 3]| {
        ((299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000) as u8
    };
    let (bytes, extension) = match rng.random_range(0..10_u32) {
        0..=1 => (png_rgb8(picture), "png"),
        2 => (png_grey8(&picture.map(|pixel| grey(*pixel))), "png"),
        _ => (jpeg_rgb8(picture, rng.random_range(80..96)), "jpg"),
    };
    PageFileBytes {
        bytes,
        extension,
        size: [picture.width(), picture.height()],
    }
}
