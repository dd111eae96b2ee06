//! Merged cells of a sheet. The value of the first of them is that of all; values below it are hidden.

use std::collections::{BTreeMap, BTreeSet};

use super::archive::damaged;
use super::cell_names::{MAX_COLUMNS, MAX_ROWS, place};
use super::error::WorkbookError;
use super::parts::{read_part, value};
use crate::xml::{XmlPart, local_name};

/// The element that names merged cells.
const ELEMENT: &str = "mergeCell";
/// Maximum number of merged areas. Fewer in tests.
const MAX_AREAS: usize = if cfg!(test) { 1000 } else { 1 << 20 };

/// An area of merged cells. Its first cell is its key.
#[derive(Debug, Clone, PartialEq, Eq)]
struct MergedArea {
    /// The cells as the sheet names them, such as `D2:D4`.
    name: String,
    last_row: usize,
    last_column: usize,
}

/// An area with cells in the open row.
#[derive(Debug, Clone, PartialEq, Eq)]
struct OpenArea {
    first_row: usize,
    last_row: usize,
    last_column: usize,
    /// The value of its first cell, once that row was passed.
    text: String,
    /// Whether the next rows of its column have this value.
    is_shared: bool,
}

/// The merged cells of a sheet, whose rows are passed in ascending order.
#[derive(Debug, Default)]
pub(super) struct MergedCells {
    /// By row and column of the first cell.
    areas: BTreeMap<(usize, usize), MergedArea>,
    /// By the first column.
    open: BTreeMap<usize, OpenArea>,
    /// The last row and the first column of each open area.
    ends: BTreeSet<(usize, usize)>,
    /// The open row, from 1.
    row: usize,
}

impl MergedCells {
    /// Reads the merged cells of a sheet, which stand behind its rows.
    ///
    /// # Errors
    /// Returns an error if the sheet is damaged or has more than [`MAX_AREAS`] areas of merged cells.
    pub(super) fn read(file: &str, sheet: &str) -> Result<Self, WorkbookError> {
        let mut merged = Self::default();
        // Almost no sheet has any.
        if !sheet.contains(ELEMENT) {
            return Ok(merged);
        }
        read_part(file, sheet, |part| match part {
            XmlPart::Start(element) if local_name(&element) == ELEMENT => {
                merged.add(value(&element, "ref")?)
            }
            _ => Ok(()),
        })?;
        Ok(merged)
    }

    fn add(&mut self, name: String) -> Result<(), WorkbookError> {
        let Some((first, last)) = name.split_once(':') else {
            return Ok(());
        };
        let is_within = |(row, column): &(usize, usize)| *row <= MAX_ROWS && *column < MAX_COLUMNS;
        let [first, last] = [first, last].map(|name| place(name).filter(is_within));
        let (Some(first), Some((last_row, last_column))) = (first, last) else {
            return Err(damaged(&format!("there are no cells {name}")));
        };
        if self.areas.len() == MAX_AREAS {
            let reason = format!("it has more than {MAX_AREAS} areas of merged cells");
            return Err(damaged(&reason));
        }
        let area = MergedArea {
            name,
            last_row,
            last_column,
        };
        self.areas.insert(first, area);
        Ok(())
    }

    /// Begins a row, from 1.
    pub(super) fn begin_row(&mut self, row: usize) {
        while let Some((last_row, column)) = self.ends.first().copied()
            && last_row < row
        {
            self.ends.pop_first();
            self.open.remove(&column);
        }
        if row <= self.row {
            return;
        }
        let begun = self.areas.range((self.row + 1, 0)..(row + 1, 0));
        for ((first_row, column), area) in begun.filter(|(_, area)| area.last_row >= row) {
            let area = OpenArea {
                first_row: *first_row,
                last_row: area.last_row,
                last_column: area.last_column,
                text: String::new(),
                is_shared: false,
            };
            let end = (area.last_row, *column);
            if let Some(covered) = self.open.insert(*column, area) {
                self.ends.remove(&(covered.last_row, *column));
            }
            self.ends.insert(end);
        }
        self.row = row;
    }

    /// Returns what a spreadsheet program shows in place of a cell of the open row, if it is merged and not the first of its
    /// area. `cells` are those before it in the row.
    pub(super) fn shown_over<'c>(&'c self, column: usize, cells: &'c [String]) -> Option<&'c str> {
        let (first, area) = self.open.range(..=column).next_back()?;
        let is_first = area.first_row == self.row && *first == column;
        if is_first || column > area.last_column {
            return None;
        }
        if area.first_row == self.row {
            return Some(cells.get(*first).map_or("", String::as_str));
        }
        Some(&area.text)
    }

    /// Ends the open row with these cells: keeps the values of areas that begin there. Below the header, which has `width`
    /// columns, the next rows share them; `width` is 0 before it. Returns errors for values that columns share.
    pub(super) fn end_row(&mut self, cells: &[String], width: usize) -> Vec<WorkbookError> {
        let mut refused = Vec::new();
        for ((_, column), area) in self.areas.range((self.row, 0)..(self.row + 1, 0)) {
            let text = cells.get(*column).filter(|text| !text.is_empty());
            let open = self.open.get_mut(column);
            let open = open.filter(|open| open.first_row == self.row);
            let (Some(text), Some(open)) = (text, open) else {
                continue;
            };
            open.text.clone_from(text);
            if *column >= width {
                continue;
            }
            open.is_shared = area.last_column.min(width - 1) == *column;
            if !open.is_shared {
                let cells = area.name.clone();
                refused.push(WorkbookError::MergedColumns { cells });
            }
        }
        refused
    }

    /// Returns the columns before `width` whose cells in the row share a value, each with the value.
    pub(super) fn values(&self, width: usize) -> impl Iterator<Item = (usize, &str)> {
        let shared = self.open.range(..width);
        let shared = shared.filter(|(_, area)| area.is_shared);
        shared.map(|(column, area)| (*column, area.text.as_str()))
    }
}

/// Values below merged cells, which a spreadsheet program does not show. They are left out.
#[derive(Debug, Default)]
pub(super) struct HiddenValues {
    count: usize,
    /// Name of the first cell.
    first: String,
}

impl HiddenValues {
    /// Adds the value of a cell.
    pub(super) fn add(&mut self, cell: String) {
        if self.count == 0 {
            self.first = cell;
        }
        self.count += 1;
    }

    /// Returns a warning, if there are any.
    pub(super) fn warning(&self) -> Option<String> {
        let Self { count, first } = self;
        match count {
            0 => None,
            1 => Some(format!(
                "the value of cell {first} is hidden below merged cells and is left out; unmerge the cells to see it"
            )),
            _ => Some(format!(
                "{count} values are hidden below merged cells and are left out, the first in cell {first}; unmerge the cells to see them"
            )),
        }
    }
}
