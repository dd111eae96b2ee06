//! How the pixels of a TIFF page are stored, according to its tags.

use super::fax::FaxCoding;
use super::photometric::{AlphaSample, Photometric};
use super::tag_numbers::{common, number, refuse, values};
use crate::domain::cancel::polled;
use crate::raster::decode::error::DecodeError;
use crate::raster::decode::limits::ImageLimits;
use crate::raster::decode::tags::{TagDirectory, TagValues};

/// Bits that a sample of 9 to 15 bits takes if it is padded.
const PADDED_BITS: usize = 16;
/// Most samples of a pixel.
const MAX_SAMPLES: u64 = 64;

const WIDTH: u64 = 256;
const HEIGHT: u64 = 257;
const BITS_PER_SAMPLE: u64 = 258;
const COMPRESSION: u64 = 259;
const FILL_ORDER: u64 = 266;
const STRIP_OFFSETS: u64 = 273;
const SAMPLES_PER_PIXEL: u64 = 277;
const ROWS_PER_STRIP: u64 = 278;
const STRIP_BYTE_COUNTS: u64 = 279;
const PLANAR: u64 = 284;
const T4_OPTIONS: u64 = 292;
const PREDICTOR: u64 = 317;
const TILE_WIDTH: u64 = 322;
const TILE_LENGTH: u64 = 323;
const TILE_OFFSETS: u64 = 324;
const TILE_BYTE_COUNTS: u64 = 325;
const SAMPLE_FORMAT: u64 = 339;
const JPEG_TABLES: u64 = 347;

/// How strips and tiles are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TiffCompression {
    None,
    Fax(FaxCoding),
    Lzw,
    Jpeg,
    Deflate,
    PackBits,
}

/// What a sample differs from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TiffPredictor {
    None,
    /// The same sample of the pixel to the left.
    Horizontal,
    /// The same, for the bytes of floats, stored by significance.
    Float,
}

/// How the pixels of a page are stored.
pub(super) struct TiffLayout<'b> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) photometric: Photometric,
    /// Bits that a sample takes, and bits of the largest sample, which are fewer if samples are padded.
    pub(super) bits: usize,
    pub(super) used_bits: usize,
    pub(super) is_float: bool,
    /// Samples per pixel; in planes, if there are several, of one sample.
    pub(super) samples: usize,
    pub(super) planes: usize,
    pub(super) alpha: Option<AlphaSample>,
    pub(super) compression: TiffCompression,
    pub(super) predictor: TiffPredictor,
    /// Whether the first pixel is in the least significant bit of a byte.
    pub(super) is_bit_reversed: bool,
    pub(super) is_big_endian: bool,
    /// Tables that all JPEG strips or tiles share.
    pub(super) jpeg_tables: Option<&'b [u8]>,
    /// Width and height of a strip or tile.
    pub(super) chunk: [usize; 2],
    pub(super) offsets: TagValues<'b>,
    /// `None` if the lengths of the strips are not stored.
    pub(super) byte_counts: Option<TagValues<'b>>,
}

impl<'b> TiffLayout<'b> {
    /// Reads the tags of a page, and checks the size of the image.
    ///
    /// # Errors
    /// Returns an error if the image is too large, or stored in a way that is not read.
    pub(super) fn read(page: &TagDirectory<'b>, limits: &ImageLimits) -> Result<Self, DecodeError> {
        let side = |tag| {
            let side = number(page, tag, 0)?;
            u32::try_from(side).or_else(|_| refuse(&format!("a side of it has {side} pixels")))
        };
        let [width, height] = [side(WIDTH)?, side(HEIGHT)?];
        limits.check_size(width, height)?;
        let (width, height) = (width as usize, height as usize);
        let samples = number(page, SAMPLES_PER_PIXEL, 1)?;
        if !(1..=MAX_SAMPLES).contains(&samples) {
            return refuse(&format!(
                "it has {samples} samples per pixel; at most {MAX_SAMPLES} are read"
            ));
        }
        let samples = samples as usize;
        let compression = compression(page)?;
        let is_fax = matches!(compression, TiffCompression::Fax(_));
        let photometric = Photometric::read(page, is_fax, samples)?;
        let (bits, is_float) = sample_type(page)?;
        let planes = match number(page, PLANAR, 1)? {
            2 => samples,
            _ => 1,
        };
        let (chunk, [offsets, byte_counts]) = chunks(page, width, height)?;
        let Some(offsets) = offsets else {
            return refuse("it has neither strips nor tiles");
        };
        let mut layout = Self {
            width,
            height,
            bits,
            used_bits: bits,
            is_float,
            samples: if planes > 1 { 1 } else { samples },
            planes,
            alpha: AlphaSample::find(page, &photometric, samples)?,
            photometric,
            compression,
            predictor: predictor(page, compression)?,
            is_bit_reversed: number(page, FILL_ORDER, 1)? == 2,
            is_big_endian: page.file.is_big_endian,
            jpeg_tables: values(page, JPEG_TABLES)?.and_then(|tables| tables.bytes()),
            chunk,
            offsets,
            byte_counts,
        };
        if layout.is_padded() {
            layout.bits = PADDED_BITS;
        }
        layout.check_memory(limits)?;
        Ok(layout)
    }

