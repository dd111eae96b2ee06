//! A row whose cells are not yet checked, and the check that all lists share.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::{Ids, ManifestError, ManifestRow, Problem, REQUIRED};
use crate::domain::{LengthUnit, PairName};

/// Cells of one row by lower-case column name, and the columns of no meaning to us.
#[derive(Debug, Default)]
pub(super) struct Draft {
    pub(super) line: usize,
    pub(super) cells: BTreeMap<&'static str, String>,
    pub(super) meta: BTreeMap<String, serde_json::Value>,
}

/// Passes rows on; collects problems, and the line of each id.
pub(super) struct Rows<'e> {
    pub(super) problems: Vec<Problem>,
    ids: Ids,
    each: &'e mut dyn FnMut(ManifestRow),
}

impl<'e> Rows<'e> {
    /// For a list whose sound rows are to go to `each`.
    pub(super) fn new(each: &'e mut dyn FnMut(ManifestRow)) -> Self {
        Self {
            problems: Vec::new(),
            ids: Ids::default(),
            each,
        }
    }

    /// The ids of the list, or all that is wrong with it.
    pub(super) fn end(self) -> Result<Ids, ManifestError> {
        ManifestError::unless_none(self.ids.is_empty(), self.problems)?;
        Ok(self.ids)
    }

    /// Checks a row; what is wrong with it is noted.
    pub(super) fn push(&mut self, draft: Draft) {
        let line = draft.line;
        let mut reasons = Vec::new();
        let name = self.name(&draft, &mut reasons);
        let row = complete(draft, name, &mut reasons);
        let problems = reasons.into_iter().map(|why| Problem::line(line, why));
        let before = self.problems.len();
        self.problems.extend(problems);
        if before == self.problems.len() {
            row.into_iter().for_each(&mut self.each);
        }
    }

    /// The row's id, when it is well formed and new.
    fn name(&mut self, draft: &Draft, reasons: &mut Vec<String>) -> Option<PairName> {
        let text = draft.cells.get("id").map_or("", String::as_str);
        let name = match PairName::new(text) {
            Ok(name) => name,
            Err(error) => {
                reasons.push(error.to_string());
                return None;
            }
        };
        if let Some(first) = self.ids.insert(&name, draft.line) {
            reasons.push(format!("id {text:?} was given in line {first} already"));
            return None;
        }
        Some(name)
    }
}

fn complete(
    mut draft: Draft,
    name: Option<PairName>,
    reasons: &mut Vec<String>,
) -> Option<ManifestRow> {
    draft.cells.retain(|_, cell| !cell.is_empty());
    for column in REQUIRED.into_iter().filter(|column| *column != "id") {
        if !draft.cells.contains_key(column) {
            reasons.push(format!("no {column} is given"));
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

/// An optional cell's value; a wrong one is noted.
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
