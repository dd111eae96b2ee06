//! JSON Lines lists: one object per line.

use super::draft::RowCollector;
use super::error::ManifestError;
use super::json_rows::json_rows;
use super::row::{COLUMNS, ManifestRow, ReadRows};

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
    let mut rows = RowCollector::new(each);
    let read = json_rows(bytes, COLUMNS, &mut |row| {
        rows.add_renamed(row.renamed);
        rows.add_unread(row.unread);
        rows.push(row.line, row.draft.map(Some));
    });
    if let Err(refused) = read {
        rows.add_problem(refused);
    }
    rows.finish()
}

#[cfg(test)]
mod tests {
    use super::{ManifestError, ManifestRow};

    fn parse(text: &str) -> Result<Vec<ManifestRow>, ManifestError> {
        super::parse_jsonl(text.as_bytes())
    }

    #[test]
    fn whole_numbers_with_decimals_are_ids_without() {
        for (id, expected) in [
            ("117.0", "117"),
            ("1e3", "1000"),
            ("117", "117"),
            ("-0.0", "0"),
            ("2.5", "2.5"),
        ] {
            let row = format!("{{\"id\":{id},\"mesh\":\"m\",\"print\":\"p\",\"block\":{id}}}");
            let rows = parse(&row).expect("parses");
            assert_eq!(rows[0].name.as_str(), expected);
            assert_eq!(rows[0].block.as_deref(), Some(expected));
        }
    }

    #[test]
    fn numbers_that_are_too_large_to_be_exact_are_refused_as_ids() {
        let row = |id: &str| format!("{{\"id\":{id},\"mesh\":\"m\",\"print\":\"p\"}}");
        for (id, shown) in [
            ("9007199254740993.0", "9007199254740992.0"),
            ("1e20", "1e+20"),
            ("-1e20", "-1e+20"),
        ] {
            assert_eq!(
                parse(&row(id)).expect_err(id).to_string(),
                format!(
                    "line 1: \"id\": the number {shown} is too large to be exact; write it as text, in quotation marks"
                )
            );
        }
        for id in [
            "9007199254740993",
            "18446744073709551615",
            "-9223372036854775808",
        ] {
            assert_eq!(parse(&row(id)).expect(id)[0].name.as_str(), id);
        }
        let block = "{\"id\":\"a\",\"mesh\":\"m\",\"print\":\"p\",\"block\":1e20,\"year\":1e20}";
        let refused = parse(block).expect_err("a block").to_string();
        assert!(
            refused.starts_with("line 1: \"block\": the number"),
            "{refused}"
        );
    }

    #[test]
    fn rows_equal_those_of_the_same_csv() {
        let json = parse(
            "{\"id\":\"a\",\"mesh\":\"m.stl\",\"print\":\"p.png\",\"unit\":\"cm\",\"scanned_face_down\":true,\"folio\":\" 3\"}\n\
             \n{\"id\":17,\"mesh\":\"n\",\"print\":\"q\",\"block\":null,\"folio\":\"\"}",
        )
        .expect("parses");
        let csv = super::super::parse_csv(
            b"id,mesh,print,unit,scanned_face_down,folio\na,m.stl,p.png,cm,true,3\n\n17,n,q,,,\n",
        )
        .expect("parses");
        assert_eq!(json[0].meta, csv[0].meta);
        assert_eq!(json[1].meta, csv[1].meta);
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
            "line 1: the keys \"khối\" and \"Khoi\" have the same name (upper and lower case, accents and blanks do not count); \
             leave one of them out"
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
