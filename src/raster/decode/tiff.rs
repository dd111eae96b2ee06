//! TIFF images of the rarer kinds: palettes, few bits a pixel, grey with transparency, floats. The common kinds are
//! left to the `image` crate.

use std::io::Cursor;

use tiff::decoder::{Decoder, DecodingResult, Limits as Memory};
use tiff::tags::Tag;
use tiff::{TiffError, TiffResult};

use super::super::{Grid, ImageLimits};
use super::{DecodeError, broken, check_size, on_white};
use crate::domain::FileKind;

type Reader<'a> = Decoder<Cursor<&'a [u8]>>;

/// What the samples of a pixel are (TIFF 6.0, section 8, `PhotometricInterpretation`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Colours {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    Palette,
}

impl Colours {
    const fn of(tag: u16) -> Option<Self> {
        match tag {
            0 => Some(Self::WhiteIsZero),
            1 => Some(Self::BlackIsZero),
            2 => Some(Self::Rgb),
            3 => Some(Self::Palette),
            _ => None,
        }
    }

    const fn samples(self) -> usize {
        match self {
            Self::WhiteIsZero | Self::BlackIsZero | Self::Palette => 1,
            Self::Rgb => 3,
        }
    }
}

/// What the sample after the colours says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Alpha {
    /// Nothing that is used.
    None,
    /// Transparency; the colours are multiplied by it already.
    Premultiplied,
    /// Transparency.
    Plain,
}

/// How a sample is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Number {
    Unsigned,
    Float,
    Other,
}

/// What the tags say of the pixels.
#[derive(Debug)]
struct Layout {
    width: u32,
    height: u32,
    colours: Colours,
    bits: u16,
    samples: usize,
    number: Number,
    alpha: Alpha,
    /// Colours by number, all reds first; empty without a palette.
    palette: Vec<u16>,
}

impl Layout {
    /// `None` when the tags tell of a kind that is not read here.
    fn read(reader: &mut Reader<'_>) -> TiffResult<Option<Self>> {
        let (width, height) = reader.dimensions()?;
        let photometric = reader.find_tag_unsigned(Tag::PhotometricInterpretation)?;
        let Some(colours) = photometric.and_then(Colours::of) else {
            return Ok(None);
        };
        let mut all = |tag| reader.find_tag_unsigned_vec::<u16>(tag);
        let first = |values: Option<Vec<u16>>| values.and_then(|values| values.first().copied());
        let layout = Self {
            width,
            height,
            colours,
            bits: first(all(Tag::BitsPerSample)?).unwrap_or(1),
            samples: usize::from(first(all(Tag::SamplesPerPixel)?).unwrap_or(1)),
            number: match first(all(Tag::SampleFormat)?).unwrap_or(1) {
                1 => Number::Unsigned,
                3 => Number::Float,
                _ => Number::Other,
            },
            alpha: match first(all(Tag::ExtraSamples)?) {
                Some(1) => Alpha::Premultiplied,
                Some(2) => Alpha::Plain,
                _ => Alpha::None,
            },
            palette: match colours {
                Colours::Palette => all(Tag::ColorMap)?.unwrap_or_default(),
                Colours::WhiteIsZero | Colours::BlackIsZero | Colours::Rgb => Vec::new(),
            },
        };
        Ok(Some(layout).filter(Self::is_rare))
    }

    /// Whether the `image` crate leaves it out, or takes floats for what they may not be.
    fn is_rare(&self) -> bool {
        let grey = self.samples > 1 || !matches!(self.bits, 1 | 8 | 16);
        self.samples >= self.colours.samples()
            && match self.colours {
                Colours::Palette => self.number == Number::Unsigned,
                Colours::WhiteIsZero | Colours::BlackIsZero => {
                    grey || self.number != Number::Unsigned
                }
                Colours::Rgb => self.number == Number::Float,
            }
    }
}

/// Decodes an image of a rare kind; `None` when it is of another.
///
/// Floats are taken for 0 to 1 when they all are, and for 0 to 255 or 0 to 65535 when they are whole numbers of that
/// range.
///
/// # Errors
/// When the image is too large, not whole, or its numbers may mean anything.
pub(super) fn rare(
    bytes: &[u8],
    limits: &ImageLimits,
) -> Result<Option<Grid<[u16; 3]>>, DecodeError> {
    // What is wrong with the tags is for the common decoder to tell.
    let layout = Decoder::new(Cursor::new(bytes)).and_then(|mut reader| Layout::read(&mut reader));
    let Ok(Some(layout)) = layout else {
        return Ok(None);
    };
    check_size(layout.width, layout.height, limits)?;
    let plain;
    let bytes = match layout.colours {
        Colours::Rgb => bytes,
        Colours::WhiteIsZero | Colours::BlackIsZero | Colours::Palette => {
            let Some(changed) = as_plain_grey(bytes) else {
                return Ok(None);
            };
            plain = changed;
            &plain
        }
    };
    let samples = Samples::read(bytes, &layout, limits).map_err(|error| refused(&error))?;
    pixels(&layout, &samples?).map(Some)
}

fn refused(error: &TiffError) -> DecodeError {
    match error {
        TiffError::IoError(io) if io.kind() == std::io::ErrorKind::UnexpectedEof => {
            DecodeError::Truncated(FileKind::Tiff)
        }
        other => broken(FileKind::Tiff, &other.to_string()),
    }
}

