//! Rows whose cells are not yet checked, and the checks that all formats share.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::error::{ManifestError, Problem};
use super::row::{ManifestRow, REQUIRED, RowIds};
use crate::domain::{LengthUnit, PairName};

/// The cells of one row by lower-case column name, and its other columns.
#[derive(Debug, Default)]
pub(super) struct DraftRow {
    pub(super) line: usize,
    pub(super) cells: BTreeMap<&'static str, String>,
    pub(super) meta: BTreeMap<String, serde_json::Value>,
}

/// Passes valid rows on; collects problems and ids.
pub(super) struct RowCollector<'e> {
    pub(super) problems: Vec<Problem>,
    ids: RowIds,
    each: &'e mut dyn FnMut(ManifestRow),
}

impl<'e> RowCollector<'e> {
    /// Passes valid rows to `each`.
    pub(super) fn new(each: &'e mut dyn FnMut(ManifestRow)) -> Self {
        Self {
            problems: Vec::new(),
            ids: RowIds::default(),
            each,
        }
    }

    /// Returns the ids of the list, or all its problems.
    pub(super) fn finish(self) -> Result<RowIds, ManifestError> {
        ManifestError::check(self.ids.is_empty(), self.problems)?;
        Ok(self.ids)
    }

    /// Checks a row and records its problems.
    pub(super) fn push(&mut self, draft: DraftRow) {
        let line = draft.line;
        let mut reasons = Vec::new();
        let name = self.name(&draft, &mut reasons);
        let row = complete(draft, name, &mut reasons);
        let problems = reasons.into_iter().map(|why| Problem::at_line(line, why));
        let before = self.problems.len();
        self.problems.extend(problems);
        if before == self.problems.len() {
            row.into_iter().for_each(&mut self.each);
        }
    }

    /// Returns the row's id if it is valid and new.
    fn name(&mut self, draft: &DraftRow, reasons: &mut Vec<String>) -> Option<PairName> {
        let text = draft.cells.get("id").map_or("", String::as_str);
        let name = match PairName::new(text) {
            Ok(name) => name,
            Err(error) => {
                reasons.push(error.to_string());
                return None;
            }
        };
        if let Some(first) = self.ids.insert(&name, draft.line) {
            reasons.push(format!("id {text:?} is already on line {first}"));
            return None;
        }
        Some(name)
    }
}

fn complete(
    mut draft: DraftRow,
    name: Option<PairName>,
    reasons: &mut Vec<String>,
) -> Option<ManifestRow> {
    draft.cells.retain(|_, cell| !cell.is_empty());
    for column in REQUIRED.into_iter().filter(|column| *column != "id") {
        if !draft.cells.contains_key(column) {
            reasons.push(format!("{column} is empty"));
        }
    }
    let unit = checked(draft.cells.remove("unit"), parse_unit, reasons);
    let face_down = checked(draft.cells.remove("scanned_face_down"), parse_flag, reasons);
    Some(ManifestRow {
        line: draft.line,
        name: name?,
        mesh: PathBuf::from(draft.cells.remove("mesh")?),
        print: PathBuf::from(draft.cells.remove("print")?),
        character: draft.cells.remove("character"),
        block: draft.cells.remove("block"),
        unit,
        scanned_face_down: face_down,
        meta: draft.meta,
    })
}

/// Parses an optional cell; records an invalid value.
fn checked<T>(
    cell: Option<String>,
    parse: impl Fn(&str) -> Result<T, String>,
    reasons: &mut Vec<String>,
) -> Option<T> {
    match parse(&cell?) {
        Ok(value) => Some(value),
        Err(reason) => {
            reasons.push(reason);
            None
        }
    }
}

fn parse_unit(cell: &str) -> Result<LengthUnit, String> {
    cell.to_ascii_lowercase().parse()
}

fn parse_flag(cell: &str) -> Result<bool, String> {
    match cell.to_ascii_lowercase().as_str() {
        "true" | "yes" | "1" => Ok(true),
        "false" | "no" | "0" => Ok(false),
        _ => Err(format!(
            "scanned_face_down is {cell:?}, not true, false, yes, no, 1 or 0"
        )),
    }
}
