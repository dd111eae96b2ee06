//! Lists of whole blocks: CSV with the columns block, mesh, page and optionally labels, unit and side. Other columns are
//! metadata.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::Value;

use super::block_columns::{COLUMNS, OPTIONAL, REQUIRED};
use super::column_names::missing_column;
use super::csv::{BoundedRows, column_names};
use super::draft::{MAX_PATH_BYTES, check_meta, parse_unit};
use super::error::{ManifestError, at_line, of_list};
use super::row::RowIds;
use super::similar_columns::SimilarColumns;
use super::text::{CsvText, LineCounter, encoding_hint, trimmed};
use crate::columns::KnownColumns;
use crate::quotes::check_quotes;
use mocban_core::domain::spelling::plain_form;
use mocban_core::domain::{BlockName, BlockSide, LengthUnit};

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
    /// Warnings about columns that are kept as metadata although their names are similar to those of others.
    pub warnings: Vec<String>,
}

/// Returns whether a list is one of blocks, by its header: it has the column `page`, or the column `block` with `labels`
/// or `side`, and not the columns of a list of pairs.
pub fn is_block_list(bytes: &[u8]) -> bool {
    let Ok(text) = CsvText::new(bytes) else {
        return false;
    };
    let mut record = ::csv::ByteRecord::new();
    if !matches!(reader(&text).read_byte_record(&mut record), Ok(true)) {
        return false;
    }
    let Ok(names) = column_names(1, &record, "") else {
        return false;
    };
    let of = |known: &KnownColumns| known.assign(&names).unwrap_or_default().columns;
    let (blocks, pairs) = (of(&COLUMNS), of(&super::row::COLUMNS));
    let has = |columns: &[Option<&str>], name: &str| columns.contains(&Some(name));
    let [id, print] = ["id", "print"].map(|name| has(&pairs, name));
    let [block, page, labels, side] =
        ["block", "page", "labels", "side"].map(|name| has(&blocks, name));
    page && !(id && print) || block && (labels || side) && !id && !print
}

