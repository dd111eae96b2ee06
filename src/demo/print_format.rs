//! Encodes print images as PNG or JPEG, 8 or 16 bits, colour or grey.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageBuffer, ImageError, ImageFormat};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::rendered_print::RenderedPrint;

/// File format of a print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PrintFormat {
    /// 8-bit colour PNG.
    PngRgb8,
    /// 16-bit colour PNG.
    PngRgb16,
    /// 8-bit colour PNG, transparent outside the cut outline.
    PngRgba8,
    /// 8-bit grey PNG.
    PngGrey8,
    /// 16-bit grey PNG.
    PngGrey16,
    /// JPEG with a quality of 1..=100.
    Jpeg(u8),
}

impl PrintFormat {
    /// Draws a format, mostly colour PNG or JPEG.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        match rng.random_range(0..20_u32) {
            0..=7 => Self::PngRgb8,
            8 => Self::PngRgb16,
            9 => Self::PngRgba8,
            10..=11 => Self::PngGrey8,
            12 => Self::PngGrey16,
            _ => Self::Jpeg(rng.random_range(72..95)),
        }
    }

    /// Returns the file name extension.
    pub(super) const fn extension(self) -> &'static str {
        match self {
            Self::Jpeg(_) => "jpg",
            Self::PngRgb8 | Self::PngRgb16 | Self::PngRgba8 | Self::PngGrey8 | Self::PngGrey16 => {
                "png"
            }
        }
    }

    /// Encodes an image.
    ///
    /// # Errors
    /// Fails when the codec rejects the image.
    pub(super) fn encode(self, print: &RenderedPrint) -> Result<Vec<u8>, ImageError> {
        let mut bytes = Cursor::new(Vec::new());
        match self {
            Self::Jpeg(quality) => {
                let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
                rgb8(print).write_with_encoder(encoder)?;
            }
            Self::PngRgb8 => rgb8(print).write_to(&mut bytes, ImageFormat::Png)?,
            Self::PngRgba8 => rgba8(print).write_to(&mut bytes, ImageFormat::Png)?,
            Self::PngRgb16 => {
                let picture = DynamicImage::from(rgb8(print).to_rgb16());
                picture.write_to(&mut bytes, ImageFormat::Png)?;
            }
            Self::PngGrey8 => {
                let picture = DynamicImage::from(rgb8(print).to_luma8());
                picture.write_to(&mut bytes, ImageFormat::Png)?;
            }
            Self::PngGrey16 => {
                let picture = DynamicImage::from(rgb8(print).to_luma16());
                picture.write_to(&mut bytes, ImageFormat::Png)?;
            }
        }
        Ok(bytes.into_inner())
    }
}

fn rgb8(print: &RenderedPrint) -> DynamicImage {
    let (width, height) = (print.rgb.width() as u32, print.rgb.height() as u32);
    let picture = ImageBuffer::from_fn(width, height, |x, y| {
        let colour = print.rgb.at(x as usize, y as usize);
        image::Rgb(colour.map(|c| c.round() as u8))
    });
    DynamicImage::from(picture)
}

fn rgba8(print: &RenderedPrint) -> DynamicImage {
    let (width, height) = (print.rgb.width() as u32, print.rgb.height() as u32);
    let picture = ImageBuffer::from_fn(width, height, |x, y| {
        let [r, g, b] = print
            .rgb
            .at(x as usize, y as usize)
            .map(|c| c.round() as u8);
        let inside = print.inside_cut.at(x as usize, y as usize);
        // Many tools store black under transparent pixels; it must not count as ink.
        if inside {
            image::Rgba([r, g, b, 255])
        } else {
            image::Rgba([0, 0, 0, 0])
        }
    });
    DynamicImage::from(picture)
}
