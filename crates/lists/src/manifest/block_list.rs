//! Lists of whole blocks in CSV or JSON, with the columns block, mesh, page and optionally labels, unit and side. Other
//! columns are metadata.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::Value;

use super::block_columns::{COLUMNS, OPTIONAL, REQUIRED};
use super::cell_errors::id_error;
use super::changed_ids::ChangedIds;
use super::column_names::missing_column;
use super::csv::{ListedColumn, column_names, draft_of};
use super::decimal_ids::DecimalIds;
use super::draft::{
    DraftRow, MAX_PATH_BYTES, check_length, check_meta, record, refuse_cell_errors,
};
use super::encoding_hint::encoding_hint;
use super::error::{ManifestError, at_line, of_list};
use super::json_rows::json_rows;
use super::missing_words::MissingWords;
use super::row::ReadRows;
use super::row_reader::{is_blank, row_reader};
use super::similar_columns::SimilarColumns;
use super::text::{CsvText, LineCounter};
use super::whole_numbers::WholeNumbers;
use crate::columns::HeaderColumns;
use crate::quotes::check_quotes;
use mocban_core::domain::spelling::plain_form;
use mocban_core::domain::{BlockName, BlockSide, LengthUnit, any_case};

/// A block of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockRow {
    /// Line of the list, from 1.
    pub line: usize,
    /// The id.
    pub name: BlockName,
    /// Path of the mesh, relative to the list.
    pub mesh: PathBuf,
    /// Path of the image of the page, relative to the list.
    pub page: PathBuf,
    /// Path of the labels, relative to the list.
    pub labels: Option<PathBuf>,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// The side of the scan that the page shows.
    pub side: Option<BlockSide>,
    /// All other columns, without empty cells.
    pub meta: BTreeMap<String, Value>,
}

/// What a list of blocks has.
#[derive(Debug, Default)]
pub struct ReadBlocks {
    /// The blocks.
    pub rows: Vec<BlockRow>,
    /// Columns that were read under other names, as written, each with its name.
    pub renamed: BTreeMap<String, &'static str>,
    /// Warnings about ids that seem to be changed, values that are left out, and columns that are kept as metadata although
    /// their names are similar to those of others.
    pub warnings: Vec<String>,
}

/// Parses a list of blocks. Columns may be in any order, and their names in any case. Blank lines are ignored.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no blocks, or has an invalid header or row. The error names
/// the lines of invalid rows.
pub fn parse_blocks(bytes: &[u8]) -> Result<Vec<BlockRow>, ManifestError> {
    read_blocks(bytes).map(|read| read.rows)
}

/// Parses a list of blocks like [`parse_blocks`], and returns warnings about columns, too.
///
/// # Errors
/// Returns an error like [`parse_blocks`].
pub fn read_blocks(bytes: &[u8]) -> Result<ReadBlocks, ManifestError> {
    let text = CsvText::new(bytes).map_err(|error| of_list(&error.to_string()))?;
    let bytes = &*text.bytes;
    check_quotes(bytes, text.delimiter).map_err(|error| at_line(error.line, &error.to_string()))?;
    let mut reader = row_reader(&text.bytes, text.delimiter);
    let mut lines = LineCounter::new(bytes);
    let mut record = ::csv::ByteRecord::new();
    let mut rows = BlockRows::default();
    let mut hint = String::new();
    if std::str::from_utf8(bytes).is_err() {
        hint = encoding_hint(bytes);
        let reason = format!("the list is not UTF-8{hint}");
        rows.problems.add(of_list(&reason));
    }
    let mut header: Option<(Vec<ListedColumn>, WholeNumbers)> = None;
    loop {
        reader.get_mut().begin_row();
        let start = reader.position().clone();
        let is_read = match reader.read_byte_record(&mut record) {
            Ok(is_read) => is_read,
            Err(error) => {
                let line = lines.at(Some(&start));
                rows.problems.add(at_line(line, &error.to_string()));
                break;
            }
        };
        if !is_read {
            break;
        }
        let line = lines.at(Some(record.position().unwrap_or(&start)));
        let Some((columns, whole_numbers)) = &header else {
            let names = column_names(line, &record, &hint)?;
            let HeaderColumns {
                columns,
                renamed,
                unread,
            } = columns_of(line, &names)?;
            rows.read.renamed.extend(renamed);
            rows.read.unread_columns.add(unread);
            let names = names.into_iter().map(str::to_owned);
            let whole = WholeNumbers::find(bytes, text.delimiter, columns.iter().copied());
            header = Some((columns.into_iter().zip(names).collect(), whole));
            continue;
        };
        if is_blank(&record) {
            continue;
        }
        let place = (line, text.delimiter);
        let columns = (columns.as_slice(), whole_numbers);
        let draft = draft_of(place, columns, &record, &hint);
        rows.push(line, draft);
    }
    rows.finish()
}