/// The file with its samples declared as grey of which 0 is black, so that the decoder hands them over as they are:
/// it refuses palettes, and white of 0 beside other samples.
fn as_plain_grey(bytes: &[u8]) -> Option<Vec<u8>> {
    const PHOTOMETRIC: u64 = 262;
    const SHORT: u64 = 3;
    let big_end = bytes.starts_with(b"MM");
    let number = |at: usize, len: usize| {
        let field = bytes.get(at..at.checked_add(len)?)?;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if big_end {
            field.iter().fold(0, add)
        } else {
            field.iter().rev().fold(0, add)
        })
    };
    // In a BigTIFF places and counts are of eight bytes.
    let (place, count, entry, value) = match number(2, 2)? {
        43 => (number(8, 8)?, 8, 20, 12),
        _ => (number(4, 4)?, 2, 12, 8),
    };
    let place = usize::try_from(place).ok()?;
    let entries = usize::try_from(number(place, count)?).ok()?;
    let first = place.checked_add(count)?;
    let at = (0..entries)
        .map_while(|nth| first.checked_add(nth.checked_mul(entry)?))
        .take_while(|at| *at < bytes.len())
        .find(|at| number(*at, 2) == Some(PHOTOMETRIC) && number(at + 2, 2) == Some(SHORT))?;
    let mut changed = bytes.to_vec();
    let field = changed.get_mut(at + value..at + value + 2)?;
    field.copy_from_slice(if big_end { &[0, 1] } else { &[1, 0] });
    Some(changed)
}

/// All samples as the file has them.
struct Samples {
    values: DecodingResult,
    bits: usize,
    /// Bytes of a row of samples below 8 bits.
    row_bytes: usize,
    /// Samples of a row in one plane, and of a pixel in one plane.
    row: usize,
    pixel: usize,
    /// Samples of a plane; none between planes when there is one.
    plane: usize,
}

impl Samples {
    fn read(
        bytes: &[u8],
        layout: &Layout,
        limits: &ImageLimits,
    ) -> TiffResult<Result<Self, DecodeError>> {
        let wanted = limits
            .max_pixels
            .saturating_mul(16)
            .saturating_add(64 << 20);
        let mut memory = Memory::default();
        memory.decoding_buffer_size = usize::try_from(wanted).unwrap_or(usize::MAX);
        memory.intermediate_buffer_size = memory.decoding_buffer_size;
        let mut reader = Decoder::new(Cursor::new(bytes))?.with_limits(memory);
        let mut values = DecodingResult::U8(Vec::new());
        let read = reader.read_image_to_buffer(&mut values)?;
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
            return Ok(Err(broken(
                FileKind::Tiff,
                "it holds fewer samples than its tags say",
            )));
        }
        Ok(Ok(samples))
    }

    /// A sample of a pixel. Signed numbers are read nowhere, and come as 0.
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
            DecodingResult::I8(_)
            | DecodingResult::I16(_)
            | DecodingResult::I32(_)
            | DecodingResult::I64(_) => 0.0,
        }
    }
}

/// A number of fewer than 8 bits, the highest first.
fn bits_at(bytes: &[u8], from: usize, count: usize) -> u8 {
    (from..from + count).fold(0, |sum, at| sum << 1 | (bytes[at / 8] >> (7 - at % 8) & 1))
}

/// The number that is white, or opaque.
fn full(layout: &Layout, samples: &Samples) -> Result<f64, DecodeError> {
    match layout.number {
        Number::Unsigned => Ok(2_f64.powi(i32::from(layout.bits)) - 1.0),
        Number::Float => full_of_floats(layout, samples),
        Number::Other => Err(broken(
            FileKind::Tiff,
            "its samples are signed or of an unknown kind; unsigned numbers and floats are read",
        )),
    }
}

fn full_of_floats(layout: &Layout, samples: &Samples) -> Result<f64, DecodeError> {
    let colours = layout.colours.samples();
    let (mut least, mut most, mut whole) = (f64::INFINITY, f64::NEG_INFINITY, true);
    for y in 0..layout.height as usize {
        for x in 0..layout.width as usize {
            for value in (0..colours).map(|sample| samples.at(x, y, sample)) {
                if !value.is_finite() {
                    return Err(broken(
                        FileKind::Tiff,
                        &format!("it holds the sample {value}"),
                    ));
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
    Err(broken(
        FileKind::Tiff,
        &format!(
            "its floats go from {least} to {most}; 0 to 1 and whole numbers to 255 or 65535 are read"
        ),
    ))
}

fn pixels(layout: &Layout, samples: &Samples) -> Result<Grid<[u16; 3]>, DecodeError> {
    let full = full(layout, samples)?;
    let (width, height) = (layout.width as usize, layout.height as usize);
    let mut out = Grid::new(width, height, [0; 3]);
    for y in 0..height {
        for x in 0..width {
            let level = |sample| {
                let share = (samples.at(x, y, sample) / full).clamp(0.0, 1.0);
                (share * f64::from(u16::MAX)).round() as u16
            };
            let colour = match layout.colours {
                Colours::BlackIsZero => [level(0); 3],
                Colours::WhiteIsZero => [u16::MAX - level(0); 3],
                Colours::Rgb => [level(0), level(1), level(2)],
                Colours::Palette => palette_colour(&layout.palette, samples.at(x, y, 0))?,
            };
            let alpha = layout.colours.samples();
            let has_alpha = layout.samples > alpha;
            let seen = match layout.alpha {
                Alpha::Plain if has_alpha => {
                    on_white([colour[0], colour[1], colour[2], level(alpha)])
                }
                Alpha::Premultiplied if has_alpha => {
                    colour.map(|c| c.saturating_add(u16::MAX - level(alpha)))
                }
                Alpha::Plain | Alpha::Premultiplied | Alpha::None => colour,
            };
            out.set(x, y, seen);
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
