//! Parses verdict files in CSV or JSON. If a line is invalid, the whole file is refused.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::str::FromStr;
use std::sync::Arc;

use csv::StringRecord;

use super::files::{MAX_SHOWN, RefusedLine, fields_with_lines};
use super::location::now;
use super::verdict_columns::{COLUMNS, REQUIRED};
use super::verdict_json::{array_rows, json_rows};
use super::verdict_row::{DAY_MS, GivenTime, VerdictRow, at_line, cells_reason};
use super::verdict_words;
use mocban_catalog::{
    CLOCK_SKEW_MS, InvalidVerdict, ListedVerdict, NewVerdict, ReviewContext, person_name,
};
use mocban_core::domain::spelling::{hint, quoted};
use mocban_core::domain::{PairName, UnixMillis};
use mocban_lists::columns::{HeaderColumns, SameColumn};
use mocban_lists::manifest::{
    CsvText, LineCounter, NotText, as_utf8, fits_header, is_array, later_header, plain_cell,
    plain_header, trimmed, whole_and_decimals, whole_part,
};
use mocban_lists::quotes::check_quotes;
use mocban_system::time_text::{day, duration};

/// The text of a verdict file. Its rows are parsed whenever they are needed, so that a long file takes little memory.
#[derive(Debug, Clone)]
pub struct VerdictList {
    text: ListText,
    layout: VerdictLayout,
    /// Pairs that the list names in another way, by the name in the list.
    meant: Arc<BTreeMap<PairName, PairName>>,
}

/// How the rows are written.
#[derive(Debug, Clone, Copy)]
enum VerdictLayout {
    /// CSV with this separator.
    Csv(u8),
    JsonLines,
    JsonArray,
}

/// Text that clones share.
#[derive(Debug, Clone)]
struct ListText(Arc<Vec<u8>>);

impl AsRef<[u8]> for ListText {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// Rows of a file, up to the first invalid line.
type VerdictRows = Box<dyn Iterator<Item = Result<VerdictRow, RefusedLine>> + Send>;

impl VerdictList {
    /// Takes the bytes of a file in CSV, or in JSON: one object on each line, or an array of objects. Detects the separator
    /// and the encoding.
    ///
    /// # Errors
    /// Returns an error if the bytes are not text, or if a quotation mark is never closed.
    pub fn new(bytes: Vec<u8>, is_json: bool) -> Result<Self, RefusedLine> {
        let refuse = |error: NotText| RefusedLine::new(1, &error.to_string());
        let (text, layout) = if is_json {
            let text = as_utf8(&bytes).map_err(refuse)?;
            let layout = if is_array(&text) {
                VerdictLayout::JsonArray
            } else {
                VerdictLayout::JsonLines
            };
            (text, layout)
        } else {
            let CsvText { bytes, delimiter } = CsvText::new(&bytes).map_err(refuse)?;
            check_quotes(&bytes, delimiter)
                .map_err(|error| RefusedLine::new(error.line, &error.to_string()))?;
            (bytes, VerdictLayout::Csv(delimiter))
        };
        let text = match text {
            Cow::Borrowed(text) if text.len() == bytes.len() => bytes,
            decoded => decoded.into_owned(),
        };
        let text = ListText(Arc::new(text));
        let meant = Arc::default();
        Ok(Self {
            text,
            layout,
            meant,
        })
    }

    /// Returns the list with pairs in place of the names that mean them. `meant` has each pair by the name in the list.
    #[must_use]
    pub fn with_meant(self, meant: BTreeMap<PairName, PairName>) -> Self {
        let meant = Arc::new(meant);
        Self { meant, ..self }
    }

    /// Parses the rows.
    pub fn rows(&self) -> VerdictRows {
        let rows = self.written_rows();
        if self.meant.is_empty() {
            return rows;
        }
        let meant = Arc::clone(&self.meant);
        Box::new(rows.map(move |row| {
            let mut row = row?;
            if let Some(name) = meant.get(&row.listed.verdict.pair) {
                row.listed.verdict.pair.clone_from(name);
            }
            Ok(row)
        }))
    }

    /// Parses the rows with the names as written.
    fn written_rows(&self) -> VerdictRows {
        let text = self.text.clone();
        match self.layout {
            VerdictLayout::JsonLines => Box::new(json_rows(text)),
            VerdictLayout::JsonArray => Box::new(array_rows(text)),
            VerdictLayout::Csv(delimiter) => match csv_rows(text, delimiter) {
                Ok(rows) => Box::new(rows),
                Err(refused) => Box::new(std::iter::once(Err(refused))),
            },
        }
    }

