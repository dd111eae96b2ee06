//! CSV lists, separated by commas, semicolons or tabs.

use super::block_columns;
use super::cell_forms::{CellForm, is_formula, plain_cell, plain_header};
use super::chosen_columns::ChosenColumns;
use super::column_names::missing_column;
use super::draft::{DraftRow, RowCollector};
use super::encoding_hint::encoding_hint;
use super::error::{ManifestError, Problem, at_line, of_list};
use super::later_header::later_header;
use super::row::{COLUMNS, ManifestRow, REQUIRED, ReadRows};
use super::row_reader::{is_blank, row_reader};
use super::text::{CsvText, LineCounter, trimmed};
use super::whole_numbers::WholeNumbers;
use crate::columns::HeaderColumns;
use crate::quotes::check_quotes;
use memchr::memchr2;
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{first_names, sanitize};

/// Parses a CSV list with a header line. Columns may be in any order, and their names in any case. Blank lines are
/// ignored.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no pairs, or has an invalid header or row. The error names
/// the lines of invalid rows.
pub fn parse_csv(bytes: &[u8]) -> Result<Vec<ManifestRow>, ManifestError> {
    let mut rows = Vec::new();
    read_csv(bytes, &mut |row| rows.push(row))?;
    Ok(rows)
}

/// Parses a CSV list like [`parse_csv`], but passes each row to `each` instead of keeping all rows in memory. Valid
/// rows are passed even if other rows are invalid. Returns the ids of the rows, and which columns have other names.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no pairs, or has an invalid header or row. The error names
/// the lines of invalid rows.
pub fn read_csv(
    bytes: &[u8],
    each: &mut dyn FnMut(ManifestRow),
) -> Result<ReadRows, ManifestError> {
    read_csv_as(bytes, &ChosenColumns::default(), each)
}

/// Parses a CSV list like [`read_csv`], with columns that a person has chosen.
///
/// # Errors
/// Returns an error like [`read_csv`], and if a chosen column is not there.
pub fn read_csv_as(
    bytes: &[u8],
    chosen: &ChosenColumns,
    each: &mut dyn FnMut(ManifestRow),
) -> Result<ReadRows, ManifestError> {
    let text = CsvText::new(bytes).map_err(|error| of_list(&error.to_string()))?;
    let (bytes, delimiter) = (&*text.bytes, text.delimiter);
    check_quotes(bytes, delimiter).map_err(|error| at_line(error.line, &error.to_string()))?;
    let mut reader = row_reader(bytes, delimiter);
    let mut lines = LineCounter::new(bytes);
    let mut record = ::csv::ByteRecord::new();
    let mut header: Option<CsvHeader> = None;
    let mut rows = RowCollector::new(each);
    loop {
        reader.get_mut().begin_row();
        let start = reader.position().clone();
        let is_read = reader.read_byte_record(&mut record);
        let position = record.position().unwrap_or(&start);
        let line = lines.at(Some(if is_read.is_ok() { position } else { &start }));
        match (is_read, &header) {
            (Ok(false), Some(_)) => break,
            (Ok(false), None) => return Err(of_list("the list is empty").into()),
            (Ok(true), Some(header)) => rows.push(line, header.draft(line, &record)),
            (Ok(true), None) => {
                let mut parsed = CsvHeader::parse(line, &record, (bytes, delimiter), chosen)?;
                rows.add_renamed(std::mem::take(&mut parsed.renamed));
                rows.add_unread(std::mem::take(&mut parsed.unread));
                header = Some(parsed);
            }
            (Err(error), _) => {
                rows.push(line, Err(error.to_string()));
                break;
            }
        }
    }
    rows.finish()
}

/// Longest name of a column in bytes. Every row stores the names of its user-defined columns.
const MAX_NAME_BYTES: usize = 1000;

