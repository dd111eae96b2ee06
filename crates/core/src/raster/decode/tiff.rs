//! Decodes uncommon TIFF images: palettes, fewer than 8 bits per sample, grey with transparency, and floats. The
//! `image` crate decodes the common kinds.

use std::io::Cursor;

use tiff::decoder::{Decoder, DecodingResult, Limits as Memory};
use tiff::tags::{ExtraSamples, PhotometricInterpretation as Photometric, SampleFormat, Tag};
use tiff::{TiffError, TiffResult};

use super::error::broken;
use super::print_image::on_white;
use super::tiff_pages::TiffBytes;
use super::{DecodeError, ImageLimits};
use crate::domain::FileKind;
use crate::domain::cancel::{PolledReader, poll};
use crate::raster::Grid;

/// Layout of the pixels according to the tags.
#[derive(Debug)]
struct TiffLayout {
    width: u32,
    height: u32,
    photometric: Photometric,
    bits: u16,
    /// Samples per pixel, and how many of them are its colour.
    samples: usize,
    colours: usize,
    format: SampleFormat,
    /// Meaning of the first sample after the colour.
    extra: Option<ExtraSamples>,
    /// Palette: all reds, then greens, then blues; empty without one.
    palette: Vec<u16>,
}

impl TiffLayout {
    /// Reads the tags. Returns `None` if the image is not one of the uncommon kinds.
    fn read(reader: &mut Decoder<PolledReader<Cursor<&[u8]>>>) -> TiffResult<Option<Self>> {
        let (width, height) = reader.dimensions()?;
        let tag = reader.find_tag_unsigned(Tag::PhotometricInterpretation)?;
        let Some(photometric) = tag.and_then(Photometric::from_u16) else {
            return Ok(None);
        };
        let colours = match photometric {
            Photometric::WhiteIsZero | Photometric::BlackIsZero | Photometric::RGBPalette => 1,
            Photometric::RGB => 3,
            _ => return Ok(None),
        };
        let mut all = |tag| reader.find_tag_unsigned_vec::<u16>(tag);
        let first = |values: Option<Vec<u16>>| values.and_then(|values| values.first().copied());
        let extra = first(all(Tag::ExtraSamples)?).and_then(ExtraSamples::from_u16);
        let samples = usize::from(first(all(Tag::SamplesPerPixel)?).unwrap_or(1));
        let layout = Self {
            width,
            height,
            photometric,
            bits: first(all(Tag::BitsPerSample)?).unwrap_or(1),
            samples,
            colours,
            format: SampleFormat::from_u16_exhaustive(first(all(Tag::SampleFormat)?).unwrap_or(1)),
            extra: extra.filter(|_| samples > colours),
            palette: match photometric {
                Photometric::RGBPalette => all(Tag::ColorMap)?.unwrap_or_default(),
                _ => Vec::new(),
            },
        };
        Ok(Some(layout).filter(Self::is_uncommon))
    }

    /// Returns whether the `image` crate cannot decode the image, or may assume a wrong range for its floats.
    fn is_uncommon(&self) -> bool {
        let is_grey_common = self.samples == 1 && matches!(self.bits, 1 | 8 | 16);
        self.samples >= self.colours
            && match self.photometric {
                Photometric::RGBPalette => self.format == SampleFormat::Uint,
                Photometric::RGB => self.format == SampleFormat::IEEEFP,
                _ => !is_grey_common || self.format != SampleFormat::Uint,
            }
    }
}

/// Decodes an image of an uncommon kind. Returns `None` for other kinds.
///
/// If all floats are in 0..=1, white is 1. Otherwise all must be whole numbers in 0..=255 or in 0..=65535, and white is
/// the end of the smaller range that holds them.
///
/// # Errors
/// Returns an error if the image is too large or truncated, or if the type or the range of its samples is unsupported.
pub(super) fn decode_uncommon(
    bytes: &[u8],
    limits: &ImageLimits,
) -> Result<Option<Grid<[u16; 3]>>, DecodeError> {
    // The common decoder reports faults of the tags.
    let layout = Decoder::new(PolledReader(Cursor::new(bytes)))
        .and_then(|mut reader| TiffLayout::read(&mut reader));
    let Ok(Some(layout)) = layout else {
        return Ok(None);
    };
    limits.check_size(layout.width, layout.height)?;
    let samples = if layout.photometric == Photometric::RGB {
        TiffSamples::read(bytes, &layout, limits)?
    } else {
        let Some(changed) = declared_black_is_zero(bytes) else {
            return Ok(None);
        };
        TiffSamples::read(&changed, &layout, limits)?
    };
    pixels(&layout, &samples).map(Some)
}

fn tiff_error(error: &TiffError) -> DecodeError {
    match error {
        TiffError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => {
            DecodeError::Truncated(FileKind::Tiff)
        }
        other => broken(FileKind::Tiff, &other.to_string()),
    }
}

/// Returns the file with a changed tag: grey, with black as 0. The decoder then returns the samples as stored. With the
/// original tag, the decoder rejects palettes, and images that have white as 0 and extra samples.
fn declared_black_is_zero(bytes: &[u8]) -> Option<Vec<u8>> {
    const PHOTOMETRIC: u64 = 262;
    const BLACK_IS_ZERO: u16 = 1;
    let file = TiffBytes::new(bytes)?;
    let (at, len) = file.first_page()?.value_field(PHOTOMETRIC)?;
    let value = file.short(BLACK_IS_ZERO);
    let mut changed = bytes.to_vec();
    let field = changed.get_mut(at..at + len)?;
    (len == value.len()).then(|| field.copy_from_slice(&value))?;
    Some(changed)
}

