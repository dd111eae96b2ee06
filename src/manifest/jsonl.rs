//! JSON Lines lists: an object a line.

use serde_json::{Map, Value};

use super::draft::{Draft, Rows};
use super::{COLUMNS, Ids, ManifestError, ManifestRow, Problem, as_utf8};

/// Parses a JSON Lines list. Keys have the names of the CSV columns; `null` is the same as no key; blank lines are
/// left out.
///
/// # Errors
/// All that is wrong, by line.
pub fn parse_jsonl(bytes: &[u8]) -> Result<Vec<ManifestRow>, ManifestError> {
    let mut rows = Vec::new();
    read_jsonl(bytes, &mut |row| rows.push(row))?;
    Ok(rows)
}

/// The same for lists that are too long to be held: each row goes to `each` as it is read, also where a later one is
/// refused.
///
/// # Errors
/// All that is wrong, by line.
pub fn read_jsonl(bytes: &[u8], each: &mut dyn FnMut(ManifestRow)) -> Result<Ids, ManifestError> {
    let text = as_utf8(bytes).map_err(|error| Problem::whole(error.to_string()))?;
    let bytes = &*text;
    let mut rows = Rows::new(each);
    for (line, content) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let content = content.trim_ascii();
        if content.is_empty() {
            continue;
        }
        match draft(line, content) {
            Ok(draft) => rows.push(draft),
            Err(reason) => rows.problems.push(Problem::line(line, reason)),
        }
    }
    rows.end()
}

fn draft(line: usize, content: &[u8]) -> Result<Draft, String> {
    let text = std::str::from_utf8(content)
        .map_err(|error| format!("byte {} is not UTF-8", error.valid_up_to() + 1))?;
    let object: Map<String, Value> =
        serde_json::from_str(text).map_err(|error| not_an_object(&error))?;
    let mut draft = Draft {
        line,
        ..Draft::default()
    };
    for (key, value) in object {
        let known = COLUMNS
            .into_iter()
            .find(|name| name.eq_ignore_ascii_case(key.trim()));
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

/// A known key's value as text. A number is taken by its digits, as ids are often numbers.
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

/// The parser's words, its own line number left out since each line is parsed alone.
fn not_an_object(error: &serde_json::Error) -> String {
    let words = error.to_string();
    let reason = words.split(" at line ").next().unwrap_or(&words);
    format!("not a JSON object, column {}: {reason}", error.column())
}

#[cfg(test)]
mod tests {
    use super::super::{ManifestError, ManifestRow};

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
    fn every_problem_is_named_by_its_line() {
        let text = "{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"id\":\"b\",\"mesh\":\"m\"}\n\
            [1]\n\
            {\"id\":\n\
            {\"id\":[1],\"mesh\":\"m\",\"print\":\"p\"}\n\
            {\"mesh\":\"m\",\"print\":\"p\"}\n";
        let refusal = parse(text).expect_err("refused").to_string();
        let lines: Vec<_> = refusal.lines().collect();
        assert_eq!(lines[0], "line 2: id \"a\" was given in line 1 already");
        assert_eq!(lines[1], "line 3: no print is given");
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
