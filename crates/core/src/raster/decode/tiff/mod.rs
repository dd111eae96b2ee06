//! Decodes TIFF images: strips and tiles, in planes or not, of samples of 1 to 64 bits or floats.

mod chunks;
mod fax;
mod layout;
mod pages;
mod photometric;
mod predictor;
mod samples;
mod shared_chroma;
mod tag_numbers;
#[cfg(test)]
mod tests;

use super::colour_profile::FileProfile;
use super::error::{DecodeError, broken};
use super::light_curve::LightCurve;
use super::limits::ImageLimits;
use super::print_image::{on_white, widen_narrow};
use super::tags::{TagSource, TagValues};
use crate::domain::FileKind;
use crate::domain::cancel::poll;
use crate::raster::{Colours, Grid};
use chunks::DecodedChunk;
use layout::TiffLayout;
use pages::PrintPage;
use photometric::{Photometric, YCbCrCode};

const ICC_PROFILE: u64 = 34675;
const TRANSFER_FUNCTION: u64 = 301;

/// The print of a TIFF file, as stored.
pub(super) struct TiffImage {
    pub(super) rgb: Colours,
    /// EXIF orientation, if the file states one.
    pub(super) orientation: Option<u64>,
    pub(super) profile: Option<FileProfile>,
    pub(super) light_curve: Option<LightCurve>,
}

/// Decodes the print of a TIFF file.
///
/// If all floats are in 0..=1, white is 1. Otherwise all must be whole numbers in 0..=255 or in 0..=65535, and white is
/// the end of the smaller range that holds them.
///
/// # Errors
/// Returns an error if there is no single print, or if it is too large, truncated, or stored in a way that is not read.
pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<TiffImage, DecodeError> {
    let print = pages::find_print_page(&bytes)?;
    let mut layout = TiffLayout::read(&print.page, limits)?;
    layout.find_compressed_padding(bytes)?;
    let is_of_inks = matches!(layout.photometric, Photometric::Cmyk);
    let has_16_bits = layout.used_bits == 16 && !layout.is_float;
    let is_inverted = layout.photometric == Photometric::WhiteIsZero;
    let rgb = match layout.plain_channels() {
        Some(1) => Colours::Grey8(plain_pixels(&layout, bytes, 0, |[level]| {
            if is_inverted { !level } else { level }
        })?),
        Some(_) => Colours::Rgb8(plain_pixels(&layout, bytes, [0; 3], |colour| colour)?),
        None => {
            let mut rgb = pixels(&layout, bytes)?;
            if has_16_bits {
                widen_narrow(&mut rgb, is_inverted);
            }
            rgb.into()
        }
    };
    Ok(TiffImage {
        rgb,
        orientation: print.orientation(),
        profile: print.inherited_bytes(ICC_PROFILE).map(|bytes| FileProfile {
            bytes: bytes.to_vec(),
            is_of_inks,
        }),
        light_curve: print
            .inherited_values(TRANSFER_FUNCTION)
            .map(|lights| light_curve(&layout, lights)),
    })
}

/// Returns the curve of a transfer function, which has a light for each number of a sample, or for each of three colours.
fn light_curve(layout: &TiffLayout<'_>, lights: TagValues<'_>) -> LightCurve {
    let is_of_light = matches!(
        layout.photometric,
        Photometric::BlackIsZero | Photometric::Rgb
    );
    let count = 1 << layout.used_bits.min(16);
    let is_whole = [count, 3 * count].contains(&lights.len());
    let is_read = is_of_light && is_whole && layout.used_bits <= 16;
    let levels: Option<Vec<u16>> = is_read
        .then(|| {
            lights
                .iter()
                .map(|light| u16::try_from(light?).ok())
                .collect()
        })
        .flatten();
    levels.map_or_else(
        || LightCurve::Unread("TIFF transfer function".to_owned()),
        |levels| LightCurve::Tables(levels.chunks(count).map(<[u16]>::to_vec).collect()),
    )
}

