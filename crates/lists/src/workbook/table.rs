//! The cells of a sheet as CSV: one line for each row, so that a line is the row of the same number.

use std::collections::BTreeMap;

use super::archive::damaged;
use super::cell_names::{MAX_COLUMNS, MAX_ROWS, cell_name, column};
use super::cell_text::{CellPlace, OpenCell};
use super::error::WorkbookError;
use super::hidden_rows::HiddenRows;
use super::merged::{HiddenValues, MergedCells};
use super::parts::{TextCollector, Workbook, read_part, value};
use crate::manifest::{UnnamedValues, formula_error, is_text_column};
use crate::xml::{XmlPart, local_name};

/// Longest table, in bytes. Cells share texts, so a small workbook may hold a large one. Less in tests.
const MAX_TABLE_BYTES: usize = if cfg!(test) { 4 << 20 } else { 512 << 20 };

/// Writes a sheet as CSV.
struct TableWriter<'w> {
    workbook: &'w Workbook,
    csv: Vec<u8>,
    /// Number of rows that were written.
    rows: usize,
    /// Number of columns of the header; 0 before it.
    width: usize,
    /// Values beside the table, whose columns have no name.
    beside: UnnamedValues,
    /// Columns whose values are names, with the header's.
    text_columns: BTreeMap<usize, String>,
    /// Number of the open row, from 1, its cells, and the bytes of their texts.
    row: usize,
    cells: Vec<String>,
    row_bytes: usize,
    /// Column of the next cell if it does not say where it is.
    next_column: usize,
    cell: Option<OpenCell>,
    /// Cells that share the value of the first of them.
    merged: MergedCells,
    /// Values that other cells cover.
    hidden: HiddenValues,
    /// Whether the open row is hidden.
    is_row_hidden: bool,
    /// Rows that are hidden, and read.
    hidden_rows: HiddenRows,
    /// Whether a cell cannot be read.
    is_refused: bool,
    /// The first cells that cannot be read, and errors of formulas, which a parser would refuse.
    refused: Vec<WorkbookError>,
    /// Number of these cells.
    refused_count: usize,
}

/// Largest number of cells that are named because they cannot be read.
const MAX_REFUSED: usize = 10;

/// Returns the text of a sheet as CSV, and warnings about values that are left out, to the right of the header and below
/// merged cells, and about hidden rows. Line breaks in cells that are no ids and no paths become blanks. Cells that are
/// merged over rows of a column all have the value of the first.
///
/// The header is the first row with a value that is no title: see [`is_header`]. A parser refuses titles above it.
pub(super) fn csv(
    workbook: &Workbook,
    file: &str,
    text: &str,
) -> Result<(Vec<u8>, Vec<String>), WorkbookError> {
    let mut writer = TableWriter {
        workbook,
        csv: Vec::new(),
        rows: 0,
        width: 0,
        beside: UnnamedValues::default(),
        text_columns: BTreeMap::new(),
        row: 0,
        cells: Vec::new(),
        row_bytes: 0,
        next_column: 0,
        cell: None,
        merged: MergedCells::read(file, text)?,
        hidden: HiddenValues::default(),
        is_row_hidden: false,
        hidden_rows: HiddenRows::default(),
        is_refused: false,
        refused: Vec::new(),
        refused_count: 0,
    };
    let mut collector = TextCollector::default();
    // Few sheets have hidden rows.
    let may_hide = text.contains(" hidden=");
    read_part(file, text, |part| {
        if let (XmlPart::Text(text), Some(cell)) = (&part, &mut writer.cell)
            && collector.is_in("v")
        {
            cell.value.push_str(text);
        }
        if let (Some(text), Some(cell)) = (collector.add(&part), &mut writer.cell) {
            cell.value.push_str(text);
        }
        match part {
            XmlPart::Start(element) => match local_name(&element).as_str() {
                "row" => {
                    let hidden = may_hide.then(|| value(&element, "hidden")).transpose()?;
                    let is_hidden = hidden.is_some_and(|hidden| matches!(&*hidden, "1" | "true"));
                    writer.is_row_hidden = is_hidden;
                    writer.begin_row(&value(&element, "r")?)
                }
                "c" => {
                    let style = value(&element, "s")?.parse().unwrap_or_default();
                    writer.begin_cell(&value(&element, "r")?, value(&element, "t")?, style)
                }
                "f" => {
                    if let Some(cell) = &mut writer.cell {
                        cell.has_formula = true;
                    }
                    Ok(())
                }
                _ => Ok(()),
            },
            XmlPart::End if collector.is_in("row") => writer.end_cell(),
            XmlPart::End if collector.is_in("sheetData") => writer.end_row(),
            XmlPart::End | XmlPart::Text(_) => Ok(()),
        }
    })?;
    if !writer.is_refused {
        let left_out = [
            writer.beside.warning(),
            writer.hidden.warning(),
            writer.hidden_rows.warning(),
        ];
        return Ok((writer.csv, left_out.into_iter().flatten().collect()));
    }
    let (mut first, count) = (writer.refused, writer.refused_count);
    Err(match first.pop() {
        Some(alone) if count == 1 => alone,
        last => {
            first.extend(last);
            WorkbookError::Cells { first, count }
        }
    })
}