/// Returns the names of the columns of a header, each read by [`plain_header`].
pub(super) fn column_names<'r>(
    line: usize,
    record: &'r ::csv::ByteRecord,
    encoding_hint: &str,
) -> Result<Vec<&'r str>, ManifestError> {
    let mut problems = ManifestError::default();
    let mut names = Vec::new();
    let mut undecoded = Vec::new();
    for (number, field) in (1..).zip(record) {
        let Ok(name) = std::str::from_utf8(field) else {
            undecoded.push(number);
            continue;
        };
        let name = plain_header(name);
        if name.len() > MAX_NAME_BYTES {
            let (len, limit) = (name.len(), MAX_NAME_BYTES);
            let reason =
                format!("the name of column {number} has {len} bytes, over the limit of {limit}");
            problems.add(at_line(line, &reason));
        }
        names.push(name);
    }
    problems
        .extend(not_utf8(&undecoded).map(|text| at_line(line, &format!("{text}{encoding_hint}"))));
    problems.check(false)?;
    Ok(names)
}

/// Says which columns have names that are not UTF-8, once for all.
fn not_utf8(columns: &[usize]) -> Option<String> {
    match columns {
        [] => None,
        [column] => Some(format!("the name of column {column} is not UTF-8")),
        columns => {
            let columns: Vec<String> = columns.iter().map(usize::to_string).collect();
            let names = first_names(&columns, MAX_COLUMNS_SHOWN);
            Some(format!("the names of columns {names} are not UTF-8"))
        }
    }
}

/// Largest number of columns that a message names.
const MAX_COLUMNS_SHOWN: usize = 12;

/// Says which of the lines below the first `above` ones is the header of a list of pairs or of blocks, if a title stands
/// above it.
fn header_below(list: &[u8], delimiter: u8, above: usize) -> Option<Problem> {
    let find = |known, required| later_header(list, (delimiter, above), known, required);
    let of_pairs = find(&COLUMNS, REQUIRED.len()).map(|number| (number, "has these columns"));
    let (number, what) = of_pairs.or_else(|| {
        let number = find(&block_columns::COLUMNS, block_columns::REQUIRED)?;
        Some((number, "has the columns of a list of blocks"))
    })?;
    let text = format!("line {number} {what}; remove the lines above it");
    Some(of_list(&text))
}

