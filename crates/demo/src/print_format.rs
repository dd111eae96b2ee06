//! Encodes print images as PNG or JPEG, 8 or 16 bits, colour or grey.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageError, ImageFormat, Rgb, RgbImage, Rgba};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::rendered_print::RenderedPrint;

/// Encodes a print in a random format, mostly colour PNG or JPEG, and always in colour if `keep_colours` is set. Returns
/// the bytes and the file name extension.
pub(super) fn encode_print(
    print: &RenderedPrint,
    keep_colours: bool,
    rng: &mut ChaCha8Rng,
) -> Result<(Vec<u8>, &'static str), ImageError> {
    let mut bytes = Cursor::new(Vec::new());
    let rgb = rgb8(print);
    let picture: DynamicImage = match rng.random_range(0..20_u32) {
        0..=7 => rgb,
        8 => rgb.to_rgb16().into(),
        9 => transparent_outside(print, &rgb),
        10..=12 if keep_colours => rgb,
        10..=11 => rgb.to_luma8().into(),
        12 => rgb.to_luma16().into(),
        _ => {
            let quality = rng.random_range(72..95);
            rgb.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality))?;
            return Ok((bytes.into_inner(), "jpg"));
        }
    };
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok((bytes.into_inner(), "png"))
}

fn rgb8(print: &RenderedPrint) -> DynamicImage {
    let (width, height) = (print.rgb.width() as u32, print.rgb.height() as u32);
    let picture = RgbImage::from_fn(width, height, |x, y| {
        let colour = print.rgb.at(x as usize, y as usize);
        Rgb(colour.map(|c| c.round() as u8))
    });
    picture.into()
}

fn transparent_outside(print: &RenderedPrint, rgb: &DynamicImage) -> DynamicImage {
    let mut picture = rgb.to_rgba8();
    for (pixel, inside) in picture.pixels_mut().zip(print.inside_cut.data()) {
        // Many tools store black in transparent pixels. This black must not count as ink.
        if !inside {
            *pixel = Rgba([0; 4]);
        }
    }
    picture.into()
}