    /// Returns a function that parses the rows whenever it is called, without those of some pairs.
    pub fn rows_without(&self, pairs: BTreeSet<PairName>) -> impl Fn() -> VerdictRows + use<> {
        let (list, pairs) = (self.clone(), Arc::new(pairs));
        move || {
            let pairs = Arc::clone(&pairs);
            let is_kept = move |row: &Result<VerdictRow, RefusedLine>| {
                let is_of_them = |row: &VerdictRow| pairs.contains(&row.listed.verdict.pair);
                !row.as_ref().is_ok_and(is_of_them)
            };
            Box::new(list.rows().filter(is_kept))
        }
    }
}

/// Parses a CSV file.
fn csv_rows(
    text: ListText,
    delimiter: u8,
) -> Result<impl Iterator<Item = Result<VerdictRow, RefusedLine>> + Send, RefusedLine> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(Cursor::new(text.clone()));
    let headers = reader.headers().map_err(|error| csv_error(&error, &text))?;
    let mut lines = LineCounter::new(text.clone());
    let line = lines.at(headers.position());
    let below = later_header(text.as_ref(), (delimiter, line), &COLUMNS, REQUIRED);
    let layout = columns_of(headers, line, below)?;
    let columns = headers.len();
    let mut parse = move |record: Result<StringRecord, csv::Error>| {
        let record = record.map_err(|error| csv_error(&error, &text))?;
        // Spreadsheet programs append rows of empty cells.
        if record.iter().all(|cell| trimmed(cell).is_empty()) {
            return Ok(None);
        }
        let line = lines.at(record.position());
        let is_unnamed = |column| layout.unnamed.contains(&column);
        if !fits_header(record.as_byte_record(), columns, is_unnamed) {
            let cells = record.len();
            let reason = format!("{cells} cells where the header has {columns}");
            return Err(RefusedLine::new(line, &reason));
        }
        layout.refuse_unnamed(&record, line)?;
        layout.refuse_errors(&record, line)?;
        row(&record, line, &layout.positions).map(Some)
    };
    let records = reader.into_records();
    Ok(records.filter_map(move |record| parse(record).transpose()))
}

/// Refuses a row with values that no verdict has.
pub fn check_values(row: &VerdictRow, now: UnixMillis) -> Result<(), RefusedLine> {
    let is_ahead = |at: UnixMillis| at > now + CLOCK_SKEW_MS && !row.is_zone_unknown;
    let checked = row.listed.verdict.check(now);
    let checked = checked.and_then(|()| match row.listed.verdict.at {
        Some(at) if is_ahead(at) => Err(InvalidVerdict::At),
        _ => Ok(()),
    });
    checked.map_err(|error| {
        let mut reason = error.to_string();
        if let (InvalidVerdict::At, Some(at)) = (error, row.listed.verdict.at) {
            reason = format!("{reason}, and this is {}", time_reason(at, now));
        }
        RefusedLine::new(row.line, &reason)
    })
}

/// Says what a time is that cannot be that of a verdict. One that is a little ahead is more likely that of a wrong clock than
/// another date.
fn time_reason(at: UnixMillis, now: UnixMillis) -> String {
    let ahead = u64::try_from(at.saturating_sub(now)).unwrap_or_default();
    if (1..=DAY_MS as u64).contains(&ahead) {
        let ahead = duration(ahead);
        return format!(
            "{ahead} ahead of the clock of this computer; correct the time or the clock"
        );
    }
    let day = day(at);
    format!("{day} in UTC; a date such as 3/4/2026 has the day first")
}

/// Returns why a list with unknown pairs is refused, one line for each pair. `first_lines` has the first line of each pair,
/// `known` the pairs that exist, of which a similar one is suggested.
pub fn unknown_pairs(
    first_lines: &BTreeMap<PairName, usize>,
    unknown: &[PairName],
    known: &[PairName],
) -> Vec<RefusedLine> {
    let lines = unknown.iter().map(|pair| (first_lines.get(pair), pair));
    let mut lines: Vec<_> = lines.collect();
    lines.sort_unstable();
    // A suggestion compares with every pair, so only lines that may be shown get one.
    let refused = lines.into_iter().enumerate().map(|(number, (line, pair))| {
        let hint = if number < MAX_SHOWN {
            hint(pair.as_str(), known.iter().map(PairName::as_str))
        } else {
            String::new()
        };
        let reason = format!("there is no pair {pair}{hint}");
        RefusedLine::new(line.copied().unwrap_or_default(), &reason)
    });
    refused.collect()
}

