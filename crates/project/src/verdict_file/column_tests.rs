//! Tests of columns of verdict files that no verdict has.

use super::{RefusedLine, VerdictList, VerdictRow};

fn parse(bytes: &[u8], is_json: bool) -> Result<Vec<VerdictRow>, RefusedLine> {
    VerdictList::new(bytes.to_vec(), is_json)?.rows().collect()
}

#[test]
fn empty_columns_without_a_heading_are_ignored_and_others_named_by_number() {
    let plain = parse(b"pair,verdict,reviewer\n1,pass,lan\n", false).expect("valid");
    for text in [
        "pair,verdict,reviewer,\n1,pass,lan,\n",
        "pair;verdict; ;reviewer;;\u{a0}\n1;pass;;lan; ;\n",
        "pair,verdict,reviewer\n1,pass,lan,, \n",
        "pair,verdict,reviewer,,\n1,pass,lan\n",
    ] {
        let rows = parse(text.as_bytes(), false).expect(text);
        assert_eq!(rows, plain, "{text}");
    }
    for (text, reason) in [
        ("1,pass,lan,,,x", "6 cells where the header has 4"),
        ("1,pass,lan", "3 cells where the header has 4"),
    ] {
        let text = format!("pair,verdict,reviewer,note\n{text}\n");
        let refused = parse(text.as_bytes(), false).expect_err(reason);
        assert_eq!(refused.to_string(), format!("line 2: {reason}"));
    }
    let text = "pair,verdict,reviewer,,\n1,pass,lan,,\n2,pass,lan,,x\n";
    let refused = parse(text.as_bytes(), false).expect_err("a value");
    assert_eq!(
        refused.to_string(),
        "line 3: column 5 has no heading, but a value here; give it a heading, or clear its cells"
    );
    let missing = parse(b"pair,verdict,,\n", false).expect_err("no reviewer");
    let missing = missing.to_string();
    assert!(
        missing.starts_with("line 1: column reviewer is missing; needed are"),
        "{missing}"
    );
}

#[test]
fn fields_of_json_without_a_name_are_reported_only_with_a_value() {
    let row = |value: &str| {
        let text = format!(r#"{{"pair":"1","verdict":"pass","reviewer":"lan","":{value}}}"#);
        let rows = parse(text.as_bytes(), true).expect("valid");
        rows[0].unread.clone()
    };
    for empty in ["null", "\"\"", "\" \""] {
        assert_eq!(row(empty), [""; 0], "{empty}");
    }
    assert_eq!(row("3"), [""]);
}

#[test]
fn errors_of_formulas_are_refused_with_their_line_and_column() {
    let good = "1,pass,lan,,\n";
    for (row, column) in [
        ("#REF!,pass,lan,,", "pair"),
        ("1,#N/A,lan,,", "verdict"),
        ("1,pass,#n/a,,", "reviewer"),
        ("1,pass,lan,#VALUE!,", "note"),
        ("1,pass,lan,,#NAME?", "at"),
    ] {
        let text = format!("pair,verdict,reviewer,note,at\n{good}{row}\n");
        let refused = parse(text.as_bytes(), false).expect_err(row).to_string();
        let start = format!("line 3: column {column} has the error #");
        assert!(refused.starts_with(&start), "{refused}");
    }
    let text = "pair,verdict,reviewer,note,at\n#REF!,pass,lan,#n/a,Err:502\n";
    let refused = parse(text.as_bytes(), false).expect_err("errors");
    let all = "line 2: columns pair (#REF!), note (#N/A), at (Err:502) have errors of formulas; ";
    assert!(refused.to_string().starts_with(all), "{refused}");
    let json = r##"{"pair":"#REF!","verdict":"pass","reviewer":"#N/A"}"##;
    let refused = parse(json.as_bytes(), true).expect_err("errors");
    let all = "line 1: columns pair (#REF!), reviewer (#N/A) have errors of formulas; ";
    assert!(refused.to_string().starts_with(all), "{refused}");
    let json = r##"{"pair":"1","verdict":"pass","reviewer":"#N/A"}"##;
    let refused = parse(json.as_bytes(), true).expect_err("an error");
    let refused = refused.to_string();
    let start = "line 1: column reviewer has the error #N/A of a formula";
    assert!(refused.starts_with(start), "{refused}");
    // The app takes any note, and its log is read back.
    let json = r##"{"pair":"1","verdict":"pass","reviewer":"lan","note":"#N/A"}"##;
    parse(json.as_bytes(), true).expect("a note");
}
