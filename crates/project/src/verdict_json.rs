//! Parses verdicts in JSON: JSON Lines, such as those of an export, with one object on each line, or an array of objects.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::files::RefusedLine;
use super::location::now;
use super::verdict_columns::COLUMNS;
use super::verdict_row::{GivenTime, VerdictRow, at_line, cells_reason};
use super::verdict_words;
use mocban_catalog::{ListedVerdict, NewVerdict, person_name};
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{
    ContentHash, Reason, ThresholdMetric, UniqueKeys, UnixMillis, Verdict, value_error_text,
};
use mocban_lists::columns::HAVE_SAME_NAME;
use mocban_lists::json_numbers::{AS_TEXT, nan_as_null, number_text};
use mocban_lists::manifest::{ArrayCursor, place_in_row, trimmed};

/// The fields of the log of verdicts, which JSON Lines may have.
const LOG_FIELDS: [&str; 17] = [
    "id",
    "act",
    "pair",
    "metric",
    "result_hash",
    "verdict",
    "reviewer",
    "reason",
    "note",
    "event",
    "seen",
    "shown_ms",
    "angle_read_deg",
    "review_order",
    "at",
    "undone_at",
    "current",
];

/// Returns the text of a field as the catalog has it, or a sentence about what it may be.
type StoredText = fn(&str) -> Result<String, String>;

/// The fields with texts, and how each is read.
const TEXTS: [(&str, StoredText); 6] = [
    ("pair", |text| Ok(text.to_owned())),
    ("verdict", |text| {
        verdict_words::verdict(text).map(|verdict| Verdict::name(verdict).to_owned())
    }),
    ("reviewer", |text| Ok(person_name(text))),
    ("reason", |text| {
        verdict_words::reason(text).map(|reason| Reason::name(reason).to_owned())
    }),
    ("metric", |text| {
        verdict_words::metric(text).map(|metric| ThresholdMetric::name(metric).to_owned())
    }),
    ("note", |text| Ok(text.to_owned())),
];
/// The fields of [`TEXTS`] that every line has.
const REQUIRED: [&str; 3] = ["pair", "verdict", "reviewer"];

/// A line written by `verdict log --json` or an export.
#[derive(Debug, Deserialize)]
struct VerdictLine {
    #[serde(flatten)]
    verdict: NewVerdict,
    result_hash: Option<ContentHash>,
    undone_at: Option<UnixMillis>,
    #[serde(flatten)]
    fields: BTreeMap<String, Value>,
}

/// Parses a JSON Lines file. Undone verdicts are ignored.
pub(crate) fn json_rows(
    text: impl AsRef<[u8]> + Send,
) -> impl Iterator<Item = Result<VerdictRow, RefusedLine>> + Send {
    let mut at = 0;
    let next_line = move || {
        let rest = text.as_ref().get(at..).filter(|rest| !rest.is_empty())?;
        let line = rest.split(|byte| *byte == b'\n').next()?;
        at += line.len() + 1;
        let is_blank = line.trim_ascii().is_empty();
        Some((!is_blank).then(|| parsed(line, 1)))
    };
    let lines = (1..).zip(std::iter::from_fn(next_line));
    let parsed = lines.filter_map(|(line, parsed)| Some((line, parsed?)));
    parsed.filter_map(|(line, parsed)| json_row(line, parsed).transpose())
}

/// Parses an array. Undone verdicts are ignored. Problems name the row, because a line may have many rows.
pub(crate) fn array_rows(
    text: impl AsRef<[u8]> + Send,
) -> impl Iterator<Item = Result<VerdictRow, RefusedLine>> + Send {
    let mut cursor = ArrayCursor::default();
    let values = (1..).zip(std::iter::from_fn(move || {
        let next = cursor.next_value(text.as_ref())?;
        Some(next.map(|(line, place)| (line, parsed(&text.as_ref()[place], line))))
    }));
    values.filter_map(|(number, value)| {
        let row = value
            .map_err(|refused| RefusedLine::new(refused.line, refused.reason))
            .and_then(|(line, parsed)| {
                json_row(line, parsed.map_err(|why| format!("row {number}: {why}")))
            });
        row.transpose()
    })
}