/// Returns the pairs that some names are likely to mean, each by its name: Python writes whole numbers with `.0` if a value of
/// their column is missing, and spreadsheet programs may write `,0`.
pub fn without_decimals(unknown: &[PairName]) -> BTreeMap<PairName, PairName> {
    let meant = unknown.iter().filter_map(|name| {
        let whole = PairName::new(whole_part(name.as_str())?).ok()?;
        Some((name.clone(), whole))
    });
    meant.collect()
}

/// Returns a warning about pairs that are meant by names with `.0`. `first_lines` has the first line of each name.
pub fn decimal_names(
    meant: &BTreeMap<PairName, PairName>,
    first_lines: &BTreeMap<PairName, usize>,
) -> Option<String> {
    let lines = meant.keys().filter_map(|name| first_lines.get(name));
    let (count, line) = (meant.len(), lines.min()?);
    let (_, decimals) = whole_and_decimals(meant.keys().next()?.as_str())?;
    Some(format!(
        "whole numbers that are written with {decimals}: {count}, the first in column \"pair\" on line {line}; they are read without it, as in JSON and XLSX"
    ))
}

/// Returns a warning about fields that are not read. They are given with the first line of each.
pub fn unread_fields(first_lines: &BTreeMap<String, usize>) -> Option<String> {
    let read = COLUMNS.names[REQUIRED..].join(", ");
    (!first_lines.is_empty()).then(|| {
        let fields = fields_with_lines(first_lines);
        format!(
            "fields that no verdict has are not read: {fields}; besides pair, verdict and reviewer, {read} are"
        )
    })
}

/// The columns of a CSV file.
struct CsvColumns {
    /// The position of each of [`COLUMNS`].
    positions: [Option<usize>; 8],
    /// Positions of columns without a name, which spreadsheet programs append.
    unnamed: Vec<usize>,
}

impl CsvColumns {
    /// Refuses a row with a value in a column without a name.
    fn refuse_unnamed(&self, record: &StringRecord, line: usize) -> Result<(), RefusedLine> {
        let is_filled = |position: &&usize| {
            let cell = record.get(**position);
            cell.is_some_and(|cell| !trimmed(cell).is_empty())
        };
        let Some(position) = self.unnamed.iter().find(is_filled) else {
            return Ok(());
        };
        let column = position + 1;
        let reason = format!(
            "column {column} has no heading, but a value here; give it a heading, or clear its cells"
        );
        Err(RefusedLine::new(line, &reason))
    }

    /// Refuses a row with errors of formulas.
    fn refuse_errors(&self, record: &StringRecord, line: usize) -> Result<(), RefusedLine> {
        let cells = COLUMNS.names.iter().zip(self.positions);
        let cells =
            cells.filter_map(|(name, position)| Some((*name, trimmed(record.get(position?)?))));
        let reason = cells_reason(cells);
        reason.map_or(Ok(()), |reason| Err(RefusedLine::new(line, &reason)))
    }
}

/// Returns the columns of a file. The header is on this line, unless it is a title and the line `below` is the header.
fn columns_of(
    headers: &StringRecord,
    line: usize,
    below: Option<usize>,
) -> Result<CsvColumns, RefusedLine> {
    let names: Vec<&str> = headers.iter().map(plain_header).collect();
    let refuse = |reason: &str| RefusedLine::new(line, reason);
    let same = |same: SameColumn| refuse(&same.reason(&names));
    let HeaderColumns { columns, .. } = COLUMNS.assign(&names).map_err(same)?;
    let others = (0..names.len()).filter(|k| columns[*k].is_none());
    let (unnamed, unknown): (Vec<usize>, Vec<usize>) = others.partition(|k| names[*k].is_empty());
    let unknown: Vec<&str> = unknown.into_iter().map(|k| names[k]).collect();
    let required = COLUMNS.names[..REQUIRED].iter().copied();
    let missing: Vec<&str> = required
        .filter(|name| !columns.contains(&Some(*name)))
        .collect();
    if !unknown.is_empty() || !missing.is_empty() {
        return Err(refuse(&match below {
            Some(below) => format!(
                "this is no header; line {below} has the columns pair, verdict and reviewer: remove the lines above it"
            ),
            None => columns_reason(&missing, &unknown),
        }));
    }
    let mut positions = [None; 8];
    for (position, name) in positions.iter_mut().zip(COLUMNS.names) {
        *position = columns.iter().position(|column| *column == Some(name));
    }
    Ok(CsvColumns { positions, unnamed })
}

