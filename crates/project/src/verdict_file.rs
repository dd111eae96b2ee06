//! Parses verdict files in CSV or JSON Lines format. If a line is invalid, the whole file is refused.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::str::FromStr;
use std::sync::Arc;

use csv::StringRecord;
use serde::Deserialize;

use super::files::RefusedLine;
use mocban_catalog::{ListedVerdict, NewVerdict, ReviewContext};
use mocban_core::domain::spelling::hint;
use mocban_core::domain::{ContentHash, PairName, UnixMillis};
use mocban_lists::manifest::{LineCounter, as_utf8, delimiter};
use mocban_lists::quotes::check_quotes;
use mocban_system::time_text::parse_utc;

const COLUMNS: [&str; 7] = [
    "pair", "verdict", "reviewer", "metric", "reason", "note", "at",
];
/// The first columns, which every file must have.
const REQUIRED: usize = 3;

/// One verdict and its line number.
#[derive(Debug, Clone, PartialEq)]
pub struct VerdictRow {
    /// Number of the line, from 1.
    pub line: usize,
    /// The verdict, and the result that it judges if the file names it.
    pub listed: ListedVerdict,
}

/// The text of a verdict file. Its rows are parsed whenever they are needed, so that a long file takes little memory.
#[derive(Debug, Clone)]
pub struct VerdictList {
    text: ListText,
    is_jsonl: bool,
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
    /// Takes the bytes of a file in CSV, or in JSON Lines. Detects the separator and the encoding.
    ///
    /// # Errors
    /// Returns an error if the bytes are not text, or if a quotation mark is never closed.
    pub fn new(bytes: Vec<u8>, is_jsonl: bool) -> Result<Self, RefusedLine> {
        let decoded = as_utf8(&bytes).map_err(|error| RefusedLine::new(1, &error.to_string()))?;
        let text = match decoded {
            Cow::Borrowed(text) if text.len() == bytes.len() => bytes,
            decoded => decoded.into_owned(),
        };
        if !is_jsonl {
            check_quotes(&text, delimiter(&text))
                .map_err(|error| RefusedLine::new(error.line, &error.to_string()))?;
        }
        let text = ListText(Arc::new(text));
        Ok(Self { text, is_jsonl })
    }

    /// Parses the rows.
    pub fn rows(&self) -> VerdictRows {
        if self.is_jsonl {
            Box::new(json_rows(self.text.clone()))
        } else {
            match csv_rows(self.text.clone()) {
                Ok(rows) => Box::new(rows),
                Err(refused) => Box::new(std::iter::once(Err(refused))),
            }
        }
    }
}

/// Parses a CSV file.
fn csv_rows(
    text: ListText,
) -> Result<impl Iterator<Item = Result<VerdictRow, RefusedLine>> + Send, RefusedLine> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter(text.as_ref()))
        .trim(csv::Trim::All)
        .from_reader(Cursor::new(text.clone()));
    let headers = reader.headers().map_err(|error| csv_error(&error, &text))?;
    let positions = positions(headers)?;
    let mut lines = LineCounter::new(text.clone());
    Ok(reader.into_records().map(move |record| {
        let record = record.map_err(|error| csv_error(&error, &text))?;
        let line = lines.at(record.position());
        row(&record, line, &positions)
    }))
}

/// Refuses a row with values that no verdict has.
pub fn check_values(row: &VerdictRow, now: UnixMillis) -> Result<(), RefusedLine> {
    let checked = row.listed.verdict.check(now);
    checked.map_err(|error| RefusedLine::new(row.line, &error.to_string()))
}

/// Refuses a list with unknown pairs. `first_lines` has the first line of each pair.
pub fn refuse_unknown(
    first_lines: &BTreeMap<PairName, usize>,
    unknown: &[PairName],
) -> Result<(), RefusedLine> {
    let lines = unknown.iter().map(|pair| (first_lines.get(pair), pair));
    match lines.min() {
        Some((line, pair)) => {
            let line = line.copied().unwrap_or_default();
            Err(RefusedLine::new(line, &format!("there is no pair {pair}")))
        }
        None => Ok(()),
    }
}

