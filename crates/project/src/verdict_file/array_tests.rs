//! Tests of verdict files that are JSON arrays.

use super::{RefusedLine, VerdictList, VerdictRow};

fn parse_json(bytes: &[u8]) -> Result<Vec<VerdictRow>, RefusedLine> {
    VerdictList::new(bytes.to_vec(), true)?.rows().collect()
}

#[test]
fn an_array_has_the_rows_of_json_lines() {
    let one = r#"{"pair":"a","verdict":"pass","reviewer":"lan","note":"[x], {"}"#;
    let other = r#"{"pair":2,"verdict":"fail","reviewer":"minh","at":1795234203000}"#;
    let undone = r#"{"pair":"c","verdict":"pass","reviewer":"lan","undone_at":1795234203000}"#;
    let lines = parse_json(format!("{one}\n{undone}\n{other}\n").as_bytes()).expect("valid");
    let array = format!(
        "\u{feff}\n[{one},{undone},\n {}]\n",
        other.replace(',', ",\n")
    );
    let rows = parse_json(array.as_bytes()).expect("valid");
    let listed = |rows: &[VerdictRow]| {
        let rows = rows.iter();
        rows.map(|row| format!("{:?}", row.listed))
            .collect::<Vec<_>>()
    };
    assert_eq!(listed(&rows), listed(&lines));
    assert_eq!(rows.iter().map(|row| row.line).collect::<Vec<_>>(), [2, 3]);
    for (list, expected) in [
        ("[{}]", "line 1: row 1: pair is missing"),
        (
            "[\n1]",
            "line 2: row 1: each row is a JSON object with pair, verdict and reviewer",
        ),
        (
            &format!("[{one}\n{other}]"),
            "line 2: a comma is missing before this row",
        ),
        (
            &format!("[{one}"),
            "line 1: the list ends early; save or copy it again",
        ),
        (
            &format!("[{one},\n{{\n\"pair\" 1}}]"),
            "line 2: row 2: not a JSON object, line 3: expected `:`",
        ),
    ] {
        let refused = parse_json(list.as_bytes()).expect_err(list);
        assert_eq!(refused.to_string(), expected, "{list}");
    }
}

#[test]
fn words_of_an_array_may_be_capitals() {
    let plain = r#"[{"pair":"a","verdict":"fail","reviewer":"lan","metric":"relief","reason":"strokes_lost"}]"#;
    let capitals = r#"[{"pair":"a","verdict":"FAIL","reviewer":"lan","metric":"Relief","reason":"Strokes Lost"}]"#;
    let rows = parse_json(plain.as_bytes()).expect("valid");
    assert_eq!(parse_json(capitals.as_bytes()).expect("valid"), rows);
    let misspelt = plain.replace("relief", "Releif");
    assert_eq!(
        parse_json(misspelt.as_bytes())
            .expect_err("misspelt")
            .to_string(),
        "line 1: row 1: \"Releif\" is not a metric (nl_ssim, density, ensemble, relief); did you mean \"relief\"?"
    );
}
