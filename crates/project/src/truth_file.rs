//! Parses a `truth.jsonl` file. If a line is invalid, the whole file is refused.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::files::{MAX_SHOWN, RefusedLine, fields_with_lines};
use mocban_core::domain::spelling::hint;
use mocban_core::domain::{PairName, UniqueKeys};
use mocban_lists::manifest::trimmed;
use mocban_results::ground_truth::TruthRecord;

/// Longest line in bytes. The values of a line take about ten times as much memory.
const MAX_LINE_BYTES: usize = 16 << 20;

/// The fields of a line, of which only the last may be missing.
const FIELDS: [&str; 6] = [
    "id",
    "print_from_mesh",
    "plane",
    "landmarks",
    "char_height_px",
    "tops_mask",
];
const REQUIRED: usize = 5;

/// One true alignment and its line number.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthRow {
    /// Number of the line, from 1.
    pub line: usize,
    /// The pair.
    pub name: PairName,
    /// The object as given, without blanks at the ends of the id.
    pub value: Value,
    /// Its mask of stroke tops, relative to the working directory.
    pub tops_mask: Option<PathBuf>,
}

/// Parses all lines. A `tops_mask` path in the file is relative to the file's directory.
///
/// # Errors
/// Returns an error for the first line that is not a true alignment or repeats a pair.
pub fn parse(file: &Path, text: &str) -> Result<Vec<TruthRow>, RefusedLine> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut lines: BTreeMap<PairName, usize> = BTreeMap::new();
    let mut rows = Vec::new();
    for (line, text) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        if text.trim().is_empty() {
            continue;
        }
        let refuse = |reason: String| RefusedLine::new(line, &reason);
        if text.len() > MAX_LINE_BYTES {
            let (bytes, limit) = (text.len(), MAX_LINE_BYTES);
            return Err(refuse(format!(
                "the line has {bytes} bytes; at most {limit} are read"
            )));
        }
        if !text.trim_start().starts_with('{') {
            let fields = FIELDS[..REQUIRED].join(", ");
            return Err(refuse(format!(
                "each line is a JSON object with {fields}; tables are not read"
            )));
        }
        let UniqueKeys(mut value) =
            serde_json::from_str(text).map_err(|error| refuse(format!("not JSON: {error}")))?;
        if let Some(Value::String(id)) = value.get_mut("id") {
            *id = trimmed(id).to_owned();
        }
        let record = TruthRecord::read(&value).map_err(|error| refuse(error.to_string()))?;
        if let Some(first) = lines.insert(record.id.clone(), line) {
            let name = record.id;
            return Err(refuse(format!("pair {name} is already on line {first}")));
        }
        rows.push(TruthRow {
            line,
            tops_mask: record.tops_mask.map(|mask| folder.join(mask)),
            name: record.id,
            value,
        });
    }
    Ok(rows)
}

/// Returns a warning about fields that are not read.
pub(crate) fn unread_fields(file: &Path, rows: &[TruthRow]) -> Option<String> {
    let mut first_lines = BTreeMap::new();
    for row in rows {
        let fields = row.value.as_object().into_iter().flat_map(|row| row.keys());
        for field in fields.filter(|field| !FIELDS.contains(&field.as_str())) {
            if first_lines.len() < MAX_SHOWN {
                first_lines.entry(field.clone()).or_insert(row.line);
            }
        }
    }
    let fields = fields_with_lines(&first_lines);
    (!first_lines.is_empty()).then(|| {
        let file = file.display();
        format!(
            "{file}: fields that no true alignment has are not read: {fields}; print_from_mesh gives angle and scale"
        )
    })
}