/// Parses a row that begins on the line `first`. If it is not JSON, tries again with `NaN` as no value. Verdicts, reasons,
/// metrics and times may be as in CSV.
///
/// # Errors
/// Returns a sentence about what was not understood.
fn parsed(row: &[u8], first: usize) -> Result<(VerdictLine, GivenTime), String> {
    let read = serde_json::from_slice(row).or_else(|error| {
        let text = std::str::from_utf8(row).ok().and_then(nan_as_null);
        text.map_or(Err(error), |text| serde_json::from_str(&text))
    });
    let explained = |error: serde_json::Error| json_error(&error, first, row);
    let UniqueKeys(value) = read.map_err(explained)?;
    let Value::Object(mut fields) = value else {
        return Err("each row is a JSON object with pair, verdict and reviewer".to_owned());
    };
    let is_unknown = |field: &String| !LOG_FIELDS.contains(&field.as_str());
    // Without a pair, `id` may be its name.
    if !fields.contains_key("pair") || fields.keys().any(is_unknown) {
        fields = with_known_names(fields)?;
    }
    // Notes are stored as they were given.
    let texts = fields.iter().filter(|(field, _)| *field != "note");
    let texts = texts.filter_map(|(field, value)| Some((field.as_str(), trimmed(value.as_str()?))));
    let known = texts.filter(|(field, _)| COLUMNS.names.contains(field));
    if let Some(reason) = cells_reason(known) {
        return Err(reason);
    }
    for (field, stored) in TEXTS {
        match text_of(&fields, field)? {
            Some(text) => fields.insert(field.to_owned(), stored(&text)?.into()),
            None if REQUIRED.contains(&field) => {
                let is_there = fields.contains_key(field);
                let what = if is_there { "empty" } else { "missing" };
                return Err(format!("{field} is {what}"));
            }
            None => fields.remove(field),
        };
    }
    let mut given = GivenTime::default();
    if let Some(Value::String(text)) = fields.get("at") {
        if !text.trim().is_empty() {
            given = GivenTime::parse(text.trim(), now())?;
        }
        let at = given.at.map_or(Value::Null, Value::from);
        fields.insert("at".to_owned(), at);
    }
    let read = serde_json::from_value(Value::Object(fields));
    Ok((read.map_err(explained)?, given))
}

/// Returns the fields under the names of the columns in CSV, whose other names and spellings they may have.
fn with_known_names(fields: Map<String, Value>) -> Result<Map<String, Value>, String> {
    let names: Vec<&str> = fields.keys().map(|name| name.trim()).collect();
    let found = COLUMNS.assign(&names).map_err(|same| {
        let [one, other] = [same.first, same.second].map(|number| quoted(names[number - 1]));
        format!("the fields {one} and {other} {HAVE_SAME_NAME}; leave one of them out")
    })?;
    let named = fields.into_iter().zip(found.columns);
    Ok(named
        .map(|((name, value), known)| (known.map_or(name, ToOwned::to_owned), value))
        .collect())
}

/// Returns the text of a field without blanks at its ends, or `None` if there is none. Numbers are accepted, because ids are
/// often numbers.
fn text_of(fields: &Map<String, Value>, field: &str) -> Result<Option<String>, String> {
    let text = match fields.get(field) {
        None | Some(Value::Null) => return Ok(None),
        // Notes are stored as they were given.
        Some(Value::String(text)) if field == "note" => text.clone(),
        Some(Value::String(text)) => trimmed(text).to_owned(),
        Some(Value::Number(number)) => {
            number_text(number).map_err(|error| format!("{field}: {error}; {AS_TEXT}"))?
        }
        Some(other) => return Err(format!("{field} is {other}, not text")),
    };
    Ok((!trimmed(&text).is_empty()).then_some(text))
}

/// Returns the row that was parsed from a line, or `None` if the verdict was undone.
fn json_row(
    line: usize,
    parsed: Result<(VerdictLine, GivenTime), String>,
) -> Result<Option<VerdictRow>, RefusedLine> {
    let (read, given) = at_line(line, parsed)?;
    let VerdictLine {
        verdict,
        result_hash: judged,
        undone_at,
        fields,
    } = read;
    let listed = ListedVerdict {
        verdict,
        judged,
        day: given.day,
    };
    let is_unread = |(field, value): &(String, Value)| {
        let is_empty =
            value.is_null() || value.as_str().is_some_and(|text| trimmed(text).is_empty());
        !LOG_FIELDS.contains(&field.as_str()) && (!is_empty || !field.trim().is_empty())
    };
    let unread = fields.into_iter().filter(is_unread);
    Ok(undone_at.is_none().then(|| VerdictRow {
        line,
        listed,
        unread: unread.map(|(field, _)| field).collect(),
        is_day_first: given.is_day_first,
        is_zone_unknown: given.is_zone_unknown,
    }))
}

/// Returns the parser's message with the place in the file, instead of that in the row.
fn json_error(error: &serde_json::Error, first: usize, row: &[u8]) -> String {
    let message = error.to_string();
    let reason = message.split(" at line ").next().unwrap_or(&message);
    if error.is_data() {
        value_error_text(reason)
    } else {
        let place = place_in_row(error, first, row);
        format!("not a JSON object, {place}: {reason}")
    }
}
