//! The pages of a TIFF file: chooses the one page of a print, and reads its orientation.

use super::error::{DecodeError, broken};
use crate::domain::FileKind;

/// Flags of `NewSubfileType`: a reduced copy of another page, and a mask.
const REDUCED: u64 = 1;
const MASK: u64 = 4;
/// Value of the older `SubfileType` for a reduced copy of another page.
const OLD_REDUCED: u64 = 2;
/// Most pages that are counted.
const MAX_PAGES: usize = 1000;

const NEW_SUBFILE_TYPE: u64 = 254;
const SUBFILE_TYPE: u64 = 255;
const ORIENTATION: u64 = 274;

/// Reads the numbers of a TIFF file. Offsets in the file have eight bytes in a `BigTIFF`, and four bytes otherwise.
#[derive(Debug, Clone, Copy)]
pub(super) struct TiffBytes<'b> {
    bytes: &'b [u8],
    is_big_endian: bool,
    is_big_tiff: bool,
}

impl<'b> TiffBytes<'b> {
    /// Reads the header. Returns `None` if the file is too short for one.
    pub(super) fn new(bytes: &'b [u8]) -> Option<Self> {
        let mut file = Self {
            bytes,
            is_big_endian: bytes.starts_with(b"MM"),
            is_big_tiff: false,
        };
        file.is_big_tiff = file.number(2, 2)? == 43;
        Some(file)
    }

    /// Returns a number of `len` bytes, or `None` if the file ends before its last byte.
    pub(super) fn number(&self, at: usize, len: usize) -> Option<u64> {
        let field = self.bytes.get(at..at.checked_add(len)?)?;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if self.is_big_endian {
            field.iter().fold(0, add)
        } else {
            field.iter().rev().fold(0, add)
        })
    }

    /// Returns two bytes in the file's byte order.
    pub(super) const fn short(&self, value: u16) -> [u8; 2] {
        if self.is_big_endian {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        }
    }

    /// Returns the position and the length, in bytes, of the field that holds the offset of the first page.
    const fn first_page_field(&self) -> (usize, usize) {
        if self.is_big_tiff { (8, 8) } else { (4, 4) }
    }

    /// Returns the first page, or `None` if its offset is after the end of the file.
    pub(super) fn first_page(&self) -> Option<TiffPage<'b>> {
        let (at, len) = self.first_page_field();
        self.page_at(self.number(at, len)?)
    }

    fn page_at(&self, offset: u64) -> Option<TiffPage<'b>> {
        let at = usize::try_from(offset).ok()?;
        let count_len = if self.is_big_tiff { 8 } else { 2 };
        let entries = usize::try_from(self.number(at, count_len)?).ok()?;
        Some(TiffPage {
            file: *self,
            at,
            first_entry: at + count_len,
            entries,
        })
    }
}

/// A page (image file directory).
#[derive(Debug, Clone, Copy)]
pub(super) struct TiffPage<'b> {
    file: TiffBytes<'b>,
    at: usize,
    first_entry: usize,
    entries: usize,
}

impl<'b> TiffPage<'b> {
    const fn entry_len(&self) -> usize {
        if self.file.is_big_tiff { 20 } else { 12 }
    }

    /// Returns the offset and the length, in bytes, of a tag's value.
    pub(super) fn value_field(&self, tag: u64) -> Option<(usize, usize)> {
        let entry_at = |nth: usize| {
            let offset = nth.checked_mul(self.entry_len())?;
            self.first_entry.checked_add(offset)
        };
        let len = self.file.bytes.len();
        let at = (0..self.entries)
            .map_while(entry_at)
            .take_while(|at| *at < len)
            .find(|at| self.file.number(*at, 2) == Some(tag))?;
        let value_len = match self.file.number(at + 2, 2)? {
            3 => 2,
            4 => 4,
            _ => return None,
        };
        Some((
            at + self.entry_len() - self.file.first_page_field().1,
            value_len,
        ))
    }

    /// Returns the value of a tag with one whole number.
    fn value(&self, tag: u64) -> Option<u64> {
        let (at, len) = self.value_field(tag)?;
        self.file.number(at, len)
    }

    /// Returns whether the page is a reduced copy or a mask of another page.
    fn is_auxiliary(&self) -> bool {
        let flags = self.value(NEW_SUBFILE_TYPE).unwrap_or(0);
        flags & (REDUCED | MASK) != 0 || self.value(SUBFILE_TYPE) == Some(OLD_REDUCED)
    }

    /// Returns the next page, or `None` after the last.
    ///
    /// # Errors
    /// Returns an error if the file ends before the next page.
    fn next(&self) -> Result<Option<TiffPage<'b>>, DecodeError> {
        let truncated = || DecodeError::Truncated(FileKind::Tiff);
        let entries = self.entries.checked_mul(self.entry_len());
        let at = entries.and_then(|len| self.first_entry.checked_add(len));
        let len = self.file.first_page_field().1;
        let offset = at.and_then(|at| self.file.number(at, len));
        match offset.ok_or_else(truncated)? {
            0 => Ok(None),
            offset => self.file.page_at(offset).map(Some).ok_or_else(truncated),
        }
    }
}

/// The page of a print.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct PrintPage {
    /// The file with this page first, if another page is first in the file.
    pub(super) reordered: Option<Vec<u8>>,
    /// EXIF orientation, if the page has one.
    pub(super) orientation: Option<u64>,
}

/// Finds the only full page of a file. Skips reduced copies and masks, but accepts any single page.
///
/// # Errors
/// Returns an error if several pages are full, because only the user knows which one is the print. Also returns an
/// error if none of several pages is full, or if a page cannot be read.
pub(super) fn find_print_page(bytes: &[u8]) -> Result<PrintPage, DecodeError> {
    let truncated = || DecodeError::Truncated(FileKind::Tiff);
    let file = TiffBytes::new(bytes).ok_or_else(truncated)?;
    let first = file.first_page().ok_or_else(truncated)?;
    let (mut page, mut count, mut full) = (Some(first), 0, Vec::new());
    while let Some(this) = page {
        count += 1;
        if count > MAX_PAGES {
            let reason = format!("it has more than {MAX_PAGES} pages; a print is one page");
            return Err(broken(FileKind::Tiff, &reason));
        }
        if !this.is_auxiliary() {
            full.push(this);
        }
        page = this.next()?;
    }
    let print = match full[..] {
        [print] => print,
        // The only page is marked as a copy or a mask.
        [] if count == 1 => first,
        [] => return Err(DecodeError::Pages { full: 0, count }),
        _ => {
            return Err(DecodeError::Pages {
                full: full.len(),
                count,
            });
        }
    };
    Ok(PrintPage {
        reordered: (print.at != first.at).then(|| with_first_page(&file, print.at)),
        orientation: print.value(ORIENTATION),
    })
}

/// Returns the file with a changed header, so that decoders find this page first.
fn with_first_page(file: &TiffBytes<'_>, at: usize) -> Vec<u8> {
    let (field, len) = file.first_page_field();
    let mut changed = file.bytes.to_vec();
    let offset = (at as u64).to_le_bytes();
    let target = &mut changed[field..field + len];
    target.copy_from_slice(&offset[..len]);
    if file.is_big_endian {
        target.reverse();
    }
    changed
}