/// All samples as stored.
struct TiffSamples {
    values: DecodingResult,
    bits: usize,
    /// Bytes per row of samples below 8 bits.
    row_bytes: usize,
    /// Samples per row, and per pixel, of one plane.
    row: usize,
    pixel: usize,
    /// Samples per plane; 0 if there is only one plane.
    plane: usize,
}

impl TiffSamples {
    fn read(bytes: &[u8], layout: &TiffLayout, limits: &ImageLimits) -> Result<Self, DecodeError> {
        let mut memory = Memory::default();
        memory.decoding_buffer_size =
            usize::try_from(limits.max_decoder_bytes()).unwrap_or(usize::MAX);
        memory.intermediate_buffer_size = memory.decoding_buffer_size;
        let mut values = DecodingResult::U8(Vec::new());
        let read = Decoder::new(PolledReader(Cursor::new(bytes)))
            .and_then(|reader| reader.with_limits(memory).read_image_to_buffer(&mut values))
            .map_err(|error| tiff_error(&error))?;
        let pixel = if read.planes > 1 { 1 } else { layout.samples };
        let row = layout.width as usize * pixel;
        let bits = usize::from(layout.bits);
        let mut samples = Self {
            bits,
            row_bytes: (row * bits).div_ceil(8),
            row,
            pixel,
            plane: if read.planes > 1 {
                row * layout.height as usize
            } else {
                0
            },
            values,
        };
        let wanted = layout.height as usize * samples.row_bytes * (layout.samples / pixel);
        if samples.values.as_buffer(0).as_bytes().len() < wanted {
            let reason = "it holds fewer samples than its tags say";
            return Err(broken(FileKind::Tiff, reason));
        }
        Ok(samples)
    }

    /// Returns a sample of a pixel; 0 for signed numbers, which are rejected.
    fn at(&self, x: usize, y: usize, sample: usize) -> f64 {
        let in_row = x * self.pixel + if self.plane > 0 { 0 } else { sample };
        let at = y * self.row + in_row + sample * self.plane;
        match &self.values {
            DecodingResult::U8(values) if self.bits < 8 => {
                let planes = sample * self.plane.div_ceil(self.row.max(1)) * self.row_bytes;
                let start = planes + y * self.row_bytes;
                f64::from(bits_at(&values[start..], in_row * self.bits, self.bits))
            }
            DecodingResult::U8(values) => f64::from(values[at]),
            DecodingResult::U16(values) => f64::from(values[at]),
            DecodingResult::U32(values) => f64::from(values[at]),
            DecodingResult::U64(values) => values[at] as f64,
            DecodingResult::F16(values) => f64::from(values[at].to_f32()),
            DecodingResult::F32(values) => f64::from(values[at]),
            DecodingResult::F64(values) => values[at],
            _ => 0.0,
        }
    }
}

/// Returns a number of fewer than 8 bits, most significant bit first.
fn bits_at(bytes: &[u8], from: usize, count: usize) -> u8 {
    (from..from + count).fold(0, |sum, at| sum << 1 | (bytes[at / 8] >> (7 - at % 8) & 1))
}

/// Returns the sample value of white or opaque.
fn full_scale(layout: &TiffLayout, samples: &TiffSamples) -> Result<f64, DecodeError> {
    match layout.format {
        SampleFormat::Uint => Ok(2_f64.powi(i32::from(layout.bits)) - 1.0),
        SampleFormat::IEEEFP => float_full_scale(layout, samples),
        _ => Err(broken(
            FileKind::Tiff,
            "its samples are signed or of an unknown kind; unsigned numbers and floats are read",
        )),
    }
}

fn float_full_scale(layout: &TiffLayout, samples: &TiffSamples) -> Result<f64, DecodeError> {
    let (mut least, mut most, mut whole) = (f64::INFINITY, f64::NEG_INFINITY, true);
    for y in 0..layout.height as usize {
        poll();
        for x in 0..layout.width as usize {
            for value in (0..layout.colours).map(|sample| samples.at(x, y, sample)) {
                if !value.is_finite() {
                    let reason = format!("it holds the sample {value}");
                    return Err(broken(FileKind::Tiff, &reason));
                }
                (least, most) = (least.min(value), most.max(value));
                whole &= value.fract() == 0.0;
            }
        }
    }
    match most {
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

fn pixels(layout: &TiffLayout, samples: &TiffSamples) -> Result<Grid<[u16; 3]>, DecodeError> {
    let full = full_scale(layout, samples)?;
    let mut out = Grid::new(layout.width as usize, layout.height as usize, [0; 3]);
    for y in 0..out.height() {
        poll();
        for x in 0..out.width() {
            let level = |sample| {
                let share = (samples.at(x, y, sample) / full).clamp(0.0, 1.0);
                (share * f64::from(u16::MAX)).round() as u16
            };
            let colour = match layout.photometric {
                Photometric::WhiteIsZero => [u16::MAX - level(0); 3],
                Photometric::RGB => [level(0), level(1), level(2)],
                Photometric::RGBPalette => palette_colour(&layout.palette, samples.at(x, y, 0))?,
                _ => [level(0); 3],
            };
            let alpha = || level(layout.colours);
            let [r, g, b] = colour;
            let on_white = match layout.extra {
                Some(ExtraSamples::UnassociatedAlpha) => on_white([r, g, b, alpha()]),
                Some(ExtraSamples::AssociatedAlpha) => {
                    colour.map(|c| c.saturating_add(u16::MAX - alpha()))
                }
                _ => colour,
            };
            out.set(x, y, on_white);
        }
    }
    Ok(out)
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
