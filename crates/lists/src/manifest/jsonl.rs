//! JSON Lines lists: one object per line.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::draft::{DraftRow, MAX_ROW_BYTES, RowCollector};
use super::error::{ManifestError, at_line, of_list};
use super::json_array::{ArrayCursor, is_array, place_in_row};
use super::row::{COLUMNS, ManifestRow, ReadRows};
use super::text::{as_utf8, trimmed};
use crate::columns::HeaderColumns;
use crate::json_numbers::{nan_as_null, unknown_number};
use mocban_core::domain::{KEY_TWICE, UniqueKeys, sanitize, value_error_text};

/// Parses a JSON Lines list. Keys are the names of the CSV columns; `null` counts as no value. Blank lines are ignored.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no pairs, or has an invalid row. The error names the lines
/// of invalid rows.
pub fn parse_jsonl(bytes: &[u8]) -> Result<Vec<ManifestRow>, ManifestError> {
    let mut rows = Vec::new();
    read_jsonl(bytes, &mut |row| rows.push(row))?;
    Ok(rows)
}

/// Parses a list like [`parse_jsonl`], but passes each row to `each` instead of keeping all rows in memory. Valid rows
/// are passed even if other rows are invalid. Returns the ids of the rows, and which keys have other names. The list may
/// also be a JSON array of objects, and `NaN`, which Python writes for missing values, counts as no value.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no pairs, or has an invalid row. The error names the lines
/// of invalid rows.
pub fn read_jsonl(
    bytes: &[u8],
    each: &mut dyn FnMut(ManifestRow),
) -> Result<ReadRows, ManifestError> {
    let bytes = &*as_utf8(bytes).map_err(|error| of_list(&error.to_string()))?;
    let mut rows = RowCollector::new(each);
    let mut keys = RowKeys::default();
    let mut push = |line, content: &[u8]| {
        let draft = if content.len() > MAX_ROW_BYTES {
            let len = content.len();
            Err(format!(
                "the row has {len} bytes, over the limit of {MAX_ROW_BYTES}"
            ))
        } else {
            draft(line, content, &mut keys).map(Some)
        };
        rows.add_renamed(std::mem::take(&mut keys.columns.renamed));
        rows.push(line, draft);
    };
    if is_array(bytes) {
        let mut cursor = ArrayCursor::default();
        while let Some(next) = cursor.next_value(bytes) {
            match next {
                Ok((line, place)) => push(line, &bytes[place]),
                Err(refused) => {
                    rows.add_problem(at_line(refused.line, refused.reason));
                    break;
                }
            }
        }
        return rows.finish();
    }
    for (line, content) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let content = content.trim_ascii();
        if !content.is_empty() {
            push(line, content);
        }
    }
    rows.finish()
}

/// The keys of the row before, and what they are: most rows of a list have the same keys.
#[derive(Default)]
struct RowKeys {
    keys: Vec<String>,
    columns: HeaderColumns,
}

