//! Rows of CSV and JSON Lines lists before they are checked, and the checks that both formats share.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::cell_errors::{cell_error, id_error};
use super::cell_forms::CellForm;
use super::error::{ManifestError, Problem, at_line};
use super::folders::{is_named_like_input, is_named_like_mesh, is_named_like_print};
use super::missing_words::MissingWords;
use super::row::{ManifestRow, REQUIRED, ReadRows};
use mocban_core::domain::spelling::{plain_form, quoted};
use mocban_core::domain::{LengthUnit, PairName, PairNameError, sanitize, value_text};

/// The cells of one row by lower-case column name, and its other columns, without empty cells.
#[derive(Debug, Default)]
pub(super) struct DraftRow {
    pub(super) line: usize,
    pub(super) cells: BTreeMap<&'static str, String>,
    pub(super) meta: BTreeMap<String, serde_json::Value>,
    /// Number of values in columns without a name.
    pub(super) unnamed: usize,
    /// Cells of CSV in unusual forms, each with its column.
    pub(super) unusual: Vec<(CellForm, String)>,
}

impl DraftRow {
    /// Starts a row without cells.
    pub(super) fn new(line: usize) -> Self {
        Self {
            line,
            ..Self::default()
        }
    }
}

/// Columns that may have words for missing values.
const MISSING_WORDS: MissingWords = MissingWords {
    names: &["id", "character"],
    groups: &["block"],
    settings: &["unit", "scanned_face_down"],
};

/// What is wrong with a path as an id.
const ID_IS_FILE: &str =
    "id names a file; give each pair an id, or swap the columns if they are mixed up";

/// Passes valid rows on; collects problems and ids.
pub(super) struct RowCollector<'e> {
    problems: ManifestError,
    read: ReadRows,
    each: &'e mut dyn FnMut(ManifestRow),
}

impl<'e> RowCollector<'e> {
    /// Passes valid rows to `each`.
    pub(super) fn new(each: &'e mut dyn FnMut(ManifestRow)) -> Self {
        Self {
            problems: ManifestError::default(),
            read: ReadRows::default(),
            each,
        }
    }

    /// Returns what was read, or all problems of the list.
    pub(super) fn finish(self) -> Result<ReadRows, ManifestError> {
        self.problems.check(self.read.ids.is_empty())?;
        Ok(self.read)
    }

