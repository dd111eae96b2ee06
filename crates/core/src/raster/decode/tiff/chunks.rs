//! Reads the strips and tiles of a TIFF page: decompresses them and undoes predictors.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::ZlibDecoder;
use weezl::{BitOrder, LzwStatus};

use super::fax;
use super::layout::{TiffCompression, TiffLayout, TiffPredictor};
use super::photometric::Photometric;
use super::predictor::{undo_float, undo_horizontal};
use super::shared_chroma;
use crate::domain::FileKind;
use crate::domain::cancel::poll;
use crate::raster::decode::error::{self, DecodeError, broken};
use crate::raster::decode::jpeg;

/// Bytes that are decompressed between two polls for a cancellation.
const BYTES_PER_POLL: usize = 1 << 16;

fn truncated() -> DecodeError {
    DecodeError::Truncated(FileKind::Tiff)
}

fn damaged(method: &str) -> DecodeError {
    error::damaged(FileKind::Tiff, &format!("damaged {method} data"))
}

/// A part of the image that is decompressed: the rows of a strip or tile, of each plane.
pub(super) struct DecodedChunk<'b> {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) planes: Vec<Cow<'b, [u8]>>,
}

impl TiffLayout<'_> {
    /// Decompresses a strip or tile in all planes, as far as it shows the image.
    ///
    /// # Errors
    /// Returns an error if it is truncated or damaged.
    pub(super) fn decoded_chunk<'b>(
        &self,
        file: &'b [u8],
        at: usize,
    ) -> Result<DecodedChunk<'b>, DecodeError> {
        let [across, _] = self.chunk_counts();
        let (left, top) = (at % across * self.chunk[0], at / across * self.chunk[1]);
        let height = self.chunk[1].min(self.height - top);
        let planes = (0..self.planes).map(|plane| self.chunk_rows(file, plane, at, height));
        Ok(DecodedChunk {
            left,
            top,
            width: self.chunk[0].min(self.width - left),
            height,
            planes: planes.collect::<Result<_, _>>()?,
        })
    }

    /// Returns the bytes of a row of a strip or tile.
    pub(super) const fn row_bytes(&self) -> usize {
        (self.chunk[0] * self.samples * self.bits).div_ceil(8)
    }

    /// Returns the rows of a strip or tile, without a predictor: `rows` times [`TiffLayout::row_bytes`]. `at` counts the
    /// strips or tiles of a plane from left to right and from top to bottom.
    ///
    /// # Errors
    /// Returns an error if the strip or tile is truncated or damaged.
    fn chunk_rows<'b>(
        &self,
        file: &'b [u8],
        plane: usize,
        at: usize,
        rows: usize,
    ) -> Result<Cow<'b, [u8]>, DecodeError> {
        let [across, down] = self.chunk_counts();
        let stored = self.stored(file, plane * across * down + at)?;
        let row_bytes = self.row_bytes();
        let mut bytes = match self.photometric {
            Photometric::YCbCr(code)
                if self.compression != TiffCompression::Jpeg && code.shared != [1, 1] =>
            {
                let size = [self.chunk[0], rows];
                self.check_shared_chroma()?;
                let bytes = self.decompress(stored, shared_chroma::len(size, code.shared), rows)?;
                Cow::Owned(shared_chroma::expand(&bytes, size, code.shared))
            }
            _ => self.decompress(stored, rows * row_bytes, rows)?,
        };
        let undo = match self.predictor {
            TiffPredictor::None => return Ok(bytes),
            TiffPredictor::Horizontal => undo_horizontal,
            TiffPredictor::Float => undo_float,
        };
        for row in bytes.to_mut().chunks_exact_mut(row_bytes) {
            poll();
            undo(row, self.bits / 8, self.samples, self.is_big_endian);
        }
        Ok(bytes)
    }

    /// Returns whether the first strip or tile, of `rows` rows, has at least `len` bytes when it is decompressed.
    pub(super) fn unpacks_to(&self, file: &[u8], len: usize, rows: usize) -> bool {
        let stored = self.stored(file, 0);
        stored.is_ok_and(|stored| self.decompress(stored, len, rows).is_ok())
    }

    /// Returns the bytes of a strip or tile in the file.
    fn stored<'b>(&self, file: &'b [u8], at: usize) -> Result<Cow<'b, [u8]>, DecodeError> {
        let offset = self.offsets.get(at).and_then(|at| usize::try_from(at).ok());
        let rest = offset.and_then(|offset| file.get(offset..));
        let rest = rest.filter(|rest| !rest.is_empty()).ok_or_else(truncated)?;
        let count = self.byte_counts.and_then(|counts| counts.get(at));
        let count = count.and_then(|count| usize::try_from(count).ok());
        let stored = &rest[..count.unwrap_or(rest.len()).min(rest.len())];
        if !self.is_bit_reversed || self.compression == TiffCompression::Jpeg {
            return Ok(Cow::Borrowed(stored));
        }
        let mut reversed = Vec::with_capacity(stored.len());
        for part in stored.chunks(BYTES_PER_POLL) {
            poll();
            reversed.extend(part.iter().map(|byte| byte.reverse_bits()));
        }
        Ok(Cow::Owned(reversed))
    }

    fn check_shared_chroma(&self) -> Result<(), DecodeError> {
        if self.bits == 8 && self.samples == 3 && self.predictor == TiffPredictor::None {
            return Ok(());
        }
        let reason = "its chroma samples are shared by pixels in an unusual way; save it as RGB";
        Err(broken(FileKind::Tiff, reason))
    }

    /// Decompresses `len` bytes of a strip or tile with some rows.
    fn decompress<'b>(
        &self,
        stored: Cow<'b, [u8]>,
        len: usize,
        rows: usize,
    ) -> Result<Cow<'b, [u8]>, DecodeError> {
        let width = self.chunk[0];
        let bytes = match self.compression {
            TiffCompression::None if stored.len() < len => Err(truncated()),
            TiffCompression::None => {
                return Ok(match stored {
                    Cow::Borrowed(stored) => Cow::Borrowed(&stored[..len]),
                    Cow::Owned(mut stored) => {
                        stored.truncate(len);
                        Cow::Owned(stored)
                    }
                });
            }
            TiffCompression::Fax(_) if self.bits != 1 || self.samples != 1 => Err(damaged("fax")),
            TiffCompression::Fax(coding) => {
                fax::decode(&stored, [width, rows], coding).ok_or_else(|| damaged("fax"))
            }
            TiffCompression::Lzw => lzw(&stored, len),
            TiffCompression::Deflate => deflate(&stored, len),
            TiffCompression::PackBits => pack_bits(&stored, len),
            TiffCompression::Jpeg => self.jpeg(&stored, [width, rows]),
        };
        bytes.map(Cow::Owned)
    }

    fn jpeg(&self, stored: &[u8], [width, rows]: [usize; 2]) -> Result<Vec<u8>, DecodeError> {
        // Each strip is a JPEG without the tables, and the tables are one without an image: the end marker of the tables
        // and the start marker of the strip are left out.
        let joined = self.jpeg_tables.map(|tables| {
            let tables = tables.strip_suffix(&[0xff, 0xd9]).unwrap_or(tables);
            [tables, stored.get(2..).unwrap_or_default()].concat()
        });
        let failed = |reason: String| broken(FileKind::Tiff, &reason);
        let image = jpeg::decode_samples(
            joined.as_deref().unwrap_or(stored),
            [width, self.chunk[1].max(rows)],
        )
        .map_err(|error| match error {
            DecodeError::Damaged { found, .. } => {
                error::damaged(FileKind::Tiff, &format!("in a strip or tile, {found}"))
            }
            error => failed(format!("in a strip or tile, {error}")),
        })?;
        let len = width * rows * self.samples;
        if image.width != width || image.channels != self.samples || self.bits != 8 {
            return Err(failed(format!(
                "its strips or tiles are {width} pixels of {} samples wide, and one of them holds a JPEG of {} \
                 pixels of {}",
                self.samples, image.width, image.channels
            )));
        }
        let mut bytes = image.samples;
        if bytes.len() < len {
            return Err(truncated());
        }
        bytes.truncate(len);
        Ok(bytes)
    }
}

