//! The text of a cell: what a reader sees of its value.

use super::archive::damaged;
use super::cell_names::cell_name;
use super::error::WorkbookError;
use super::parts::Workbook;
use crate::manifest::{formula_error, is_id_or_path_column};

/// Longest text of a cell, in bytes. Excel allows 32,767 units of UTF-16, each of up to 3 bytes in UTF-8.
const MAX_CELL_BYTES: usize = 3 * 32_767;

/// Spreadsheet programs keep the first 15 digits of a number, so smaller ones are exact.
const MAX_NUMBER: f64 = 1e15;

/// A cell whose element is open.
#[derive(Default)]
pub(super) struct OpenCell {
    pub(super) column: usize,
    pub(super) kind: String,
    pub(super) style: usize,
    pub(super) has_formula: bool,
    /// Text of its value.
    pub(super) value: String,
}

/// Where a cell stands, and what its column is for.
#[derive(Clone, Copy)]
pub(super) struct CellPlace<'t> {
    pub(super) workbook: &'t Workbook,
    /// Its row, from 1.
    pub(super) row: usize,
    pub(super) column: usize,
    /// The header of its column, if the values there are names.
    pub(super) header: Option<&'t str>,
    pub(super) is_below_header: bool,
}

impl CellPlace<'_> {
    /// Returns the text of a cell.
    pub(super) fn text(&self, cell: OpenCell) -> Result<String, WorkbookError> {
        let OpenCell {
            kind,
            style,
            has_formula,
            value,
            ..
        } = cell;
        Ok(match kind.as_str() {
            "s" => {
                let index = value.trim().parse::<usize>().ok();
                let string = index.and_then(|index| self.workbook.strings.get(index));
                let string =
                    string.ok_or_else(|| damaged(&format!("there is no string {value}")))?;
                self.check_text(string)?;
                let shown = self.shown_text(style, string)?;
                shown.unwrap_or_else(|| string.clone())
            }
            "b" if value.trim() == "1" => "true".to_owned(),
            "b" => "false".to_owned(),
            // Parsers decide by the column whether the error is refused.
            "e" if self.is_below_header && formula_error(value.trim()).is_some() => {
                value.trim().to_owned()
            }
            "e" => {
                let cell = self.name();
                return Err(WorkbookError::CellError { cell, value });
            }
            "str" | "inlineStr" | "d" => {
                self.check_text(&value)?;
                self.shown_text(style, &value)?.unwrap_or(value)
            }
            _ if value.trim().is_empty() && has_formula => {
                let cell = self.name();
                return Err(WorkbookError::NoResult { cell });
            }
            _ if value.trim().is_empty() => String::new(),
            _ => self.number(style, &value)?,
        })
    }

    /// Returns the text of a number. Refuses one in a column of names that may have been another text.
    fn number(&self, style: usize, value: &str) -> Result<String, WorkbookError> {
        let format = self.workbook.formats.get(style).copied();
        let format = format.unwrap_or_default();
        let text = format.text(value, self.workbook.is_1904);
        let Some(header) = self.header else {
            return Ok(text);
        };
        let column = || header.to_owned();
        if let Some((kind, example)) = format.conversion() {
            return Err(WorkbookError::Converted {
                cell: self.name(),
                column: column(),
                kind,
                text,
                example,
            });
        }
        let number = value.trim().parse::<f64>();
        if number.is_ok_and(|number| number.abs() >= MAX_NUMBER) {
            return Err(WorkbookError::LongNumber {
                cell: self.name(),
                column: column(),
                number: value.trim().to_owned(),
            });
        }
        let Some(shown) = self.workbook.shown_numbers.get(&style) else {
            return Ok(text);
        };
        let shown = shown.text(value);
        shown.map_err(|code| WorkbookError::ShownNumber {
            cell: self.name(),
            column: column(),
            code,
        })
    }

    /// Returns what a reader sees of the text of a name, if its format adds something.
    fn shown_text(&self, style: usize, text: &str) -> Result<Option<String>, WorkbookError> {
        let Some(header) = self.header.filter(|_| !text.trim().is_empty()) else {
            return Ok(None);
        };
        let Some(shown) = self.workbook.shown_texts.get(&style) else {
            return Ok(None);
        };
        let shown = shown.text(text);
        shown.map(Some).map_err(|code| WorkbookError::ShownText {
            cell: self.name(),
            column: header.to_owned(),
            code,
        })
    }

    /// Refuses a text that is too long, and an id or a path on several lines.
    fn check_text(&self, text: &str) -> Result<(), WorkbookError> {
        if text.len() > MAX_CELL_BYTES {
            let (cell, limit) = (self.name(), MAX_CELL_BYTES);
            return Err(WorkbookError::LongCell { cell, limit });
        }
        if let Some(header) = self.header
            && text.trim().contains(['\n', '\r'])
            && is_id_or_path_column(header)
        {
            let (cell, column) = (self.name(), header.to_owned());
            return Err(WorkbookError::LineBreak { cell, column });
        }
        Ok(())
    }

    /// Returns the name of the cell, such as `B5`.
    fn name(&self) -> String {
        cell_name(self.column, self.row)
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_sheet;
    use super::super::test_helpers::workbook;

    #[test]
    fn ids_with_more_digits_than_a_number_keeps_are_refused() {
        let read = |header: &str, number: &str| {
            let head = format!("<c t=\"inlineStr\"><is><t>{header}</t></is></c>");
            let rows = format!("<row>{head}</row><row><c><v>{number}</v></c></row>");
            read_sheet(&workbook(&[("a", &rows)], "", ""), None)
        };
        for number in ["12345678901234567", "1E+20", "-1000000000000000"] {
            assert_eq!(
                read("id", number).expect_err(number).to_string(),
                format!(
                    "cell A2 of column \"id\" is the number {number}, and spreadsheet programs keep only 15 digits of a \
                     number; give the column the format Text and write the cell again"
                )
            );
        }
        for (header, number) in [
            ("id", "123456789012345"),
            ("mesh", "117"),
            ("Mã số", "-999"),
        ] {
            let table = read(header, number).expect(number);
            let csv = String::from_utf8(table.csv).expect("UTF-8");
            assert_eq!(csv, format!("\"{header}\"\n\"{number}\"\n"));
        }
        let two =
            "<c t=\"inlineStr\"><is><t>id</t></is></c><c t=\"inlineStr\"><is><t>note</t></is></c>";
        let cells = "<c><v>1</v></c><c><v>12345678901234567</v></c>";
        let rows = format!("<row>{two}</row><row>{cells}</row>");
        assert!(read_sheet(&workbook(&[("a", &rows)], "", ""), None).is_ok());
    }
}