/// Parses a list of blocks in JSON like [`read_blocks`]: an object on each line, or an array of objects.
///
/// # Errors
/// Returns an error like [`parse_blocks`].
pub fn read_block_json(bytes: &[u8]) -> Result<ReadBlocks, ManifestError> {
    let mut rows = BlockRows::default();
    let read = json_rows(bytes, COLUMNS, &mut |row| {
        let draft = match row.draft {
            Ok(draft) if is_exported(&draft) => Err(EXPORTED.to_owned()),
            draft => draft,
        };
        rows.read.renamed.extend(row.renamed);
        rows.read.unread_columns.add(row.unread);
        rows.push(row.line, draft);
    });
    if let Err(refused) = read {
        rows.problems.add(refused);
    }
    rows.finish()
}

/// Columns that may have words for missing values.
const MISSING_WORDS: MissingWords = MissingWords {
    names: &["block"],
    groups: &[],
    settings: &["unit", "side"],
};

/// Refuses a line of `blocks.jsonl`: the side and unit that a run found would be stored as given.
const EXPORTED: &str = "this is a line of an export with results; import your own list of blocks";

/// Returns whether a row is a line of an export. These fields have a value in all of its lines.
fn is_exported(draft: &DraftRow) -> bool {
    let meta = draft.meta.get("meta");
    let mut results = ["status", "characters"].iter();
    meta.is_some_and(Value::is_object) && results.all(|name| draft.meta.contains_key(*name))
}

/// The rows of a list, and what is wrong with others.
#[derive(Default)]
struct BlockRows {
    rows: Vec<BlockRow>,
    read: ReadRows,
    problems: ManifestError,
}

impl BlockRows {
    /// Checks a row and keeps it if it is valid. Records its problems otherwise.
    fn push(&mut self, line: usize, mut draft: Result<DraftRow, String>) {
        let mut reasons = Vec::new();
        if let Ok(draft) = &mut draft {
            draft.unusual.extend(MISSING_WORDS.find(&mut draft.cells));
            self.read.unnamed.add(line, draft.unnamed);
            self.read.unusual_cells.add(line, &draft.unusual);
            self.read.formula_errors.leave_out(line, &mut draft.meta);
        }
        match draft.map(|draft| row(draft, &mut reasons)) {
            Ok(Some(row)) => {
                let name = row.name.as_pair();
                if let Some(first) = self.read.ids.insert(name, line) {
                    reasons.push(first.reason("block", name.as_str()));
                }
                self.rows.push(row);
            }
            Ok(None) => {}
            Err(reason) => reasons.push(reason),
        }
        let problems = reasons.iter().map(|reason| at_line(line, reason));
        self.problems.extend(problems);
    }