/// Returns the position of each of [`COLUMNS`] in the file.
fn positions(headers: &StringRecord) -> Result<[Option<usize>; 7], RefusedLine> {
    if let Some(unknown) = headers.iter().find(|name| !COLUMNS.contains(name)) {
        let reason = format!("there is no column {unknown}{}", hint(unknown, COLUMNS));
        return Err(RefusedLine::new(1, &reason));
    }
    let count = |name: &str| headers.iter().filter(|header| *header == name).count();
    if let Some(twice) = COLUMNS.iter().find(|name| count(name) > 1) {
        let reason = format!("column {twice} is there twice");
        return Err(RefusedLine::new(1, &reason));
    }
    let positions = COLUMNS.map(|name| headers.iter().position(|header| header == name));
    match positions[..REQUIRED].iter().position(Option::is_none) {
        Some(at) => Err(RefusedLine::new(
            1,
            &format!("column {} is missing", COLUMNS[at]),
        )),
        None => Ok(positions),
    }
}

fn row(
    record: &StringRecord,
    line: usize,
    positions: &[Option<usize>; 7],
) -> Result<VerdictRow, RefusedLine> {
    let cell = |column: usize| {
        positions[column]
            .and_then(|position| record.get(position))
            .filter(|text| !text.is_empty())
    };
    let required = |column: usize| {
        cell(column).ok_or_else(|| RefusedLine::new(line, &format!("{} is empty", COLUMNS[column])))
    };
    let verdict = NewVerdict {
        pair: value(required(0)?, line)?,
        verdict: value(required(1)?, line)?,
        reviewer: required(2)?.to_owned(),
        metric: cell(3).map(|text| value(text, line)).transpose()?,
        reason: cell(4).map(|text| value(text, line)).transpose()?,
        note: cell(5).map(ToOwned::to_owned),
        context: ReviewContext::default(),
        at: cell(6).map(|text| time(text, line)).transpose()?,
    };
    let judged = None;
    let listed = ListedVerdict { verdict, judged };
    Ok(VerdictRow { line, listed })
}

fn time(text: &str, line: usize) -> Result<UnixMillis, RefusedLine> {
    parse_utc(text).ok_or_else(|| {
        let reason =
            format!("at is {text:?}, not a time such as 2026-11-21 or 2026-11-21 04:10:03");
        RefusedLine::new(line, &reason)
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
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} cells where the header has {expected_len}"),
        csv::ErrorKind::Utf8 { .. } => "the text is not UTF-8; save it as \"CSV UTF-8\"".to_owned(),
        _ => error.to_string(),
    };
    RefusedLine::new(line, &reason)
}

/// A line written by `verdict log --json` or an export. Unknown fields are ignored.
#[derive(Debug, Deserialize)]
struct VerdictLine {
    #[serde(flatten)]
    verdict: NewVerdict,
    result_hash: Option<ContentHash>,
    undone_at: Option<UnixMillis>,
}

/// Parses a JSON Lines file. Undone verdicts are ignored.
fn json_rows(text: ListText) -> impl Iterator<Item = Result<VerdictRow, RefusedLine>> + Send {
    let mut at = 0;
    let next_line = move || {
        let rest = text.as_ref().get(at..).filter(|rest| !rest.is_empty())?;
        let line = rest.split(|byte| *byte == b'\n').next()?;
        at += line.len() + 1;
        let is_blank = line.trim_ascii().is_empty();
        Some((!is_blank).then(|| serde_json::from_slice(line)))
    };
    let lines = (1..).zip(std::iter::from_fn(next_line));
    let parsed = lines.filter_map(|(line, parsed)| Some((line, parsed?)));
    parsed.filter_map(|(line, parsed)| json_row(line, parsed).transpose())
}

/// Returns the row of a parsed line, or `None` if the verdict was undone.
fn json_row(
    line: usize,
    parsed: serde_json::Result<VerdictLine>,
) -> Result<Option<VerdictRow>, RefusedLine> {
    let VerdictLine {
        mut verdict,
        result_hash: judged,
        undone_at,
    } = parsed.map_err(|error| RefusedLine::new(line, &json_error(&error)))?;
    let reviewer = verdict.reviewer.trim().to_owned();
    verdict.reviewer = reviewer;
    if verdict.reviewer.is_empty() {
        return Err(RefusedLine::new(line, "reviewer is empty"));
    }
    let listed = ListedVerdict { verdict, judged };
    Ok(undone_at.is_none().then_some(VerdictRow { line, listed }))
}

/// Returns the parser's message without its line number, which is always 1 because lines are parsed one by one.
fn json_error(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let reason = message.split(" at line ").next().unwrap_or(&message);
    reason.to_owned()
}

#[cfg(test)]
mod tests;