/// Reads tags of the print of a TIFF file. Returns `None` if its tags cannot be read.
pub(super) fn with_print_tags<T>(
    file: &dyn TagSource,
    read: impl FnOnce(&PrintPage<'_>) -> T,
) -> Option<T> {
    pages::find_print_page(file).ok().map(|print| read(&print))
}

/// Returns the number of pixels of the print of a TIFF file, or `None` if its tags cannot be read.
pub(super) fn pixel_count(file: &dyn TagSource) -> Option<u64> {
    let print = pages::find_print_page(file).ok()?;
    Some(pages::pixel_count(&print.page))
}

/// Returns width and height of the stored print of a TIFF file of `len` bytes, and its EXIF orientation, by its tags.
///
/// # Errors
/// Returns an error if there is no single print, or if it is too large, stored in a way that is not read, or if a strip or tile
/// ends behind the end of the file.
pub(super) fn stored_size(
    file: &dyn TagSource,
    len: u64,
    limits: &ImageLimits,
) -> Result<([u32; 2], Option<u64>), DecodeError> {
    let print = pages::find_print_page(file)?;
    let layout = TiffLayout::read(&print.page, limits)?;
    if layout.end().is_none_or(|end| end > len) {
        return Err(DecodeError::Truncated(FileKind::Tiff));
    }
    let size = [layout.width, layout.height].map(|side| side as u32);
    Ok((size, print.orientation()))
}

/// Reads 8-bit grey or RGB. A pixel has `N` samples.
fn plain_pixels<const N: usize, T: Copy>(
    layout: &TiffLayout<'_>,
    file: &[u8],
    black: T,
    pixel: impl Fn([u8; N]) -> T,
) -> Result<Grid<T>, DecodeError> {
    let [across, down] = layout.chunk_counts();
    let mut out = Grid::new(layout.width, layout.height, black);
    for at in 0..across * down {
        let chunk = layout.decoded_chunk(file, at)?;
        for y in 0..chunk.height {
            poll();
            let start = (chunk.top + y) * layout.width + chunk.left;
            let target = &mut out.data_mut()[start..][..chunk.width];
            let samples = layout.plain_bytes(&chunk, y).as_chunks::<N>().0;
            for (target, samples) in target.iter_mut().zip(samples) {
                *target = pixel(*samples);
            }
        }
    }
    Ok(out)
}

fn pixels(layout: &TiffLayout<'_>, file: &[u8]) -> Result<Grid<[u16; 3]>, DecodeError> {
    let [across, down] = layout.chunk_counts();
    let mut out = Grid::new(layout.width, layout.height, [0; 3]);
    let all = (0..across * down).map(|at| layout.decoded_chunk(file, at));
    if layout.is_float || layout.used_bits < layout.bits {
        // The range of all samples decides what white is.
        let chunks = all.collect::<Result<Vec<_>, _>>()?;
        let full = full_scale(layout, &chunks)?;
        for chunk in &chunks {
            convert(layout, chunk, full, &mut out)?;
        }
        return Ok(out);
    }
    let full = largest(layout.bits);
    for chunk in all {
        convert(layout, &chunk?, full, &mut out)?;
    }
    Ok(out)
}

/// Returns the largest number of some bits.
fn largest(bits: usize) -> f64 {
    2_f64.powi(bits as i32) - 1.0
}

fn full_scale(layout: &TiffLayout<'_>, chunks: &[DecodedChunk<'_>]) -> Result<f64, DecodeError> {
    let (mut least, mut most, mut whole) = (f64::INFINITY, f64::NEG_INFINITY, true);
    let (mut row, pixel) = (Vec::new(), layout.samples * layout.planes);
    for chunk in chunks {
        for y in 0..chunk.height {
            poll();
            layout.read_row(chunk, y, &mut row);
            for pixel in row.chunks_exact(pixel) {
                for value in &pixel[..layout.photometric.samples()] {
                    if !value.is_finite() {
                        let reason = format!("it holds the sample {value}");
                        return Err(broken(FileKind::Tiff, &reason));
                    }
                    (least, most) = (least.min(*value), most.max(*value));
                    whole &= value.fract() == 0.0;
                }
            }
        }
    }
    match most {
        _ if !layout.is_float => {
            // Padded samples are at either end of their 16 bits.
            let used = largest(layout.used_bits);
            return Ok(if most > used {
                largest(layout.bits)
            } else {
                used
            });
        }
        _ if least < 0.0 => {}
        ..=1.0 => return Ok(1.0),
        ..=255.0 if whole => return Ok(255.0),
        ..=65535.0 if whole => return Ok(65535.0),
        _ => {}
    }
    let reason = format!(
        "its floats go from {least} to {most}; 0 to 1 and whole numbers to 255 or 65535 are read"
    );
    Err(broken(FileKind::Tiff, &reason))
}

