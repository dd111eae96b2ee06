//! Why a workbook cannot be read.

use mocban_core::domain::{first_names, sanitize};

/// Longest text of a workbook in a message, in characters.
const MAX_SHOWN: usize = 100;
/// Maximum number of sheets that a message names.
const MAX_SHEETS: usize = 8;

/// Why a workbook cannot be read, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorkbookError {
    /// A ZIP archive without a workbook of Excel.
    #[error("this is {0}, not an XLSX workbook; save the table as XLSX or as \"CSV UTF-8\"")]
    OtherArchive(&'static str),
    /// The archive or a part of it is damaged.
    #[error("the workbook is damaged: {}; save it again", sanitize(.0, MAX_SHOWN))]
    Damaged(String),
    /// A part is larger than any table.
    #[error("{} of the workbook has more than {} MiB; save the sheet alone", sanitize(.part, MAX_SHOWN), .limit >> 20)]
    TooLarge {
        /// The part.
        part: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// There is no sheet of this name.
    #[error("there is no sheet \"{}\"; the workbook has: {}", sanitize(.name, MAX_SHOWN), list(.sheets))]
    NoSheet {
        /// The name that was given.
        name: String,
        /// Names of the sheets.
        sheets: Vec<String>,
    },
    /// An id or a file name that the spreadsheet program took for a date or a number.
    #[error("cell {cell} of column \"{}\" is {kind}, {}; the spreadsheet program may have made it of a text such as {example}; give the column the format Text and write the cell again", sanitize(.column, MAX_SHOWN), sanitize(.text, MAX_SHOWN))]
    Converted {
        /// The cell, such as `B5`.
        cell: String,
        /// Name of its column.
        column: String,
        /// `a date` or `a power of ten`.
        kind: &'static str,
        /// What it shows.
        text: String,
        /// A text that is converted in this way.
        example: &'static str,
    },
    /// An id or a file name that is a number with text of its format.
    #[error("cell {cell} of column \"{}\" shows its number in the format {}, which is not read; give the column the format Text and write the cell again", sanitize(.column, MAX_SHOWN), sanitize(.code, MAX_SHOWN))]
    ShownNumber {
        /// The cell, such as `B5`.
        cell: String,
        /// Name of its column.
        column: String,
        /// The format.
        code: String,
    },
    /// An id or a file name that is a text with text of its format.
    #[error("cell {cell} of column \"{}\" shows its text in the format {}, which is not read; give the column the format Text and write the cell again", sanitize(.column, MAX_SHOWN), sanitize(.code, MAX_SHOWN))]
    ShownText {
        /// The cell, such as `B5`.
        cell: String,
        /// Name of its column.
        column: String,
        /// The format.
        code: String,
    },
    /// An id or a file name that is a number with more digits than spreadsheet programs keep.
    #[error("cell {cell} of column \"{}\" is the number {}, and spreadsheet programs keep only 15 digits of a number; give the column the format Text and write the cell again", sanitize(.column, MAX_SHOWN), sanitize(.number, MAX_SHOWN))]
    LongNumber {
        /// The cell, such as `B5`.
        cell: String,
        /// Name of its column.
        column: String,
        /// The number as stored.
        number: String,
    },
    /// A text longer than a spreadsheet program allows.
    #[error("cell {cell} has more than {limit} bytes of text; shorten it")]
    LongCell {
        /// The cell.
        cell: String,
        /// Longest text in bytes.
        limit: usize,
    },
    /// A formula that was never computed, as in a workbook that a script wrote.
    #[error(
        "cell {cell} has a formula without its result; open the workbook in a spreadsheet program and save it"
    )]
    NoResult {
        /// The cell.
        cell: String,
    },
    /// A formula that failed.
    #[error("cell {cell} has the error {}; correct it, or clear the cell", sanitize(.value, MAX_SHOWN))]
    CellError {
        /// The cell, such as `B5`.
        cell: String,
        /// The error, such as `#REF!`.
        value: String,
    },
    /// An id or a path on several lines.
    #[error("cell {cell} of column \"{}\" has a line break; write it on one line", sanitize(.column, MAX_SHOWN))]
    LineBreak {
        /// The cell, such as `B5`.
        cell: String,
        /// Name of its column.
        column: String,
    },
    /// A value that several columns share.
    #[error(
        "cells {} are merged over several columns; unmerge them, and write each value into its own cell", sanitize(.cells, MAX_SHOWN)
    )]
    MergedColumns {
        /// The cells, such as `B5:C6`.
        cells: String,
    },
    /// Several cells.
    #[error("{count} cells cannot be read:{}", lines(.first, *.count))]
    Cells {
        /// The first ones.
        first: Vec<WorkbookError>,
        /// Number of all.
        count: usize,
    },
}

impl WorkbookError {
    /// Returns whether the error is of one cell, so that others may be found.
    pub(super) const fn is_of_cell(&self) -> bool {
        matches!(
            self,
            Self::Converted { .. }
                | Self::ShownNumber { .. }
                | Self::ShownText { .. }
                | Self::LongNumber { .. }
                | Self::LongCell { .. }
                | Self::NoResult { .. }
                | Self::CellError { .. }
                | Self::LineBreak { .. }
                | Self::MergedColumns { .. }
        )
    }
}

/// Returns errors of cells, each on a line, and how many there are besides.
fn lines(first: &[WorkbookError], count: usize) -> String {
    let mut lines: Vec<String> = first.iter().map(ToString::to_string).collect();
    if let Some(more @ 1..) = count.checked_sub(first.len()) {
        lines.push(format!("and {more} more"));
    }
    format!("\n{}", lines.join("\n"))
}

/// Returns the first names of sheets in quotation marks.
pub(super) fn list(sheets: &[String]) -> String {
    let quoted = sheets.iter();
    let quoted = quoted.map(|name| format!("\"{}\"", sanitize(name, MAX_SHOWN)));
    first_names(&quoted.collect::<Vec<_>>(), MAX_SHEETS)
}