fn reader<'t>(text: &'t CsvText<'_>) -> ::csv::Reader<BoundedRows<'t>> {
    ::csv::ReaderBuilder::new()
        .delimiter(text.delimiter)
        .trim(::csv::Trim::All)
        .flexible(true)
        .has_headers(false)
        .from_reader(BoundedRows::new(&text.bytes))
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
    let mut reader = reader(&text);
    let mut lines = LineCounter::new(bytes);
    let mut record = ::csv::ByteRecord::new();
    let mut problems = ManifestError::default();
    let mut hint = String::new();
    if std::str::from_utf8(bytes).is_err() {
        hint = encoding_hint(bytes);
        problems.add(of_list(&format!("the list is not UTF-8{hint}")));
    }
    let mut header: Option<Vec<ListedColumn>> = None;
    let (mut rows, mut ids) = (Vec::new(), RowIds::default());
    loop {
        reader.get_mut().begin_row();
        let start = reader.position().clone();
        let is_read = match reader.read_byte_record(&mut record) {
            Ok(is_read) => is_read,
            Err(error) => {
                let line = lines.at(Some(&start));
                problems.add(at_line(line, &error.to_string()));
                break;
            }
        };
        if !is_read {
            break;
        }
        let line = lines.at(Some(record.position().unwrap_or(&start)));
        let Some(columns) = &header else {
            header = Some(columns_of(line, &record, &hint)?);
            continue;
        };
        if record.iter().all(<[u8]>::is_empty) {
            continue;
        }
        let mut reasons = Vec::new();
        if let Some(row) = row(line, columns, &record, &mut reasons) {
            let name = row.name.as_pair();
            if let Some(first) = ids.insert(name, line) {
                reasons.push(first.reason("block", name.as_str()));
            }
            rows.push(row);
        }
        problems.extend(reasons.iter().map(|reason| at_line(line, reason)));
    }
    if problems == ManifestError::default() && rows.is_empty() {
        return Err(of_list("the list contains no blocks").into());
    }
    problems.check(false)?;
    let warnings = similar_columns(&rows);
    Ok(ReadBlocks { rows, warnings })
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

/// A column of a header: its standard name, if it is known, and its name as written.
type ListedColumn = (Option<&'static str>, String);

/// Returns the columns of a header.
fn columns_of(
    line: usize,
    record: &::csv::ByteRecord,
    encoding_hint: &str,
) -> Result<Vec<ListedColumn>, ManifestError> {
    let names = column_names(line, record, encoding_hint)?;
    let found = COLUMNS
        .assign(&names)
        .map_err(|same| at_line(line, &same.reason(&names)))?;
    if let Some(same) = found.same_others(&names) {
        return Err(at_line(line, &same.reason(&names)).into());
    }
    let columns = found.columns;
    let mut problems = ManifestError::default();
    let required = COLUMNS.names[..REQUIRED].iter();
    let missing = required.filter(|name| !columns.contains(&Some(**name)));
    problems.extend(missing.map(|name| at_line(line, &missing_column(name, &names, &columns))));
    problems.check(false)?;
    let names = names.into_iter().map(str::to_owned);
    Ok(columns.into_iter().zip(names).collect())
}

/// The cells of a row by the names of known columns, and its other columns, without empty cells.
type RowCells<'r> = (BTreeMap<&'static str, &'r str>, BTreeMap<String, Value>);

/// Returns the cells of a row, or records why they are not valid.
fn cells_of<'r>(
    columns: &[ListedColumn],
    record: &'r ::csv::ByteRecord,
    reasons: &mut Vec<String>,
) -> Option<RowCells<'r>> {
    if record.len() != columns.len() {
        let (cells, names) = (record.len(), columns.len());
        reasons.push(format!("the row has {cells} cells, the header has {names}"));
        return None;
    }
    let (mut cells, mut meta) = RowCells::default();
    for ((known, name), cell) in columns.iter().zip(record) {
        let Ok(cell) = std::str::from_utf8(cell) else {
            let name = known.unwrap_or(name);
            reasons.push(format!("the cell of column {name:?} is not UTF-8"));
            return None;
        };
        let cell = trimmed(cell);
        if let Some(column) = known
            && cell.len() > MAX_PATH_BYTES
        {
            let (len, limit) = (cell.len(), MAX_PATH_BYTES);
            reasons.push(format!(
                "{column} has {len} bytes, over the limit of {limit}"
            ));
            return None;
        }
        if cell.is_empty() {
            continue;
        }
        if let Some(column) = known {
            cells.insert(*column, cell);
        } else if !name.is_empty() {
            meta.insert(name.clone(), cell.into());
        }
    }
    check_meta(&meta, reasons);
    Some((cells, meta))
}

/// Returns a row, or records why it is not valid.
fn row(
    line: usize,
    columns: &[ListedColumn],
    record: &::csv::ByteRecord,
    reasons: &mut Vec<String>,
) -> Option<BlockRow> {
    let (cells, meta) = cells_of(columns, record, reasons)?;
    for column in &COLUMNS.names[1..REQUIRED] {
        if !cells.contains_key(column) {
            reasons.push(format!("{column} is empty"));
        }
    }
    let name = cells.get("block").copied().unwrap_or_default();
    let name = BlockName::new(name).map_err(|error| error.to_string());
    let unit = cells.get("unit").map(|cell| parse_unit(cell)).transpose();
    let side = cells.get("side").map(|cell| side(cell)).transpose();
    let mut record = |reason: Option<&String>| reasons.extend(reason.cloned());
    record(name.as_ref().err());
    record(unit.as_ref().err());
    record(side.as_ref().err());
    Some(BlockRow {
        line,
        name: name.ok()?,
        mesh: PathBuf::from(cells.get("mesh")?),
        page: PathBuf::from(cells.get("page")?),
        labels: cells.get("labels").map(PathBuf::from),
        unit: unit.ok()?,
        side: side.ok()?,
        meta,
    })
}

/// Parses a side, in English or Vietnamese.
fn side(cell: &str) -> Result<BlockSide, String> {
    match plain_form(cell).as_str() {
        "truoc" | "mat truoc" => Ok(BlockSide::Front),
        "sau" | "mat sau" => Ok(BlockSide::Back),
        // The error shows the text as written.
        plain => plain.parse().or_else(|_: String| cell.parse()),
    }
}

#[cfg(test)]
mod tests;