    /// Adds columns that were read under other names.
    pub(super) fn add_renamed(
        &mut self,
        renamed: impl IntoIterator<Item = (String, &'static str)>,
    ) {
        self.read.renamed.extend(renamed);
    }

    /// Adds columns that are not read, although they have other names of columns that are.
    pub(super) fn add_unread(&mut self, unread: impl IntoIterator<Item = (String, &'static str)>) {
        self.read.unread_columns.add(unread);
    }

    /// Adds a problem of the list or of a line.
    pub(super) fn add_problem(&mut self, problem: Problem) {
        self.problems.add(problem);
    }

    /// Checks a row and passes it on if it is valid. Records the problems of an invalid row. Ignores a blank row.
    pub(super) fn push(&mut self, line: usize, draft: Result<Option<DraftRow>, String>) {
        let mut reasons = Vec::new();
        let row = match draft {
            Ok(Some(mut draft)) => {
                draft.unusual.extend(MISSING_WORDS.find(&mut draft.cells));
                self.read.unnamed.add(line, draft.unnamed);
                self.read.unusual_cells.add(line, &draft.unusual);
                self.read.formula_errors.leave_out(line, &mut draft.meta);
                let name = self.name(&draft, &mut reasons);
                complete(draft, name, &mut reasons)
            }
            Ok(None) => None,
            Err(reason) => {
                reasons.push(reason);
                None
            }
        };
        if reasons.is_empty() {
            row.into_iter().for_each(&mut self.each);
        }
        let problems = reasons.iter().map(|reason| at_line(line, reason));
        self.problems.extend(problems);
    }

    /// Returns the row's id if it is valid and new.
    fn name(&mut self, draft: &DraftRow, reasons: &mut Vec<String>) -> Option<PairName> {
        let text = draft.cells.get("id").map_or("", String::as_str);
        if let Some(reason) = id_error(text) {
            reasons.push(reason);
            return None;
        }
        // Without the id, the reason is the same in all rows and is shown once.
        let reason = |error: PairNameError| {
            if is_named_like_input(Path::new(text)) {
                ID_IS_FILE.to_owned()
            } else {
                error.to_string()
            }
        };
        let name = record(PairName::new(text).map_err(reason), reasons)?;
        if let Some(first) = self.read.ids.insert(&name, draft.line) {
            reasons.push(first.reason("id", text));
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
    for column in REQUIRED.into_iter().filter(|column| *column != "id") {
        if !draft.cells.contains_key(column) {
            reasons.push(format!("{column} is empty"));
        }
    }
    check_lengths(&draft, reasons);
    refuse_cell_errors(&mut draft.cells, "id", reasons);
    if let Some(block) = draft.cells.get("block")
        && block.contains(['\n', '\r'])
    {
        let block = quoted(&sanitize(block, MAX_BLOCK_CHARS));
        reasons.push(format!(
            "block {block} has a line break; write it on one line"
        ));
    }
    if is_swapped(&draft.cells) {
        reasons.push("mesh names an image and print names a mesh; swap the two".to_owned());
    }
    let unit = draft
        .cells
        .remove("unit")
        .map(|cell| LengthUnit::named(&cell));
    let face_down = draft
        .cells
        .remove("scanned_face_down")
        .map(|cell| parse_flag(&cell));
    let unit = unit.and_then(|unit| record(unit, reasons));
    let face_down = face_down.and_then(|face_down| record(face_down, reasons));
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

/// Records cells that are errors of formulas, except for the id, which has its own sentence, and removes them.
pub(super) fn refuse_cell_errors(
    cells: &mut BTreeMap<&'static str, String>,
    id: &str,
    reasons: &mut Vec<String>,
) {
    cells.retain(|column, cell| {
        let reason = cell_error(column, cell).filter(|_| *column != id);
        let is_kept = reason.is_none();
        reasons.extend(reason);
        is_kept
    });
}

/// Returns whether the mesh has the extension of an image, and the print that of a mesh.
fn is_swapped(cells: &BTreeMap<&'static str, String>) -> bool {
    let path = |column: &str| cells.get(column).map(Path::new);
    path("mesh").is_some_and(is_named_like_print) && path("print").is_some_and(is_named_like_mesh)
}

/// Records cells that are too long. Lengths are limited because the catalog stores every cell and reports show them.
fn check_lengths(draft: &DraftRow, reasons: &mut Vec<String>) {
    for (name, cell) in &draft.cells {
        let max = match *name {
            "mesh" | "print" => MAX_PATH_BYTES,
            _ => MAX_CELL_BYTES,
        };
        check_length(name, cell.len(), max, reasons);
    }
    check_meta(&draft.meta, reasons);
}

/// Records metadata that is too long with the name of its column.
pub(super) fn check_meta(meta: &BTreeMap<String, serde_json::Value>, reasons: &mut Vec<String>) {
    for (name, value) in meta {
        let len = name.len() + value_text(value).len();
        check_length(name, len, MAX_CELL_BYTES, reasons);
    }
}

/// Records a cell that is longer than `max` bytes.
pub(super) fn check_length(name: &str, len: usize, max: usize, reasons: &mut Vec<String>) {
    if len > max {
        reasons.push(format!(
            "{name:.40} has {len} bytes, over the limit of {max}"
        ));
    }
}

/// Longest row in bytes. It bounds the memory that a row needs, for example if a closing quotation mark is missing and
/// all lines that follow become one cell.
pub(super) const MAX_ROW_BYTES: usize = 1 << 20;
/// Longest path in bytes; the system accepts no longer one.
pub(super) const MAX_PATH_BYTES: usize = 4096;
/// Longest name of a block in a message, in characters.
const MAX_BLOCK_CHARS: usize = 48;
/// Longest other cell in bytes.
const MAX_CELL_BYTES: usize = 1 << 16;

/// Returns a value, or records why it is not valid.
pub(super) fn record<T>(value: Result<T, String>, reasons: &mut Vec<String>) -> Option<T> {
    value.map_err(|reason| reasons.push(reason)).ok()
}

fn parse_flag(cell: &str) -> Result<bool, String> {
    match plain_form(cell).as_str() {
        "true" | "yes" | "1" | "co" | "dung" => Ok(true),
        "false" | "no" | "0" | "khong" | "sai" => Ok(false),
        _ => Err(format!(
            "scanned_face_down is {}, not true, false, yes, no, 1 or 0",
            quoted(cell)
        )),
    }
}
