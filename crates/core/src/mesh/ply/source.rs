//! Readers of the numbers in a PLY body: words of text, or bytes in either byte order.

use super::header::{PlyElement, PlyScalar};
use crate::domain::cancel::{PollCounter, poll, polled};
use crate::mesh::error::MeshError;
use crate::mesh::text;

/// Why a row cannot be read.
pub(super) enum BodyFault {
    /// The body has ended.
    End,
    /// A word is not a number, or a number has no meaning there.
    Invalid(String),
    /// A fault that is reported without the row.
    Mesh(MeshError),
}

impl From<MeshError> for BodyFault {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

/// A sequence of numbers.
pub(super) trait NumberSource {
    /// Returns the next number. Every type fits a 64-bit float exactly.
    fn next(&mut self, kind: PlyScalar) -> Result<f64, BodyFault>;

    /// Skips numbers of one type.
    fn skip(&mut self, kind: PlyScalar, count: u64) -> Result<(), BodyFault>;

    /// Returns how many rows of an element the rest of the body can hold at most.
    fn max_rows(&self, element: &PlyElement) -> u64;

    /// Returns the bytes that have not been read.
    fn rest(&self) -> &[u8];

    /// Replaces `_into` by the positions of up to `_most` rows, each of three 32-bit floats. Does nothing if the body is
    /// text.
    fn packed_positions(&mut self, _most: usize, _into: &mut Vec<[f32; 3]>) {}

    /// Appends the triangles of up to `_most` rows, each an 8-bit count and 32-bit indices. Stops before a row whose
    /// count is not three. Appends nothing if the body is text or has ended.
    fn packed_triangles(&mut self, _most: usize, _into: &mut Vec<[u32; 3]>) {}
}

/// Words between white space; rows need not be lines.
pub(super) struct AsciiSource<'a> {
    rest: &'a [u8],
    counter: PollCounter,
}

impl<'a> AsciiSource<'a> {
    /// Starts at the beginning of a body.
    pub(super) fn new(rest: &'a [u8]) -> Self {
        Self {
            rest,
            counter: PollCounter::default(),
        }
    }

    /// Skips white space, part by part.
    fn skip_space(&mut self) {
        loop {
            let part = &self.rest[..self.rest.len().min(text::MAX_LINE_BYTES)];
            let space = part.len() - part.trim_ascii_start().len();
            self.rest = &self.rest[space..];
            if space == 0 || space < part.len() {
                return;
            }
            poll();
        }
    }

    fn word(&mut self) -> Result<&[u8], BodyFault> {
        self.skip_space();
        let longest = self.rest.len().min(text::MAX_LINE_BYTES + 1);
        let len = self.rest[..longest]
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(longest);
        if len > text::MAX_LINE_BYTES {
            let longest = text::MAX_LINE_BYTES;
            let reason = format!("a word has more than {longest} bytes");
            return Err(BodyFault::Invalid(reason));
        }
        self.counter.add(text::poll_items(len));
        let (word, rest) = self.rest.split_at(len);
        self.rest = rest;
        if word.is_empty() {
            return Err(BodyFault::End);
        }
        Ok(word)
    }
}

impl NumberSource for AsciiSource<'_> {
    fn next(&mut self, _: PlyScalar) -> Result<f64, BodyFault> {
        let word = self.word()?;
        text::number(word).ok_or_else(|| BodyFault::Invalid(text::not_a_number(word)))
    }

    fn skip(&mut self, _: PlyScalar, count: u64) -> Result<(), BodyFault> {
        for _ in polled(0..count) {
            self.word()?;
        }
        Ok(())
    }

    fn rest(&self) -> &[u8] {
        self.rest
    }

    fn max_rows(&self, element: &PlyElement) -> u64 {
        // A digit and a space per number, except for the last space of the file.
        (self.rest.len() as u64 + 1) / (2 * element.properties.len().max(1) as u64)
    }
}

/// Bytes of one order.
pub(super) struct BinarySource<'a, const BIG_ENDIAN: bool> {
    pub(super) rest: &'a [u8],
}

impl<'a, const BIG_ENDIAN: bool> BinarySource<'a, BIG_ENDIAN> {
    /// Returns up to `most` of the next rows without consuming them.
    fn rows<const SIZE: usize>(&self, most: usize) -> &'a [[u8; SIZE]] {
        let (rows, _) = self.rest.as_chunks();
        &rows[..most.min(rows.len())]
    }

    fn word(bytes: &[u8], offset: usize) -> u32 {
        let bytes = &bytes[offset..offset + 4];
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if BIG_ENDIAN {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    }

    /// Returns the next bytes, least significant first.
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], BodyFault> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or(BodyFault::End)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if BIG_ENDIAN {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG_ENDIAN: bool> NumberSource for BinarySource<'_, BIG_ENDIAN> {
    #[inline]
    fn next(&mut self, kind: PlyScalar) -> Result<f64, BodyFault> {
        Ok(match kind {
            PlyScalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            PlyScalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            PlyScalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            PlyScalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            PlyScalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            PlyScalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            PlyScalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            PlyScalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, kind: PlyScalar, count: u64) -> Result<(), BodyFault> {
        let bytes = count.saturating_mul(kind.size() as u64);
        if bytes > self.rest.len() as u64 {
            return Err(BodyFault::End);
        }
        self.rest = &self.rest[bytes as usize..];
        Ok(())
    }

    fn rest(&self) -> &[u8] {
        self.rest
    }

    fn max_rows(&self, element: &PlyElement) -> u64 {
        (self.rest.len() / element.min_size().max(1)) as u64
    }

    fn packed_positions(&mut self, most: usize, into: &mut Vec<[f32; 3]>) {
        let rows = self.rows::<12>(most);
        self.rest = &self.rest[rows.as_flattened().len()..];
        into.resize(rows.len(), [0.0; 3]);
        bytemuck::cast_slice_mut(into).copy_from_slice(rows);
        if BIG_ENDIAN != cfg!(target_endian = "big") {
            for bits in bytemuck::cast_slice_mut::<_, u32>(into) {
                *bits = bits.swap_bytes();
            }
        }
    }

    fn packed_triangles(&mut self, most: usize, into: &mut Vec<[u32; 3]>) {
        let rows = self.rows::<13>(most);
        let count = rows.iter().take_while(|row| row[0] == 3).count();
        let rows = &rows[..count];
        self.rest = &self.rest[rows.as_flattened().len()..];
        let corners = |row| [1, 5, 9].map(|offset| Self::word(row, offset));
        into.extend(rows.iter().map(|row| corners(row)));
    }
}