/// Refuses a row whose pair does not exist, and suggests one of the known pairs.
pub(crate) fn unknown_pair(row: &TruthRow, known: &[PairName]) -> RefusedLine {
    let hint = hint(row.name.as_str(), known.iter().map(PairName::as_str));
    RefusedLine::new(row.line, &format!("there is no pair {}{hint}", row.name))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{FIELDS, REQUIRED, RefusedLine, TruthRow, parse, unread_fields};

    const LINE: &str = r#"{"id":"a","print_from_mesh":[[1,0,0,0],[0,-1,0,0],[0,0,1,0]],"plane":{"n":[0,0,1],"d":0},"landmarks":[[0,0,0]],"char_height_px":10,"tops_mask":"tops/a.png"}"#;

    fn read(text: &str) -> Result<Vec<TruthRow>, String> {
        let file = Path::new("data/truth.jsonl");
        parse(file, text).map_err(|error| error.in_file(file, "nothing was imported").to_string())
    }

    #[test]
    fn quoted_text_is_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(301)] {
            let text = RefusedLine::new(1, &rude).to_string();
            assert!(!text.contains(&rude), "{text:?}");
        }
    }

    #[test]
    fn mask_path_is_relative_to_the_file() {
        let rows = read(&format!("{LINE}\n\n")).expect("valid");
        assert_eq!(rows.len(), 1);
        assert_eq!(
            rows[0].tops_mask.as_deref(),
            Some(Path::new("data/tops/a.png"))
        );
    }

    #[test]
    fn fields_that_are_not_read_are_named_with_their_first_lines() {
        let file = Path::new("truth.jsonl");
        let rows = read(LINE).expect("valid");
        assert_eq!(unread_fields(file, &rows), None);
        let fields = rows[0].value.as_object().expect("an object");
        assert!(fields.keys().all(|field| FIELDS.contains(&field.as_str())));
        let more = LINE.replace("\"id\":\"a\"", "\"id\":\"b\",\"scale\":2,\"angle\":3");
        let again = more.replace("\"b\"", "\"c\"");
        let rows = read(&format!("{LINE}\n{more}\n{again}\n")).expect("valid");
        assert_eq!(
            unread_fields(file, &rows).as_deref(),
            Some(
                "truth.jsonl: fields that no true alignment has are not read: angle (line 2), scale (line 2); \
                 print_from_mesh gives angle and scale"
            )
        );
    }

    #[test]
    fn a_table_and_a_line_without_a_required_field_are_refused() {
        let table = read("id,angle,scale\na,5,1\n").expect_err("a table");
        assert_eq!(
            table,
            "data/truth.jsonl: line 1: each line is a JSON object with id, print_from_mesh, plane, landmarks, \
             char_height_px; tables are not read; nothing was imported"
        );
        for field in &FIELDS[..REQUIRED] {
            let other = LINE.replace(&format!("\"{field}\""), "\"other\"");
            let refused = read(&other).expect_err(field);
            assert!(
                refused.contains(&format!("{field} is missing")),
                "{refused}"
            );
        }
    }

    #[test]
    fn an_id_may_end_in_blanks_but_is_on_one_line() {
        let with = |id: &str| read(&LINE.replace("\"a\"", id));
        let rows = with("\" a\\t\\n\"").expect("blanks at the ends");
        assert_eq!(rows[0].name.as_str(), "a");
        assert_eq!(rows[0].value["id"], "a");
        let refused = with("\"a\\nb\"").expect_err("two lines");
        assert!(
            refused.contains(
                "line 1: truth is not of the form of truth.jsonl: id \"a b\" has a line break"
            ),
            "{refused}"
        );
    }

    #[test]
    fn wrong_line_is_named_by_its_number() {
        let twice = read(&format!("{LINE}\n{LINE}\n")).expect_err("twice");
        assert_eq!(
            twice,
            "data/truth.jsonl: line 2: pair a is already on line 1; nothing was imported"
        );
        let key = LINE.replace("\"d\":0", "\"d\":0,\"d\":1");
        let key = read(&format!("{LINE}\n\n{key}")).expect_err("a key twice");
        assert!(
            key.contains("line 3: not JSON: the key \"d\" is given twice"),
            "{key}"
        );
        let broken = read("{\"id\":\n").expect_err("cut off");
        assert!(
            broken.starts_with("data/truth.jsonl: line 1: not JSON"),
            "{broken}"
        );
        let other = read("{\"id\":\"a\"}").expect_err("no truth");
        assert!(
            other.contains("line 1: truth is not of the form"),
            "{other}"
        );
    }
}
