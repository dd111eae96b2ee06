//! Decodes bilevel rows in the codings of faxes, ITU-T T.4 and T.6.

use fax::BitReader;
use fax::maps::{Mode, black, mode, white};

use crate::domain::cancel::poll;

/// How rows are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FaxCoding {
    /// Run lengths, with rows that start at a multiple of some bits.
    Rows { align_bits: usize },
    /// Rows that begin with an end-of-line code, or without any.
    Group3 { is_two_dimensional: bool },
    /// Each row refers to the row above.
    Group4,
}

/// The bits of a strip. After the end, zeros are seen, but cannot be consumed.
struct FaxBits<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl BitReader for FaxBits<'_> {
    type Error = ();

    fn peek(&self, bits: u8) -> Option<u16> {
        let byte = |at: usize| u32::from(self.bytes.get(at).copied().unwrap_or(0));
        let at = self.at / 8;
        let seen = byte(at) << 16 | byte(at + 1) << 8 | byte(at + 2);
        let seen = seen << (8 + self.at % 8) >> 8;
        // Of 24 bits, at least 17 are left.
        (bits <= 16).then(|| (seen >> (24 - u32::from(bits))) as u16)
    }

    fn consume(&mut self, bits: u8) -> Result<(), ()> {
        let end = self.at + usize::from(bits);
        if end > 8 * self.bytes.len() {
            return Err(());
        }
        self.at = end;
        Ok(())
    }

    fn bits_to_byte_boundary(&self) -> u8 {
        ((8 - self.at % 8) % 8) as u8
    }
}

/// Most zeros at the begin of a run-length code. More belong to an end-of-line code.
const MAX_CODE_ZEROS: u8 = 7;

impl FaxBits<'_> {
    /// Skips an end-of-line code with the zeros before it, if there is one.
    fn skip_end_of_line(&mut self) -> Option<()> {
        if self.peek(MAX_CODE_ZEROS + 1)? != 0 {
            return Some(());
        }
        while self.peek(1)? == 0 {
            self.consume(1).ok()?;
        }
        self.consume(1).ok()
    }

    /// Returns the length of a run of white or black.
    fn run(&mut self, is_black: bool) -> Option<usize> {
        let mut sum = 0_usize;
        loop {
            let part = if is_black {
                black::decode(self)?
            } else {
                white::decode(self)?
            };
            sum = sum.checked_add(usize::from(part))?;
            // Longer codes are followed by the code of the rest.
            if part < 64 {
                return Some(sum);
            }
        }
    }
}

/// Columns at which the colour changes, from white. The last may be the width, any number of times.
type Changes = Vec<usize>;

fn one_dimensional(bits: &mut FaxBits<'_>, width: usize, changes: &mut Changes) -> Option<()> {
    let (mut at, mut is_black) = (0, false);
    while at < width {
        at = (at + bits.run(is_black)?).min(width);
        changes.push(at);
        is_black = !is_black;
    }
    Some(())
}

/// Decodes a row that refers to the row `above`.
fn two_dimensional(
    bits: &mut FaxBits<'_>,
    width: usize,
    above: &[usize],
    changes: &mut Changes,
) -> Option<()> {
    // At the start of a row, a change above column 0 is still ahead.
    let (mut at, mut is_start, mut is_black) = (0, true, false);
    let mut next_above = 0;
    while at < width {
        // The changes above to the other colour have even positions if the colour is white.
        next_above -= next_above.min(2);
        while above
            .get(next_above)
            .is_some_and(|change| *change < at || *change == at && !is_start)
            || next_above % 2 != usize::from(is_black)
        {
            next_above += 1;
        }
        let change = |nth| above.get(nth).copied().unwrap_or(width);
        match mode::decode(bits)? {
            Mode::Pass => at = change(next_above + 1),
            Mode::Vertical(by) => {
                let column = change(next_above).checked_add_signed(isize::from(by))?;
                if column < at || column > width {
                    return None;
                }
                at = column;
                changes.push(at);
                is_black = !is_black;
            }
            Mode::Horizontal => {
                for colour in [is_black, !is_black] {
                    at = (at + bits.run(colour)?).min(width);
                    changes.push(at);
                }
            }
            Mode::Extension | Mode::EOF => return None,
        }
        is_start = false;
    }
    Some(())
}

/// Sets the bits of the black pixels.
fn paint(row: &mut [u8], changes: &[usize], width: usize) {
    for run in changes.chunks(2) {
        let (start, end) = (run[0], run.get(1).copied().unwrap_or(width));
        if start >= end {
            continue;
        }
        let (first, last) = (start / 8, (end - 1) / 8);
        let from = 0xff_u8 >> (start % 8);
        let to = 0xff_u8 << (7 - (end - 1) % 8);
        if first == last {
            row[first] |= from & to;
        } else {
            row[first] |= from;
            row[first + 1..last].fill(0xff);
            row[last] |= to;
        }
    }
}

/// Decodes rows of bits: 1 is black, and each row starts at a byte. Returns `None` if the bytes are damaged or truncated.
pub(super) fn decode(
    bytes: &[u8],
    [width, height]: [usize; 2],
    coding: FaxCoding,
) -> Option<Vec<u8>> {
    let row_bytes = width.div_ceil(8);
    let mut rows = vec![0; row_bytes * height];
    let mut bits = FaxBits { bytes, at: 0 };
    let (mut above, mut changes) = (Changes::new(), Changes::new());
    for row in rows.chunks_exact_mut(row_bytes) {
        poll();
        changes.clear();
        let refers_above = match coding {
            FaxCoding::Rows { align_bits } => {
                bits.at = bits.at.next_multiple_of(align_bits);
                false
            }
            FaxCoding::Group3 { is_two_dimensional } => {
                bits.skip_end_of_line()?;
                let is_reference = is_two_dimensional && bits.peek(1)? == 0;
                bits.consume(u8::from(is_two_dimensional)).ok()?;
                is_reference
            }
            FaxCoding::Group4 => true,
        };
        if refers_above {
            two_dimensional(&mut bits, width, &above, &mut changes)?;
        } else {
            one_dimensional(&mut bits, width, &mut changes)?;
        }
        paint(row, &changes, width);
        std::mem::swap(&mut above, &mut changes);
    }
    Some(rows)
}