/// Writes the colours of a strip or tile. `full` is the sample of white or opaque.
fn convert(
    layout: &TiffLayout<'_>,
    chunk: &DecodedChunk<'_>,
    full: f64,
    out: &mut Grid<[u16; 3]>,
) -> Result<(), DecodeError> {
    let pixel = layout.samples * layout.planes;
    let (mut samples, mut levels) = (Vec::new(), Vec::new());
    for y in 0..chunk.height {
        poll();
        let start = (chunk.top + y) * layout.width + chunk.left;
        let target = &mut out.data_mut()[start..][..chunk.width];
        layout.read_levels(chunk, y, full, &mut samples, &mut levels);
        let pixels = target.iter_mut().zip(levels.chunks_exact(pixel));
        match &layout.photometric {
            Photometric::WhiteIsZero => {
                pixels.for_each(|(target, levels)| *target = [u16::MAX - levels[0]; 3]);
            }
            Photometric::BlackIsZero => {
                pixels.for_each(|(target, levels)| *target = [levels[0]; 3]);
            }
            Photometric::Rgb => {
                pixels.for_each(|(target, levels)| *target = [levels[0], levels[1], levels[2]]);
            }
            Photometric::Cmyk => pixels.for_each(|(target, levels)| {
                *target = [0, 1, 2].map(|at| without_ink(levels[at], levels[3]));
            }),
            Photometric::YCbCr(code) => pixels.for_each(|(target, levels)| {
                *target = ycbcr_colour(code, [levels[0], levels[1], levels[2]]);
            }),
            Photometric::Palette(palette) => {
                layout.read_row(chunk, y, &mut samples);
                for (target, samples) in target.iter_mut().zip(samples.chunks_exact(pixel)) {
                    *target = palette_colour(palette, samples[0])?;
                }
            }
        }
        if let Some(alpha) = layout.alpha {
            for (target, levels) in target.iter_mut().zip(levels.chunks_exact(pixel)) {
                *target = composited(*target, levels[alpha.index], alpha.is_premultiplied);
            }
        }
    }
    Ok(())
}

/// Returns a colour on white.
fn composited([r, g, b]: [u16; 3], alpha: u16, is_premultiplied: bool) -> [u16; 3] {
    if is_premultiplied {
        [r, g, b].map(|c| c.saturating_add(u16::MAX - alpha))
    } else {
        on_white([r, g, b, alpha])
    }
}

fn palette_colour(palette: &[u16], number: f64) -> Result<[u16; 3], DecodeError> {
    let count = palette.len() / 3;
    let at = number as usize;
    if at >= count {
        let reason = format!("a pixel has the colour {at} of a palette of {count}");
        return Err(broken(FileKind::Tiff, &reason));
    }
    Ok([0, 1, 2].map(|channel| palette[channel * count + at]))
}

/// Returns the light that an ink and black leave of white.
fn without_ink(ink: u16, black: u16) -> u16 {
    let [light, left] = [ink, black].map(|ink| u32::from(u16::MAX - ink));
    (light * left / u32::from(u16::MAX)) as u16
}

/// Returns the colour of luma and chroma.
fn ycbcr_colour(code: &YCbCrCode, levels: [u16; 3]) -> [u16; 3] {
    let [y, b, r] = levels.map(|level| f64::from(level) / 257.0);
    let [black, white, no_blue, most_blue, no_red, most_red] = code.range;
    let luma = (y - black) / (white - black);
    // Chroma goes from -1/2 to 1/2, nearly.
    let blue = (b - no_blue) / (most_blue - no_blue) * 127.0 / 255.0;
    let red = (r - no_red) / (most_red - no_red) * 127.0 / 255.0;
    let [red_weight, green_weight, blue_weight] = code.weights;
    let red = luma + red * 2.0 * (1.0 - red_weight);
    let blue = luma + blue * 2.0 * (1.0 - blue_weight);
    let green = (luma - red_weight * red - blue_weight * blue) / green_weight;
    [red, green, blue]
        .map(|fraction| (fraction.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16)
}