/// A column of a header: its standard name, if it is known, and its name as written.
pub(super) type ListedColumn = (Option<&'static str>, String);

/// The header of a list.
struct CsvHeader {
    /// The columns in order.
    columns: Vec<ListedColumn>,
    /// Columns with other names, as written, each with its name.
    renamed: Vec<(String, &'static str)>,
    /// Columns with other names of columns that are known.
    unread: Vec<(String, &'static str)>,
    /// Columns whose whole numbers have decimals.
    whole_numbers: WholeNumbers,
    /// What to do about cells that are not UTF-8.
    encoding_hint: String,
    delimiter: u8,
}

impl CsvHeader {
    fn parse(
        line: usize,
        record: &::csv::ByteRecord,
        (list, delimiter): (&[u8], u8),
        chosen: &ChosenColumns,
    ) -> Result<Self, ManifestError> {
        let encoding_hint = match std::str::from_utf8(list) {
            Ok(_) => String::new(),
            Err(_) => encoding_hint(list),
        };
        let names = column_names(line, record, &encoding_hint)?;
        let found = chosen.assign(&names);
        let found = found.map_err(|reason| at_line(line, &reason))?;
        if let Some(same) = found.same_others(&names) {
            return Err(at_line(line, &same.reason(&names)).into());
        }
        let HeaderColumns {
            columns,
            renamed,
            unread,
        } = found;
        let mut problems = ManifestError::default();
        let missing = REQUIRED
            .iter()
            .filter(|name| !columns.contains(&Some(**name)));
        problems.extend(
            missing.map(|name| at_line(line, &missing_column(name, &COLUMNS, &names, &columns))),
        );
        if let Err(mut problems) = problems.check(false) {
            if let Some(below) = header_below(list, delimiter, line) {
                if names.len() == 1 {
                    problems = at_line(line, "this is no header").into();
                }
                problems.add(below);
            }
            return Err(problems);
        }
        let names = names.into_iter().map(str::to_owned);
        Ok(Self {
            whole_numbers: WholeNumbers::find(list, delimiter, columns.iter().copied()),
            columns: columns.into_iter().zip(names).collect(),
            renamed,
            unread,
            encoding_hint,
            delimiter,
        })
    }

    /// Returns a row's cells. Returns `None` if the row is blank.
    ///
    /// # Errors
    /// Returns an error if the number of cells is wrong or a cell cannot be read.
    fn draft(&self, line: usize, record: &::csv::ByteRecord) -> Result<Option<DraftRow>, String> {
        if is_blank(record) {
            return Ok(None);
        }
        let columns = (self.columns.as_slice(), &self.whole_numbers);
        let place = (line, self.delimiter);
        draft_of(place, columns, record, &self.encoding_hint).map(Some)
    }
}

/// Returns whether a row can be read below a header with `columns` columns: its cells behind the last column are empty, and the
/// last columns for which it has no cells have no name.
pub fn fits_header(
    record: &::csv::ByteRecord,
    columns: usize,
    is_unnamed: impl Fn(usize) -> bool,
) -> bool {
    let is_empty =
        |cell: &[u8]| std::str::from_utf8(cell).is_ok_and(|cell| trimmed(cell).is_empty());
    (columns..record.len()).all(|cell| is_empty(&record[cell]))
        && (record.len()..columns).all(is_unnamed)
}

/// Longest formula in a message, in characters.
const MAX_FORMULA_CHARS: usize = 60;

/// Returns the cells of a row on a line.
///
/// # Errors
/// Returns an error if the number of cells is wrong, a cell is not UTF-8, one of a known column begins like a formula, a path
/// or a character has a line break, or a whole number is too large to be exact.
pub(super) fn draft_of(
    (line, delimiter): (usize, u8),
    (columns, whole_numbers): (&[ListedColumn], &WholeNumbers),
    record: &::csv::ByteRecord,
    encoding_hint: &str,
) -> Result<DraftRow, String> {
    let (cells, names) = (record.len(), columns.len());
    if !fits_header(record, names, |column| columns[column].1.is_empty()) {
        return Err(format!("the row has {cells} cells, the header has {names}"));
    }
    let mut draft = DraftRow::new(line);
    // Few rows have any.
    let has_breaks = memchr2(b'\n', b'\r', record.as_slice()).is_some();
    for ((known, name), cell) in columns.iter().zip(record) {
        let Ok(cell) = std::str::from_utf8(cell) else {
            let name = quoted(known.unwrap_or(name));
            return Err(format!(
                "the cell of column {name} is not UTF-8{encoding_hint}"
            ));
        };
        let cell = &*plain_cell(cell);
        if cell.is_empty() {
            continue;
        }
        if is_formula(cell) {
            if let Some(known) = known {
                let shown = quoted(&sanitize(cell, MAX_FORMULA_CHARS));
                return Err(format!(
                    "column {known} has {shown}, which begins like a formula; write the text itself"
                ));
            }
            if !name.is_empty() {
                draft.unusual.push((CellForm::Formula, name.clone()));
            }
        }
        if CellForm::has_apostrophe(cell) {
            let column = known.unwrap_or(name).to_owned();
            draft.unusual.push((CellForm::Apostrophe, column));
        }
        if has_breaks && known.is_none() && CellForm::takes_row(cell, delimiter, names) {
            draft.unusual.push((CellForm::TakesRow, name.clone()));
        }
        if let Some(known) = known {
            // An id and a block have their own sentences.
            if has_breaks && cell.contains(['\n', '\r']) && !matches!(*known, "id" | "block") {
                return Err(format!(
                    "column {known} has a line break; write it on one line"
                ));
            }
            draft.cells.insert(known, cell.to_owned());
        } else if name.is_empty() {
            draft.unnamed += 1;
        } else {
            draft.meta.insert(name.clone(), cell.into());
        }
    }
    whole_numbers.apply(&mut draft)?;
    Ok(draft)
}

#[cfg(test)]
mod tests;
