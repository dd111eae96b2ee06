//! JSON Lines lists: one object per line.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::draft::{DraftRow, MAX_ROW_BYTES, RowCollector};
use super::error::{ManifestError, of_list};
use super::row::{ManifestRow, RowIds, known_column};
use super::text::as_utf8;
use mocban_core::domain::{KEY_TWICE, UniqueKeys};

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
/// are passed even if other rows are invalid. Returns the ids of the rows.
///
/// # Errors
/// Returns an error if the list cannot be decoded, contains no pairs, or has an invalid row. The error names the lines
/// of invalid rows.
pub fn read_jsonl(
    bytes: &[u8],
    each: &mut dyn FnMut(ManifestRow),
) -> Result<RowIds, ManifestError> {
    let bytes = &*as_utf8(bytes).map_err(|error| of_list(&error.to_string()))?;
    let mut rows = RowCollector::new(each);
    for (line, content) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let content = content.trim_ascii();
        if content.is_empty() {
            continue;
        }
        let draft = if content.len() > MAX_ROW_BYTES {
            let len = content.len();
            Err(format!(
                "the row has {len} bytes, over the limit of {MAX_ROW_BYTES}"
            ))
        } else {
            draft(line, content).map(Some)
        };
        rows.push(line, draft);
    }
    rows.finish()
}

fn draft(line: usize, content: &[u8]) -> Result<DraftRow, String> {
    let text = std::str::from_utf8(content)
        .map_err(|error| format!("byte {} is not UTF-8", error.valid_up_to() + 1))?;
    let JsonEntries(object) = serde_json::from_str(text).map_err(|error| wrong_json(&error))?;
    let mut draft = DraftRow::new(line);
    let mut keys = BTreeSet::new();
    for (key, value) in object {
        let known = known_column(key.trim());
        if !keys.insert(known.map_or_else(|| key.clone(), ToOwned::to_owned)) {
            return Err(format!("the key {key:?} {KEY_TWICE}"));
        }
        match (known, value) {
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
        Value::String(text) => Ok(text.trim().to_owned()),
        Value::Number(number) => Ok(number.to_string()),
        Value::Bool(flag) => Ok(flag.to_string()),
        Value::Null | Value::Array(_) | Value::Object(_) => {
            Err(format!("{name:?} is {value}, not text"))
        }
    }
}

/// Formats a parser error without its line number. The number is always 1, because each line is parsed separately.
fn wrong_json(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let reason = message.rsplit_once(" at line ");
    let reason = reason.map_or(&*message, |(reason, _)| reason);
    if reason.ends_with(KEY_TWICE) {
        return reason.to_owned();
    }
    format!("not a JSON object, column {}: {reason}", error.column())
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
