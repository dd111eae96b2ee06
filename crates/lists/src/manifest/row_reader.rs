//! Reads the rows of a list in CSV, of which none is too long.

use super::draft::MAX_ROW_BYTES;

/// Reads the rows of a list, the header too. Cells keep blanks at their ends: to remove them, the parser would copy each row.
pub(super) fn row_reader(bytes: &[u8], delimiter: u8) -> ::csv::Reader<BoundedRows<'_>> {
    ::csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .has_headers(false)
        .from_reader(BoundedRows::new(bytes))
}

/// Reads a list, and fails in a row that is longer than [`MAX_ROW_BYTES`].
pub(super) struct BoundedRows<'a> {
    rest: &'a [u8],
    /// Number of bytes that may still be read for the current row.
    left: usize,
}

impl<'a> BoundedRows<'a> {
    pub(super) const fn new(rest: &'a [u8]) -> Self {
        Self {
            rest,
            left: MAX_ROW_BYTES,
        }
    }

    /// Allows the bytes of another row.
    pub(super) const fn begin_row(&mut self) {
        self.left = MAX_ROW_BYTES;
    }
}

impl std::io::Read for BoundedRows<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.left == 0 && !self.rest.is_empty() {
            return Err(std::io::Error::other(format!(
                "the row has more than {MAX_ROW_BYTES} bytes; a closing quotation mark may be missing"
            )));
        }
        let len = buffer.len().min(self.left);
        let read = self.rest.read(&mut buffer[..len])?;
        self.left -= read;
        Ok(read)
    }
}

/// Returns whether all cells of a row are blank. Spreadsheet programs append such rows.
pub(super) fn is_blank(record: &::csv::ByteRecord) -> bool {
    record.as_slice().trim_ascii_start().is_empty()
}
