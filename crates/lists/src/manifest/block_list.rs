//! Lists of whole blocks: CSV with the columns block, mesh, page and optionally labels, unit and side.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::block_columns::{COLUMNS, REQUIRED};
use super::column_names::{missing_column, similar_column};
use super::csv::column_names;
use super::draft::{MAX_PATH_BYTES, parse_unit};
use super::error::{ManifestError, at_line, of_list};
use super::row::RowIds;
use super::text::{CsvText, LineCounter, encoding_hint, trimmed};
use crate::columns::KnownColumns;
use crate::quotes::check_quotes;
use mocban_core::domain::spelling::plain_form;
use mocban_core::domain::{BlockName, BlockSide, LengthUnit, first_names, sanitize};

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
}

/// What a list of blocks has.
#[derive(Debug, Default)]
pub struct ReadBlocks {
    /// The blocks.
    pub rows: Vec<BlockRow>,
    /// A warning about columns that are not read.
    pub unread: Option<String>,
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

fn reader<'t>(text: &'t CsvText<'_>) -> ::csv::Reader<&'t [u8]> {
    ::csv::ReaderBuilder::new()
        .delimiter(text.delimiter)
        .trim(::csv::Trim::All)
        .flexible(true)
        .has_headers(false)
        .from_reader(&text.bytes)
}

/// Parses a list of blocks. Columns may be in any order, and their names in any case. Blank lines are ignored.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no blocks, or has an invalid header or row. The error names
/// the lines of invalid rows.
pub fn parse_blocks(bytes: &[u8]) -> Result<Vec<BlockRow>, ManifestError> {
    read_blocks(bytes).map(|read| read.rows)
}

/// Parses a list of blocks like [`parse_blocks`], and returns a warning about other columns, too.
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
    let mut header: Option<Vec<Option<&'static str>>> = None;
    let (mut read, mut ids) = (ReadBlocks::default(), RowIds::default());
    loop {
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
            let (columns, unread) = columns_of(line, &record, &hint)?;
            (header, read.unread) = (Some(columns), unread);
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
            read.rows.push(row);
        }
        problems.extend(reasons.iter().map(|reason| at_line(line, reason)));
    }
    if problems == ManifestError::default() && read.rows.is_empty() {
        return Err(of_list("the list contains no blocks").into());
    }
    problems.check(false)?;
    Ok(read)
}

/// The columns of a header, each with its name if it is known, and a warning about the others.
type HeaderOfBlocks = (Vec<Option<&'static str>>, Option<String>);

/// Returns the columns of a header.
fn columns_of(
    line: usize,
    record: &::csv::ByteRecord,
    encoding_hint: &str,
) -> Result<HeaderOfBlocks, ManifestError> {
    let names = column_names(line, record, encoding_hint)?;
    let columns = COLUMNS
        .assign(&names)
        .map_err(|same| at_line(line, &same.reason(&names)))?
        .columns;
    let mut problems = ManifestError::default();
    let required = COLUMNS.names[..REQUIRED].iter();
    let missing = required.filter(|name| !columns.contains(&Some(**name)));
    problems.extend(missing.map(|name| at_line(line, &missing_column(name, &names, &columns))));
    problems.check(false)?;
    let unread = unread_columns(&names, &columns);
    Ok((columns, unread))
}

/// Returns a sentence about columns that are not read, with a hint for the first that resembles an optional one which is
/// missing. Columns without a name are left out.
fn unread_columns(names: &[&str], columns: &[Option<&'static str>]) -> Option<String> {
    const MAX_NAMES: usize = 3;
    const MAX_NAME_CHARS: usize = 40;
    let quoted = |name: &str| format!("{:?}", sanitize(name, MAX_NAME_CHARS));
    let unread = names.iter().zip(columns);
    let unread = unread.filter(|(name, known)| known.is_none() && !name.is_empty());
    let unread: Vec<&str> = unread.map(|(name, _)| *name).collect();
    let (what, are) = match unread.as_slice() {
        [] => return None,
        [_] => ("column", "is"),
        _ => ("columns", "are"),
    };
    let hint = |name: &&str| {
        let found = name.to_lowercase();
        let mut missing = COLUMNS.names[REQUIRED..].iter();
        let column = missing
            .find(|column| similar_column(&found, column) && !columns.contains(&Some(**column)))?;
        let name = quoted(name);
        Some(format!(
            "; rename {name} to {column:?} if it is meant, and import again"
        ))
    };
    let hint = unread.iter().find_map(hint).unwrap_or_default();
    let shown: Vec<String> = unread.iter().map(|name| quoted(name)).collect();
    let (shown, known) = (first_names(&shown, MAX_NAMES), COLUMNS.names.join(", "));
    Some(format!(
        "{what} {shown} {are} ignored{hint}; a list of blocks has: {known}"
    ))
}

/// Returns a row, or records why it is not valid.
fn row(
    line: usize,
    columns: &[Option<&'static str>],
    record: &::csv::ByteRecord,
    reasons: &mut Vec<String>,
) -> Option<BlockRow> {
    if record.len() != columns.len() {
        let (cells, names) = (record.len(), columns.len());
        reasons.push(format!("the row has {cells} cells, the header has {names}"));
        return None;
    }
    let mut cells = BTreeMap::new();
    let known = columns.iter().zip(record);
    for (column, cell) in known.filter_map(|(column, cell)| Some((column.as_ref()?, cell))) {
        let Ok(cell) = std::str::from_utf8(cell) else {
            reasons.push(format!("the cell of column {column:?} is not UTF-8"));
            return None;
        };
        if cell.len() > MAX_PATH_BYTES {
            let (len, limit) = (cell.len(), MAX_PATH_BYTES);
            reasons.push(format!(
                "{column} has {len} bytes, over the limit of {limit}"
            ));
            return None;
        }
        let cell = trimmed(cell);
        if !cell.is_empty() {
            cells.insert(*column, cell);
        }
    }
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
