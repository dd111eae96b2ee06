//! Merged cells of a sheet. Only the first of them has a value, which is that of all.

use std::collections::BTreeMap;

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

/// A value that the next rows of a column share.
#[derive(Debug, Clone, PartialEq, Eq)]
struct SharedValue {
    last_row: usize,
    text: String,
}

/// The merged cells of a sheet, whose rows are passed in ascending order.
#[derive(Debug, Default)]
pub(super) struct MergedCells {
    /// By row and column of the first cell.
    areas: BTreeMap<(usize, usize), MergedArea>,
    /// By column.
    values: BTreeMap<usize, SharedValue>,
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

    /// Begins a row of the table with these cells and width: keeps the values that it shares with the next rows. Returns
    /// errors for values that columns share.
    pub(super) fn begin_row(
        &mut self,
        row: usize,
        cells: &[String],
        width: usize,
    ) -> Vec<WorkbookError> {
        self.values.retain(|_, value| value.last_row >= row);
        let mut refused = Vec::new();
        for ((_, column), area) in self.areas.range((row, 0)..(row, width)) {
            let text = cells.get(*column).filter(|text| !text.is_empty());
            let Some(text) = text.cloned() else { continue };
            if area.last_column.min(width - 1) > *column {
                let cells = area.name.clone();
                refused.push(WorkbookError::MergedColumns { cells });
                continue;
            }
            let last_row = area.last_row;
            self.values.insert(*column, SharedValue { last_row, text });
        }
        refused
    }

    /// Returns the columns whose cells in the row share a value, each with the value.
    pub(super) fn values(&self) -> impl Iterator<Item = (usize, &str)> {
        let values = self.values.iter();
        values.map(|(column, value)| (*column, value.text.as_str()))
    }
}
