//! Workbooks of Excel (XLSX): ZIP archives of XML. A sheet becomes CSV text, which is then read like any list.

mod archive;
mod cell_names;
mod cell_text;
mod error;
mod format_code;
mod hidden_rows;
mod merged;
mod number_format;
mod parts;
mod shown_number;
mod shown_text;
mod table;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_helpers;
#[cfg(test)]
mod tests;

use self::archive::WorkbookArchive;
use self::error::list;
use self::parts::Workbook;
pub use error::WorkbookError;

/// First bytes of a ZIP archive.
const START: &[u8] = b"PK\x03\x04";

/// A sheet as a table in CSV.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SheetTable {
    /// The table, separated by commas. Its lines are the rows of the sheet, so an error in a line is one in that row.
    pub csv: Vec<u8>,
    /// Says which sheet was read if there are others, how many values stand beside the table or below merged cells, and how
    /// many rows are hidden.
    pub warning: Option<String>,
}

/// Returns whether a file may be a workbook: a ZIP archive.
pub fn is_workbook(bytes: &[u8]) -> bool {
    bytes.starts_with(START)
}

/// Reads the sheet with a name, or else the first one that is not hidden. Numbers and dates become text as a reader sees
/// them, `0117` with the format `0000` and `2026-11-21`; of formulas, the stored results are taken, errors below the header
/// too. Cells that are merged over rows of a column all have the value of the first, and values below it are left out.
///
/// # Errors
/// Returns an error if the bytes are not those of an XLSX workbook, it is damaged or too large, has no such sheet, or if its
/// header has the error of a formula or a cell is merged over several columns.
pub fn read_sheet(bytes: &[u8], name: Option<&str>) -> Result<SheetTable, WorkbookError> {
    let archive = WorkbookArchive::open(bytes)?;
    let workbook = Workbook::read(&archive)?;
    if workbook.sheets.is_empty() {
        return Err(archive::damaged("it has no sheets"));
    }
    let visible = workbook.sheets.iter().filter(|sheet| !sheet.is_hidden);
    let sheet = match name {
        Some(name) => workbook.sheets.iter().find(|sheet| sheet.name == name),
        None => visible.clone().next().or(workbook.sheets.first()),
    };
    let sheets = || {
        workbook
            .sheets
            .iter()
            .map(|sheet| sheet.name.clone())
            .collect()
    };
    let sheet = sheet.ok_or_else(|| WorkbookError::NoSheet {
        name: name.unwrap_or_default().to_owned(),
        sheets: sheets(),
    })?;
    let text = archive.text(&sheet.file)?;
    let text = text.ok_or_else(|| archive::damaged("the file of the sheet is missing"))?;
    let others: Vec<String> = visible
        .filter(|other| *other != sheet)
        .map(|other| other.name.clone())
        .collect();
    let is_chosen = name.is_some() || others.is_empty();
    let warning = || {
        let (read, others) = (list(std::slice::from_ref(&sheet.name)), list(&others));
        format!("only the sheet {read} is read; name another one with --sheet: {others}")
    };
    let (csv, left_out) = table::csv(&workbook, &sheet.file, &text)?;
    let warnings = (!is_chosen).then(warning).into_iter();
    let warnings: Vec<String> = warnings.chain(left_out).collect();
    Ok(SheetTable {
        csv,
        warning: (!warnings.is_empty()).then(|| warnings.join("; ")),
    })
}