impl TableWriter<'_> {
    fn begin_row(&mut self, number: &str) -> Result<(), WorkbookError> {
        self.row = match number {
            "" => self.row + 1,
            number => number.parse().unwrap_or_default(),
        };
        if self.row <= self.rows || self.row > MAX_ROWS {
            return Err(damaged(&format!("a row has the number {number}")));
        }
        self.merged.begin_row(self.row);
        self.cells.clear();
        self.row_bytes = 0;
        self.next_column = 0;
        Ok(())
    }

    fn begin_cell(&mut self, place: &str, kind: String, style: usize) -> Result<(), WorkbookError> {
        if place.is_empty() && self.next_column >= MAX_COLUMNS {
            return Err(damaged(&format!("a row has more than {MAX_COLUMNS} cells")));
        }
        let column = match place {
            "" => Some(self.next_column),
            place => column(place),
        };
        let column = column.filter(|column| *column < MAX_COLUMNS);
        let column = column.ok_or_else(|| damaged(&format!("there is no cell {place}")))?;
        self.next_column = column + 1;
        self.cell = Some(OpenCell {
            column,
            kind,
            style,
            has_formula: false,
            value: String::new(),
        });
        Ok(())
    }

    fn end_cell(&mut self) -> Result<(), WorkbookError> {
        let Some(cell) = self.cell.take() else {
            return Ok(());
        };
        let column = cell.column;
        let is_covered = self.merged.shown_over(column, &self.cells).is_some();
        if self.width > 0 && column >= self.width && !is_covered {
            let has_value = !self.shared_or_own(&cell).trim().is_empty();
            self.beside.add(self.row, usize::from(has_value));
            return Ok(());
        }
        let is_error = cell.kind == "e";
        let read = self.place(column).text(cell);
        let text = match read {
            Err(error) if error.is_of_cell() => {
                if !is_covered {
                    self.refuse(error);
                }
                // The row is not empty.
                "?".to_owned()
            }
            read => read?,
        };
        if text.trim().is_empty() {
            return Ok(());
        }
        if let Some(shown) = self.merged.shown_over(column, &self.cells) {
            if shown != text {
                self.hidden.add(self.name(column));
            }
            return Ok(());
        }
        if is_error && self.text_columns.contains_key(&column) && formula_error(&text).is_some() {
            let (cell, value) = (self.name(column), text.clone());
            self.count_refused(WorkbookError::CellError { cell, value });
        }
        self.row_bytes += text.len();
        check_table(self.csv.len() + self.row_bytes)?;
        if self.cells.len() <= column {
            self.cells.resize(column + 1, String::new());
        }
        self.cells[column] = text;
        Ok(())
    }

    /// Refuses the sheet because of a cell that cannot be read.
    fn refuse(&mut self, error: WorkbookError) {
        self.is_refused = true;
        self.count_refused(error);
    }

    /// Counts a cell to be named if the sheet is refused, and keeps the first ones.
    fn count_refused(&mut self, error: WorkbookError) {
        self.refused_count += 1;
        if self.refused.len() < MAX_REFUSED {
            self.refused.push(error);
        }
    }

    /// Returns the stored value of a cell, for a shared string its text.
    fn shared_or_own<'c>(&'c self, cell: &'c OpenCell) -> &'c str {
        let index = cell.value.trim().parse::<usize>().ok();
        let index = index.filter(|_| cell.kind == "s");
        let shared = index.and_then(|index| self.workbook.strings.get(index));
        shared.unwrap_or(&cell.value)
    }

    /// Returns the name of a cell of the open row, such as `B5`.
    fn name(&self, column: usize) -> String {
        cell_name(column, self.row)
    }

    /// Returns where a cell of the open row stands.
    fn place(&self, column: usize) -> CellPlace<'_> {
        CellPlace {
            workbook: self.workbook,
            row: self.row,
            column,
            header: self.text_columns.get(&column).map(String::as_str),
            is_below_header: self.width > 0,
        }
    }

    /// Gives the cells of the open row, which is below the header, the values of those above with which they are merged.
    fn fill_merged(&mut self) -> Result<(), WorkbookError> {
        for (column, text) in self.merged.values(self.width) {
            if self.cells.len() <= column {
                self.cells.resize(column + 1, String::new());
            }
            if self.cells[column].is_empty() {
                self.row_bytes += text.len();
                check_table(self.csv.len() + self.row_bytes)?;
                text.clone_into(&mut self.cells[column]);
            }
        }
        Ok(())
    }

    /// Writes the open row. Rows before it that are missing become blank lines.
    fn end_row(&mut self) -> Result<(), WorkbookError> {
        if self.cells.is_empty() {
            return Ok(());
        }
        for refused in self.merged.end_row(&self.cells, self.width) {
            self.refuse(refused);
        }
        if self.width == 0 && is_header(&self.cells) {
            self.width = self.cells.len();
            let cells = self.cells.iter().enumerate();
            let names = cells.filter(|(_, name)| is_text_column(name));
            self.text_columns = names.map(|(k, name)| (k, name.clone())).collect();
        } else if self.width > 0 {
            self.fill_merged()?;
            if self.is_row_hidden {
                self.hidden_rows.add(self.row);
            }
        }
        for _ in self.rows + 1..self.row {
            self.csv.push(b'\n');
        }
        for column in 0..self.width.max(self.cells.len()) {
            if column > 0 {
                self.csv.push(b',');
            }
            let text = self.cells.get(column).map_or("", String::as_str);
            push_cell(&mut self.csv, text);
        }
        self.csv.push(b'\n');
        self.rows = self.row;
        check_table(self.csv.len())
    }
}

/// Number of columns that every list has.
const FEWEST_COLUMNS: usize = 3;

/// Returns whether a row can be the header of a list: it names enough columns, or one that is known.
fn is_header(cells: &[String]) -> bool {
    let named = cells.iter().filter(|name| !name.is_empty());
    named.count() >= FEWEST_COLUMNS || cells.iter().any(|name| is_text_column(name))
}

/// Refuses a table of too many bytes.
fn check_table(bytes: usize) -> Result<(), WorkbookError> {
    if bytes <= MAX_TABLE_BYTES {
        return Ok(());
    }
    Err(WorkbookError::TooLarge {
        part: "the table".to_owned(),
        limit: MAX_TABLE_BYTES as u64,
    })
}

/// Writes a cell in quotes. Line breaks become blanks.
fn push_cell(csv: &mut Vec<u8>, text: &str) {
    if text.is_empty() {
        return;
    }
    let one_line = text.replace(['\r', '\n'], " ").replace('"', "\"\"");
    for part in ["\"", &one_line, "\""] {
        csv.extend_from_slice(part.as_bytes());
    }
}
