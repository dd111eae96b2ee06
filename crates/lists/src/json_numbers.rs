//! Numbers of JSON as text, and numbers that Python writes into JSON although it has none of them.

use serde_json::Number;

/// Returns the number that JSON does not know at a column of a line, where the parser stopped.
pub fn unknown_number(line: &str, column: usize) -> Option<&'static str> {
    let at = column.saturating_sub(1);
    let starts = |number: &&str| {
        let rest = |at: usize| line.as_bytes().get(at..).unwrap_or_default();
        let places = [at, at.saturating_sub(1)];
        places
            .into_iter()
            .any(|at| rest(at).starts_with(number.as_bytes()))
    };
    ["NaN", "-Infinity", "Infinity"].into_iter().find(starts)
}

/// Returns a number as the text of an id: whole numbers without decimals, as those of a column with gaps that Python
/// writes as `117.0`.
///
/// ```
/// use mocban_lists::json_numbers::number_text;
///
/// let text = |json: &str| number_text(&serde_json::from_str(json).expect("a number"));
/// assert_eq!(["117.0", "1e3", "2.5", "117"].map(text), ["117", "1000", "2.5", "117"]);
/// ```
pub fn number_text(number: &Number) -> String {
    match number.as_f64() {
        Some(whole) if number.is_f64() && whole.fract() == 0.0 && whole.abs() < MAX_EXACT => {
            (whole as i64).to_string()
        }
        _ => number.to_string(),
    }
}

/// Whole numbers below this one are exact as floating-point numbers.
pub(crate) const MAX_EXACT: f64 = 9e15;

/// Replaces each `NaN` outside texts by `null`. Returns `None` if there is none.
pub fn nan_as_null(json: &str) -> Option<String> {
    const NAN: &str = "NaN";
    let mut replaced = String::new();
    let mut copied = 0;
    let (mut in_text, mut is_escaped) = (false, false);
    for (at, byte) in json.bytes().enumerate() {
        if in_text {
            in_text = byte != b'"' || is_escaped;
            is_escaped = byte == b'\\' && !is_escaped;
        } else if byte == b'"' {
            in_text = true;
        } else if json.as_bytes()[at..].starts_with(NAN.as_bytes()) {
            replaced += &json[copied..at];
            replaced += "null";
            copied = at + NAN.len();
        }
    }
    (copied > 0).then(|| replaced + &json[copied..])
}
