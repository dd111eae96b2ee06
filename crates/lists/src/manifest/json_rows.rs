//! The rows of lists in JSON: an object on each line, or an array of objects.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::column_names::shown_column;
use super::draft::{DraftRow, MAX_ROW_BYTES};
use super::error::{Problem, at_line, of_list};
use super::json_array::{ArrayCursor, DamagedArray, is_array, place_in_row};
use super::text::{as_utf8, trimmed};
use crate::columns::{HAVE_SAME_NAME, HeaderColumns, KnownColumns};
use crate::json_numbers::{AS_TEXT, nan_as_null, number_text, unknown_number};
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{KEY_TWICE, UniqueKeys, value_error_text};

/// A row of a list in JSON.
#[derive(Debug)]
pub(super) struct JsonRow {
    pub(super) line: usize,
    /// Its cells, or why it was not understood.
    pub(super) draft: Result<DraftRow, String>,
    /// Keys with other names that no earlier row has in this order, each with its name.
    pub(super) renamed: Vec<(String, &'static str)>,
    /// Such keys that are not read, because the row has another one of the same meaning.
    pub(super) unread: Vec<(String, &'static str)>,
}

/// Passes the rows of a list in JSON, with these columns, to `each`.
///
/// # Errors
/// Returns why the list is not text, or where an array is damaged.
pub(super) fn json_rows(
    bytes: &[u8],
    known: KnownColumns,
    each: &mut dyn FnMut(JsonRow),
) -> Result<(), Problem> {
    let bytes = &*as_utf8(bytes).map_err(|error| of_list(&error.to_string()))?;
    let mut keys = RowKeys::of(known);
    let mut push = |line, content: &[u8]| {
        let draft = if content.len() > MAX_ROW_BYTES {
            let len = content.len();
            Err(format!(
                "the row has {len} bytes, over the limit of {MAX_ROW_BYTES}"
            ))
        } else {
            draft(line, content, &mut keys)
        };
        let renamed = std::mem::take(&mut keys.columns.renamed);
        let unread = std::mem::take(&mut keys.columns.unread);
        each(JsonRow {
            line,
            draft,
            renamed,
            unread,
        });
    };
    for next in row_contents(bytes) {
        let (line, content) = next.map_err(|refused| at_line(refused.line, refused.reason))?;
        push(line, content);
    }
    Ok(())
}

/// Passes the keys and values of the rows of a list in JSON that can be read to `each`, until it returns `false`.
pub(super) fn rows_while(bytes: &[u8], mut each: impl FnMut(&[(String, Value)]) -> bool) {
    let Ok(bytes) = as_utf8(bytes) else {
        return;
    };
    let rows = row_contents(&bytes).map_while(Result::ok);
    for row in rows.filter_map(|(_, content)| row_entries(content)) {
        if !each(&row) {
            break;
        }
    }
}

/// A row with its line, or where an array is damaged.
type RowContent<'b> = Result<(usize, &'b [u8]), DamagedArray>;

/// Returns the rows of a list as text. Nothing follows an error.
fn row_contents(bytes: &[u8]) -> Box<dyn Iterator<Item = RowContent<'_>> + '_> {
    if is_array(bytes) {
        let mut cursor = ArrayCursor::default();
        let values = std::iter::from_fn(move || cursor.next_value(bytes));
        return Box::new(values.map(move |next| next.map(|(line, place)| (line, &bytes[place]))));
    }
    let lines = (1..).zip(bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii));
    Box::new(lines.filter(|(_, content)| !content.is_empty()).map(Ok))
}

/// Returns the keys and values of a row, if it can be read.
fn row_entries(row: &[u8]) -> Option<Vec<(String, Value)>> {
    if row.len() > MAX_ROW_BYTES {
        return None;
    }
    let JsonEntries(entries) = parsed(std::str::from_utf8(row).ok()?).ok()?;
    Some(entries)
}

/// The keys of the row before, and what they are: most rows of a list have the same keys.
struct RowKeys {
    known: KnownColumns,
    keys: Vec<String>,
    columns: HeaderColumns,
}

impl RowKeys {
    /// Starts before the first row.
    fn of(known: KnownColumns) -> Self {
        Self {
            known,
            keys: Vec::new(),
            columns: HeaderColumns::default(),
        }
    }

