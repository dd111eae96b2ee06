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
    ] {
        let rows = parse(text.as_bytes(), false).expect(text);
        assert_eq!(rows, plain, "{text}");
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