/// Fills a buffer from a decompressor, which returns how many bytes it wrote, and 0 at its end.
fn fill(
    len: usize,
    mut read: impl FnMut(&mut [u8]) -> Result<usize, DecodeError>,
) -> Result<Vec<u8>, DecodeError> {
    let mut bytes = vec![0; len];
    let mut at = 0;
    while at < len {
        poll();
        let end = len.min(at + BYTES_PER_POLL);
        match read(&mut bytes[at..end])? {
            0 => return Err(truncated()),
            count => at += count,
        }
    }
    Ok(bytes)
}

fn lzw(stored: &[u8], len: usize) -> Result<Vec<u8>, DecodeError> {
    let mut decoder = weezl::decode::Configuration::with_tiff_size_switch(BitOrder::Msb, 8).build();
    let mut rest = stored;
    fill(len, |target| {
        loop {
            let step = decoder.decode_bytes(rest, target);
            rest = &rest[step.consumed_in..];
            match step.status {
                Ok(LzwStatus::Ok) if step.consumed_out == 0 => {}
                Ok(_) => return Ok(step.consumed_out),
                Err(_) => return Err(damaged("LZW")),
            }
        }
    })
}

fn deflate(stored: &[u8], len: usize) -> Result<Vec<u8>, DecodeError> {
    let mut decoder = ZlibDecoder::new(stored);
    fill(len, |target| {
        decoder.read(target).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => truncated(),
            _ => damaged("Deflate"),
        })
    })
}

fn pack_bits(stored: &[u8], len: usize) -> Result<Vec<u8>, DecodeError> {
    let (mut bytes, mut rest) = (Vec::with_capacity(len), stored);
    let mut polled_at = 0;
    while bytes.len() < len {
        if bytes.len() - polled_at >= BYTES_PER_POLL {
            poll();
            polled_at = bytes.len();
        }
        let (head, after) = rest.split_first().ok_or_else(truncated)?;
        rest = match *head {
            128 => after,
            head @ 0..128 => {
                let (run, after) = after
                    .split_at_checked(usize::from(head) + 1)
                    .ok_or_else(truncated)?;
                bytes.extend(run);
                after
            }
            head => {
                let (value, after) = after.split_first().ok_or_else(truncated)?;
                bytes.resize(bytes.len() + 257 - usize::from(head), *value);
                after
            }
        };
    }
    bytes.truncate(len);
    Ok(bytes)
}