    /// Returns whether the first strip or tile has 16 bits for each sample of 9 to 15 bits, as some cameras store them.
    /// Compressed samples count as not padded.
    fn is_padded(&self) -> bool {
        let [width, rows] = [self.chunk[0], self.chunk[1].min(self.height)];
        let bytes = (width as u64).saturating_mul((2 * rows * self.samples) as u64);
        let stored = self.byte_counts.and_then(|counts| counts.get(0));
        matches!(self.bits, 9..16)
            && self.compression == TiffCompression::None
            && stored.is_some_and(|stored| stored >= bytes)
    }

    /// Finds out from the first strip or tile whether compressed samples of 9 to 15 bits take 16 bits each: more bytes come
    /// out than packed samples have.
    ///
    /// # Errors
    /// Returns an error if samples that are packed have a predictor.
    pub(super) fn find_compressed_padding(&mut self, file: &[u8]) -> Result<(), DecodeError> {
        if !matches!(self.bits, 9..16) || self.compression == TiffCompression::None {
            return Ok(());
        }
        let rows = self.chunk[1].min(self.height);
        let packed = rows * self.row_bytes();
        let padded = rows * self.chunk[0] * self.samples * PADDED_BITS / 8;
        // The last bytes may be missing, and a few may follow packed samples.
        if self.unpacks_to(file, usize::midpoint(packed, padded) + 1, rows) {
            self.bits = PADDED_BITS;
        }
        match self.predictor {
            TiffPredictor::Horizontal if self.bits != PADDED_BITS => refuse_predictor(self.bits, 2),
            _ => Ok(()),
        }
    }

    /// Returns how many strips or tiles are side by side, and how many are one below the other.
    pub(super) const fn chunk_counts(&self) -> [usize; 2] {
        let [width, height] = self.chunk;
        [self.width.div_ceil(width), self.height.div_ceil(height)]
    }

    /// Returns where the strip or tile that is stored last ends, if its place can be read.
    pub(super) fn end(&self) -> Option<u64> {
        let [across, down] = self.chunk_counts();
        let places = polled(0..across * down * self.planes);
        let places = places.map(|at| self.offsets.get(at).map(|offset| (offset, at)));
        let (offset, at) = places.max().flatten()?;
        let bytes = self.byte_counts.and_then(|counts| counts.get(at));
        Some(offset.saturating_add(bytes.unwrap_or(1)))
    }

    /// Checks the memory for all strips or tiles, which may be larger than the image.
    fn check_memory(&self, limits: &ImageLimits) -> Result<(), DecodeError> {
        let [across, down] = self.chunk_counts();
        let factors = [across, down, self.planes, self.chunk[0], self.chunk[1]];
        let sample_bytes = self.samples * self.bits.div_ceil(8);
        let bytes = factors
            .iter()
            .try_fold(sample_bytes as u64, |bytes, factor| {
                bytes.checked_mul(*factor as u64)
            });
        let limit = limits.max_decoder_bytes();
        if bytes.is_none_or(|bytes| bytes > limit) {
            return refuse(&format!(
                "its strips or tiles of {} x {} pixels need more than {limit} bytes of memory",
                self.chunk[0], self.chunk[1]
            ));
        }
        let [have, want] = [self.offsets.len(), across * down * self.planes];
        if have < want {
            return refuse(&format!("it has {have} of {want} strips or tiles"));
        }
        Ok(())
    }
}