    /// Finds out what the keys of a row are.
    fn update(&mut self, object: &[(String, Value)]) -> Result<(), String> {
        let keys = object.iter().map(|(key, _)| key);
        if keys.clone().eq(&self.keys) {
            return Ok(());
        }
        let twice = |k: usize| format!("the key {} {KEY_TWICE}", quoted(&object[k].0));
        let names: Vec<&str> = keys.clone().map(|key| key.trim()).collect();
        let found = self.known.assign(&names).map_err(|same| {
            let [one, other] = [same.first, same.second].map(|number| names[number - 1]);
            if one == other {
                return twice(same.second - 1);
            }
            let [one, other] = [one, other].map(quoted);
            format!("the keys {one} and {other} {HAVE_SAME_NAME}; leave one of them out")
        })?;
        let mut others = BTreeSet::new();
        let is_twice = |k: &usize| found.columns[*k].is_none() && !others.insert(&object[*k].0);
        if let Some(k) = (0..object.len()).find(is_twice) {
            return Err(twice(k));
        }
        self.keys = keys.cloned().collect();
        self.columns = found;
        Ok(())
    }
}

fn draft(line: usize, content: &[u8], keys: &mut RowKeys) -> Result<DraftRow, String> {
    let text = std::str::from_utf8(content)
        .map_err(|error| format!("byte {} is not UTF-8", error.valid_up_to() + 1))?;
    let JsonEntries(object) = parsed(text).map_err(|error| wrong_json(&error, line, text))?;
    keys.update(&object)?;
    if let [(key, Value::Array(_))] = object.as_slice()
        && keys.columns.columns == [None]
    {
        return Err(format!(
            "the rows are in the list {} of an object; save this list alone",
            shown_column(key)
        ));
    }
    let mut draft = DraftRow::new(line);
    for ((key, value), known) in object.into_iter().zip(&keys.columns.columns) {
        match (*known, value) {
            (_, Value::Null) => {}
            (Some(name), value) => {
                let cell = cell(name, value)?;
                if !cell.is_empty() {
                    draft.cells.insert(name, cell);
                }
            }
            (None, Value::String(text)) => {
                // As a cell of CSV.
                let text = trimmed(&text);
                if !text.is_empty() {
                    add_other(&mut draft, key, text.into());
                }
            }
            (None, value) => add_other(&mut draft, key, value),
        }
    }
    Ok(draft)
}

/// Adds the value of another column. A column without a name is not kept.
fn add_other(draft: &mut DraftRow, key: String, value: Value) {
    if key.trim().is_empty() {
        draft.unnamed += 1;
    } else {
        draft.meta.insert(key, value);
    }
}

/// Parses an object. If it is not JSON, tries again with `NaN` as no value.
fn parsed(text: &str) -> serde_json::Result<JsonEntries> {
    serde_json::from_str(text).or_else(|error| match nan_as_null(text) {
        Some(text) => serde_json::from_str(&text),
        None => Err(error),
    })
}

/// The keys and values of a JSON object in their order. Unlike a map, it keeps keys that are given twice.
struct JsonEntries(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for JsonEntries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EntriesVisitor)
    }
}

/// Collects the entries of an object.
struct EntriesVisitor;

impl<'de> Visitor<'de> for EntriesVisitor {
    type Value = JsonEntries;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<JsonEntries, A::Error> {
        let mut entries = Vec::new();
        while let Some((key, UniqueKeys(value))) = map.next_entry()? {
            entries.push((key, value));
        }
        Ok(JsonEntries(entries))
    }
}

/// Returns a cell's value as text. Numbers are accepted, because ids are often numbers.
fn cell(name: &str, value: Value) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(trimmed(&text).to_owned()),
        Value::Number(number) => {
            number_text(&number).map_err(|error| format!("{name:?}: {error}; {AS_TEXT}"))
        }
        Value::Bool(flag) => Ok(flag.to_string()),
        Value::Null | Value::Array(_) | Value::Object(_) => {
            Err(format!("{name:?} is {value}, not text"))
        }
    }
}

/// Formats a parser error of a row that begins on a line. Its place is a column, or a line if the row has several.
fn wrong_json(error: &serde_json::Error, first: usize, text: &str) -> String {
    let message = error.to_string();
    let reason = message.rsplit_once(" at line ");
    let reason = reason.map_or(&*message, |(reason, _)| reason);
    if reason.ends_with(KEY_TWICE) {
        return reason.to_owned();
    }
    let reason = value_error_text(reason);
    // The parser's column is that of one of the lines.
    if !text.contains('\n')
        && let Some(number) = unknown_number(text, error.column())
    {
        return format!("{number} is not a number of JSON; write null or leave it out");
    }
    let place = place_in_row(error, first, text.as_bytes());
    format!("not a JSON object, {place}: {reason}")
}