impl RowKeys {
    /// Finds out what the keys of a row are.
    fn update(&mut self, object: &[(String, Value)]) -> Result<(), String> {
        let keys = object.iter().map(|(key, _)| key);
        if keys.clone().eq(&self.keys) {
            return Ok(());
        }
        let twice = |k: usize| format!("the key {:?} {KEY_TWICE}", object[k].0);
        let names: Vec<&str> = keys.clone().map(|key| key.trim()).collect();
        let found = COLUMNS
            .assign(&names)
            .map_err(|same| twice(same.second - 1))?;
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

/// Longest name of a key in a message, in characters.
const MAX_KEY_CHARS: usize = 60;

fn draft(line: usize, content: &[u8], keys: &mut RowKeys) -> Result<DraftRow, String> {
    let text = std::str::from_utf8(content)
        .map_err(|error| format!("byte {} is not UTF-8", error.valid_up_to() + 1))?;
    let JsonEntries(object) = parsed(text).map_err(|error| wrong_json(&error, line, text))?;
    keys.update(&object)?;
    if let [(key, Value::Array(_))] = object.as_slice()
        && keys.columns.columns == [None]
    {
        return Err(format!(
            "the rows are in the list {:?} of an object; save this list alone",
            sanitize(key, MAX_KEY_CHARS)
        ));
    }
    let mut draft = DraftRow::new(line);
    for ((key, value), known) in object.into_iter().zip(&keys.columns.columns) {
        match (*known, value) {
            (_, Value::Null) => {}
            (Some(name), value) => {
                draft.cells.insert(name, cell(name, value)?);
            }
            (None, value) => {
                draft.meta.insert(key, value);
            }
        }
    }
    Ok(draft)
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
        Value::Number(number) => Ok(number.to_string()),
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

#[cfg(test)]
mod tests {
    use super::{ManifestError, ManifestRow};

    fn parse(text: &str) -> Result<Vec<ManifestRow>, ManifestError> {
        super::parse_jsonl(text.as_bytes())
    }

    #[test]
    fn rows_equal_those_of_the_same_csv() {
        let json = parse(
            "{\"id\":\"a\",\"mesh\":\"m.stl\",\"print\":\"p.png\",\"unit\":\"cm\",\"scanned_face_down\":true,\"folio\":\"3\"}\n\
             \n{\"id\":17,\"mesh\":\"n\",\"print\":\"q\",\"block\":null}",
        )
        .expect("parses");
        let csv = super::super::parse_csv(
            b"id,mesh,print,unit,scanned_face_down,folio\na,m.stl,p.png,cm,true,3\n\n17,n,q,,,\n",
        )
        .expect("parses");
        assert_eq!(json[0].meta, csv[0].meta);
        assert_eq!(
            (&json[0].unit, &json[0].scanned_face_down, &json[1].name),
            (&csv[0].unit, &csv[0].scanned_face_down, &csv[1].name)
        );
        assert_eq!(json[1].line, 3);
    }

    #[test]
    fn an_array_gives_the_same_rows_as_lines() {
        let rows = [
            r#"{"id":"a","mesh":"m.stl","print":"p.png","note":"x, [y] {z}"}"#,
            r#"{"id":17,"mesh":"n","print":"q","block":null}"#,
        ];
        let lines = parse(&rows.join("\n")).expect("parses");
        for list in [
            format!("[{}]", rows.join(",\n")),
            format!(
                "\u{feff}\n[\n  {}\n]\n",
                rows.join(",\n  ").replace("\",\"", "\",\n    \"")
            ),
        ] {
            let array = parse(&list).expect("parses");
            for (a, b) in array.iter().zip(&lines) {
                assert_eq!((&a.name, &a.mesh, &a.meta), (&b.name, &b.mesh, &b.meta));
            }
            assert_eq!(array.len(), 2);
        }
        let refused = parse(
            "[\n{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"},\n{\"id\":\"b\",\n\"mesh\":}\n, 3]",
        );
        assert_eq!(
            refused.expect_err("refused").to_string(),
            "line 3: not a JSON object, line 4: expected value\nline 5: not a JSON object, column 1: 3 is not an object"
        );
        let short = parse("[{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"}").expect_err("refused");
        assert_eq!(
            short.to_string(),
            "line 1: the list ends early; save or copy it again"
        );
    }

    #[test]
    fn missing_values_of_python_are_no_values() {
        let list = r#"{"id":"a NaN","mesh":"m","print":"p","block":NaN,"note":"NaN","year": NaN ,"ids":[NaN]}"#;
        let rows = parse(list).expect("parses");
        assert_eq!((rows[0].name.as_str(), &rows[0].block), ("a NaN", &None));
        assert_eq!(rows[0].meta.len(), 2);
        assert_eq!(rows[0].meta["note"], "NaN");
        let refused = parse(r#"{"id":"a","mesh":"m","print":"p","year":-Infinity}"#);
        assert_eq!(
            refused.expect_err("refused").to_string(),
            "line 1: -Infinity is not a number of JSON; write null or leave it out"
        );
    }

    #[test]
    fn keys_may_be_vietnamese() {
        let rows =
            parse(r#"{"Mã số":"a","bản quét":"m","Bản in":"p","khối":"b"}"#).expect("parses");
        assert_eq!(rows[0].block.as_deref(), Some("b"));
        let twice = parse(r#"{"id":"a","mesh":"m","print":"p","khối":"b","Khoi":"c"}"#);
        assert_eq!(
            twice.expect_err("refused").to_string(),
            "line 1: the key \"Khoi\" is given twice"
        );
    }

    #[test]
    fn metadata_keeps_its_json_types() {
        let rows = parse(r#"{"id":"a","mesh":"m","print":"p","year":1872,"tags":["x"]}"#);
        let meta = &rows.expect("parses")[0].meta;
        assert_eq!(meta["year"], 1872);
        assert_eq!(meta["tags"][0], "x");
    }

    #[test]
    fn a_key_that_is_given_twice_is_refused_with_its_line() {
        let good = r#"{"id":"a","mesh":"m","print":"p"}"#;
        for (twice, key) in [
            (r#"{"id":"b","mesh":"m","print":"p","id":"c"}"#, "id"),
            (r#"{"id":"b","mesh":"m","print":"p","ID":"c"}"#, "ID"),
            (r#"{"id":"b","mesh":"m","mesh":null,"print":"p"}"#, "mesh"),
            (
                r#"{"id":"b","mesh":"m","print":"p","folio":1,"folio":1}"#,
                "folio",
            ),
            (
                r#"{"id":"b","mesh":"m","print":"p","folio":[{"a":1,"b":{"a":1},"a":2}]}"#,
                "a",
            ),
        ] {
            let refusal = parse(&format!("{good}\n{twice}\n")).expect_err("refused");
            let wanted = format!("line 2: the key \"{key}\" is given twice");
            assert_eq!(refusal.to_string(), wanted);
        }
    }

    #[test]
    fn a_long_row_is_refused_before_it_is_parsed() {
        let long = format!(
            r#"{{"id":"a","mesh":"m","print":"p","x":[0{}"#,
            ",0".repeat(1 << 19)
        );
        assert_eq!(
            parse(&long).expect_err("refused").to_string(),
            "line 1: the row has 1048615 bytes, over the limit of 1048576"
        );
    }

    #[test]
    fn every_problem_is_reported_with_its_line() {
        let text = "{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"id\":\"b\",\"mesh\":\"m\"}\n\
            [1]\n\
            {\"id\":\n\
            {\"id\":[1],\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"mesh\":\"m\",\"print\":\"p\"}\n";
        let refusal = parse(text).expect_err("refused").to_string();
        let lines: Vec<_> = refusal.lines().collect();
        assert_eq!(lines[0], "line 2: id \"a\" is already on line 1");
        assert_eq!(lines[1], "line 3: print is empty");
        assert!(
            lines[2].starts_with("line 4: not a JSON object, column "),
            "{}",
            lines[2]
        );
        assert!(
            lines[3].starts_with("line 5: not a JSON object, column "),
            "{}",
            lines[3]
        );
        assert_eq!(lines[4], "line 6: \"id\" is [1], not text");
        assert_eq!(lines[5], "line 7: the id is empty");
        assert_eq!(lines.len(), 6);
    }
}