    /// Returns the rows, or all problems of the list.
    fn finish(self) -> Result<ReadBlocks, ManifestError> {
        let Self {
            rows,
            read,
            problems,
        } = self;
        if problems == ManifestError::default() && rows.is_empty() {
            return Err(of_list("the list contains no blocks").into());
        }
        problems.check(false)?;
        let (mut ids, mut decimal_ids) = (ChangedIds::default(), DecimalIds::default());
        for row in &rows {
            ids.add(row.line, row.name.as_str(), [&row.mesh, &row.page]);
            decimal_ids.add(row.line, row.name.as_str());
        }
        let of_cells = [
            read.unnamed.warning(),
            read.formula_errors.warning(),
            ids.warning(),
            decimal_ids.warning(&read.ids),
        ];
        let of_cells = of_cells.into_iter().flatten();
        let of_cells = of_cells.chain(read.unusual_cells.warnings());
        let of_cells = of_cells.chain(read.unread_columns.warnings());
        let warnings = of_cells.chain(similar_columns(&rows)).collect();
        Ok(ReadBlocks {
            rows,
            renamed: read.renamed,
            warnings,
        })
    }
}

/// Returns warnings about metadata with names that are similar to those of optional columns without values.
fn similar_columns(rows: &[BlockRow]) -> Vec<String> {
    let [labels, unit, side] = OPTIONAL;
    let mut similar = SimilarColumns::default();
    for row in rows {
        let optional = [
            (labels, row.labels.is_some()),
            (unit, row.unit.is_some()),
            (side, row.side.is_some()),
        ];
        similar.add(&optional, row.meta.keys());
    }
    similar.warnings().collect()
}

/// Returns what the columns of a header with these names are.
fn columns_of(line: usize, names: &[&str]) -> Result<HeaderColumns, ManifestError> {
    let found = COLUMNS
        .assign(names)
        .map_err(|same| at_line(line, &same.reason(names)))?;
    if let Some(same) = found.same_others(names) {
        return Err(at_line(line, &same.reason(names)).into());
    }
    let columns = &found.columns;
    let mut problems = ManifestError::default();
    let required = COLUMNS.names[..REQUIRED].iter();
    let missing = required.filter(|name| !columns.contains(&Some(**name)));
    problems
        .extend(missing.map(|name| at_line(line, &missing_column(name, &COLUMNS, names, columns))));
    problems.check(false)?;
    Ok(found)
}

/// Returns a row, or records why it is not valid.
fn row(mut draft: DraftRow, reasons: &mut Vec<String>) -> Option<BlockRow> {
    for (column, cell) in &draft.cells {
        check_length(column, cell.len(), MAX_PATH_BYTES, reasons);
    }
    if !reasons.is_empty() {
        return None;
    }
    check_meta(&draft.meta, reasons);
    for column in &COLUMNS.names[1..REQUIRED] {
        if !draft.cells.contains_key(column) {
            reasons.push(format!("{column} is empty"));
        }
    }
    refuse_cell_errors(&mut draft.cells, "block", reasons);
    let cells = &draft.cells;
    let name = cells.get("block").map_or("", String::as_str);
    let name = match id_error(name) {
        Some(reason) => Err(reason),
        None => BlockName::new(name).map_err(|error| error.to_string()),
    };
    let unit = cells
        .get("unit")
        .map(|cell| LengthUnit::named(cell))
        .transpose();
    let side = cells.get("side").map(|cell| side(cell)).transpose();
    let name = record(name, reasons);
    let unit = record(unit, reasons);
    let side = record(side, reasons);
    Some(BlockRow {
        line: draft.line,
        name: name?,
        mesh: PathBuf::from(cells.get("mesh")?),
        page: PathBuf::from(cells.get("page")?),
        labels: cells.get("labels").map(PathBuf::from),
        unit: unit?,
        side: side?,
        meta: draft.meta,
    })
}

/// Parses a side, in English or Vietnamese.
fn side(cell: &str) -> Result<BlockSide, String> {
    match plain_form(cell).as_str() {
        "truoc" | "mat truoc" => Ok(BlockSide::Front),
        "sau" | "mat sau" => Ok(BlockSide::Back),
        _ => any_case(cell),
    }
}

#[cfg(test)]
mod tests;