fn compression(page: &TagDirectory<'_>) -> Result<TiffCompression, DecodeError> {
    let name = match number(page, COMPRESSION, 1)? {
        1 => return Ok(TiffCompression::None),
        2 => return Ok(TiffCompression::Fax(FaxCoding::Rows { align_bits: 8 })),
        3 => {
            let is_two_dimensional = number(page, T4_OPTIONS, 0)? & 1 == 1;
            return Ok(TiffCompression::Fax(FaxCoding::Group3 {
                is_two_dimensional,
            }));
        }
        4 => return Ok(TiffCompression::Fax(FaxCoding::Group4)),
        5 => return Ok(TiffCompression::Lzw),
        7 => return Ok(TiffCompression::Jpeg),
        8 | 32946 => return Ok(TiffCompression::Deflate),
        32771 => return Ok(TiffCompression::Fax(FaxCoding::Rows { align_bits: 16 })),
        32773 => return Ok(TiffCompression::PackBits),
        6 => "old-style JPEG".to_owned(),
        34712 | 33003 | 33005 => "JPEG 2000".to_owned(),
        34887 => "LERC".to_owned(),
        34925 => "LZMA".to_owned(),
        50000 => "ZSTD".to_owned(),
        50001 => "WebP".to_owned(),
        50002 => "JPEG XL".to_owned(),
        other => format!("method {other}"),
    };
    refuse(&format!(
        "it is compressed by {name}; save it again with LZW or without compression"
    ))
}

/// Returns the bits of a sample, and whether samples are floats.
fn sample_type(page: &TagDirectory<'_>) -> Result<(usize, bool), DecodeError> {
    let bits = common(page, BITS_PER_SAMPLE, "sizes", 1)?;
    let format = common(page, SAMPLE_FORMAT, "types", 1)?;
    match (format, bits) {
        // 4 stands for samples that the program did not describe.
        (1 | 4, 1..=32 | 64) => Ok((bits as usize, false)),
        (3, 16 | 32 | 64) => Ok((bits as usize, true)),
        (1 | 3 | 4, _) => refuse(&format!(
            "its samples have {bits} bits; save it with 8 or 16 bits per sample"
        )),
        _ => refuse(
            "its samples are signed or of an unknown kind; unsigned numbers and floats are read; save it with 8 or 16 unsigned bits",
        ),
    }
}

/// Returns the predictor, which other than LZW and Deflate do not have.
fn predictor(
    page: &TagDirectory<'_>,
    compression: TiffCompression,
) -> Result<TiffPredictor, DecodeError> {
    if !matches!(compression, TiffCompression::Lzw | TiffCompression::Deflate) {
        return Ok(TiffPredictor::None);
    }
    let (bits, is_float) = sample_type(page)?;
    match number(page, PREDICTOR, 1)? {
        1 => Ok(TiffPredictor::None),
        // Of samples of 9 to 15 bits, only padded ones can have it.
        2 if matches!(bits, 8..=16 | 32 | 64) => Ok(TiffPredictor::Horizontal),
        3 if is_float => Ok(TiffPredictor::Float),
        other => refuse_predictor(bits, other),
    }
}

fn refuse_predictor<T>(bits: usize, predictor: u64) -> Result<T, DecodeError> {
    refuse(&format!(
        "its samples of {bits} bits are stored by the predictor {predictor}; save it without a predictor"
    ))
}

/// Returns the size of a strip or tile, and where they are.
type Chunks<'b> = ([usize; 2], [Option<TagValues<'b>>; 2]);

fn chunks<'b>(
    page: &TagDirectory<'b>,
    width: usize,
    height: usize,
) -> Result<Chunks<'b>, DecodeError> {
    let side = |tag, most: usize| {
        let side = number(page, tag, most as u64)?;
        let side = usize::try_from(side).ok().filter(|side| *side > 0);
        side.map_or_else(|| refuse(&format!("its tag {tag} is 0")), Ok)
    };
    if page.has(TILE_WIDTH) {
        let size = [side(TILE_WIDTH, width)?, side(TILE_LENGTH, height)?];
        let [offsets, counts] = [TILE_OFFSETS, TILE_BYTE_COUNTS];
        // Some programs describe tiles by the tags of strips.
        let offsets = values(page, offsets)?
            .map_or_else(|| values(page, STRIP_OFFSETS), |at| Ok(Some(at)))?;
        let counts = values(page, counts)?
            .map_or_else(|| values(page, STRIP_BYTE_COUNTS), |at| Ok(Some(at)))?;
        return Ok((size, [offsets, counts]));
    }
    let rows = side(ROWS_PER_STRIP, height)?.min(height);
    let places = [
        values(page, STRIP_OFFSETS)?,
        values(page, STRIP_BYTE_COUNTS)?,
    ];
    Ok(([width, rows], places))
}
