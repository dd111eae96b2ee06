//! Where the numbers of a PLY body come from: words of text or bytes of either order.

use super::super::text;
use super::header::{Element, Scalar};

/// Why there is no next number.
pub(super) enum NoNumber {
    /// The body is at its end.
    End,
    /// A word that is no number.
    Word(String),
}

/// A run of numbers.
pub(super) trait Source {
    /// The next number. Every type fits a 64-bit float without loss.
    fn next(&mut self, kind: Scalar) -> Result<f64, NoNumber>;

    /// Steps over some numbers of one type.
    fn skip(&mut self, kind: Scalar, count: u64) -> Result<(), NoNumber>;

    /// How many rows of an element the rest can hold at most.
    fn most_rows(&self, element: &Element) -> u64;

    /// The next positions, up to `most`, of rows that are nothing but three 32-bit floats; none from text and at the
    /// body's end.
    fn plain_positions(&mut self, _most: usize, _into: &mut Vec<[f32; 3]>) {}

    /// The next triangles, up to `most`, of rows that are nothing but a byte that counts and 32-bit indices; none also
    /// where a byte does not say three.
    fn plain_triangles(&mut self, _most: usize, _into: &mut Vec<[u32; 3]>) {}
}

/// Words between white space; rows need not be lines.
pub(super) struct Ascii<'a> {
    rest: &'a [u8],
}

impl<'a> Ascii<'a> {
    pub(super) const fn new(rest: &'a [u8]) -> Self {
        Self { rest }
    }
}

impl Source for Ascii<'_> {
    fn next(&mut self, _: Scalar) -> Result<f64, NoNumber> {
        let rest = self.rest.trim_ascii_start();
        let len = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        let (word, rest) = rest.split_at(len);
        self.rest = rest;
        if word.is_empty() {
            return Err(NoNumber::End);
        }
        text::number(word).ok_or_else(|| NoNumber::Word(text::not_a_number(word)))
    }

    fn skip(&mut self, kind: Scalar, count: u64) -> Result<(), NoNumber> {
        for _ in 0..count {
            self.next(kind)?;
        }
        Ok(())
    }

    fn most_rows(&self, element: &Element) -> u64 {
        // A digit and a space for each number, but for the last space of the file.
        (self.rest.len() as u64 + 1) / (2 * element.properties.len().max(1) as u64)
    }
}

/// Bytes of one order.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    rest: &'a [u8],
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    pub(super) const fn new(rest: &'a [u8]) -> Self {
        Self { rest }
    }

    /// The next few rows of so many bytes, as far as there are any; nothing is taken.
    fn rows<const SIZE: usize>(&self, most: usize) -> &'a [[u8; SIZE]] {
        let (rows, _) = self.rest.as_chunks();
        &rows[..most.min(rows.len())]
    }

    fn word(bytes: &[u8], place: usize) -> u32 {
        let bytes = &bytes[place..place + 4];
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if BIG_ENDIAN {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    }

    /// The next bytes, lowest first.
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], NoNumber> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or(NoNumber::End)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if BIG_ENDIAN {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG_ENDIAN: bool> Source for Binary<'_, BIG_ENDIAN> {
    #[inline]
    fn next(&mut self, kind: Scalar) -> Result<f64, NoNumber> {
        Ok(match kind {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, kind: Scalar, count: u64) -> Result<(), NoNumber> {
        let bytes = count.saturating_mul(kind.size() as u64);
        if bytes > self.rest.len() as u64 {
            return Err(NoNumber::End);
        }
        self.rest = &self.rest[bytes as usize..];
        Ok(())
    }

    fn most_rows(&self, element: &Element) -> u64 {
        (self.rest.len() / element.least_size().max(1)) as u64
    }

    fn plain_positions(&mut self, most: usize, into: &mut Vec<[f32; 3]>) {
        let rows = self.rows::<12>(most);
        self.rest = &self.rest[rows.as_flattened().len()..];
        into.extend(
            rows.iter()
                .map(|row| [0, 4, 8].map(|place| f32::from_bits(Self::word(row, place)))),
        );
    }

    fn plain_triangles(&mut self, most: usize, into: &mut Vec<[u32; 3]>) {
        let rows = self.rows::<13>(most);
        let count = rows.iter().take_while(|row| row[0] == 3).count();
        let rows = &rows[..count];
        self.rest = &self.rest[rows.as_flattened().len()..];
        into.extend(
            rows.iter()
                .map(|row| [1, 5, 9].map(|place| Self::word(row, place))),
        );
    }
}