/// Returns which columns are missing and which are unknown: `columns verdict, reviewer are missing; columns result, who
/// are unknown`.
fn columns_reason(missing: &[&str], unknown: &[&str]) -> String {
    let list = |names: &[&str], are: &str| match names {
        [] => None,
        [name] => Some(format!("column {name} is {are}")),
        names => Some(format!("columns {} are {are}", names.join(", "))),
    };
    let similar = match unknown {
        [one] if missing.is_empty() => hint(one, COLUMNS.names.iter().copied()),
        [one] => hint(one, missing.iter().copied()),
        _ => String::new(),
    };
    let parts = [list(missing, "missing"), list(unknown, "unknown")];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let known = COLUMNS.names[REQUIRED..].join(", ");
    format!(
        "{}{similar}; needed are pair, verdict and reviewer, and possible {known}",
        parts.join("; ")
    )
}

fn row(
    record: &StringRecord,
    line: usize,
    positions: &[Option<usize>; 8],
) -> Result<VerdictRow, RefusedLine> {
    let cells = positions.map(|position| {
        let cell = position.and_then(|position| record.get(position));
        cell.map(plain_cell).filter(|text| !text.is_empty())
    });
    let cell = |column: usize| cells[column].as_deref();
    let required = |column: usize| {
        cell(column)
            .ok_or_else(|| RefusedLine::new(line, &format!("{} is empty", COLUMNS.names[column])))
    };
    let metric = |text| at_line(line, verdict_words::metric(text));
    let reason = |text| at_line(line, verdict_words::reason(text));
    let time = |text| at_line(line, GivenTime::parse(text, now()));
    let GivenTime {
        at,
        day,
        is_day_first,
        is_zone_unknown,
    } = cell(6).map(time).transpose()?.unwrap_or_default();
    let angle = |text| at_line(line, parsed_angle(text));
    let context = ReviewContext {
        angle_read_deg: cell(7).map(angle).transpose()?,
        ..ReviewContext::default()
    };
    let verdict = NewVerdict {
        pair: value(required(0)?, line)?,
        verdict: at_line(line, verdict_words::verdict(required(1)?))?,
        reviewer: person_name(required(2)?),
        metric: cell(3).map(metric).transpose()?,
        reason: cell(4).map(reason).transpose()?,
        note: cell(5).map(ToOwned::to_owned),
        context,
        at,
    };
    let listed = ListedVerdict {
        verdict,
        judged: None,
        day,
    };
    Ok(VerdictRow {
        line,
        listed,
        unread: Vec::new(),
        is_day_first,
        is_zone_unknown,
    })
}

/// Parses the rotation that a reviewer found missing, in degrees. A list may have decimal commas.
fn parsed_angle(text: &str) -> Result<f64, String> {
    let angle = text.replacen(',', ".", 1).parse();
    angle.map_err(|_error| {
        let text = quoted(text);
        format!("angle_read_deg is {text}, not a number of degrees such as -4.5")
    })
}

fn value<T>(text: &str, line: usize) -> Result<T, RefusedLine>
where
    T: FromStr<Err: std::fmt::Display>,
{
    text.parse()
        .map_err(|error: T::Err| RefusedLine::new(line, &error.to_string()))
}

fn csv_error(error: &csv::Error, text: &ListText) -> RefusedLine {
    let line = LineCounter::new(text.clone()).at(error.position());
    let reason = match error.kind() {
        csv::ErrorKind::Utf8 { .. } => "the text is not UTF-8; save it as \"CSV UTF-8\"".to_owned(),
        _ => error.to_string(),
    };
    RefusedLine::new(line, &reason)
}

#[cfg(test)]
mod array_tests;
#[cfg(test)]
mod column_tests;
#[cfg(test)]
mod decimal_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod time_tests;
