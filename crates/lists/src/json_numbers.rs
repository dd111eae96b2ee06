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
/// let text = |json: &str| number_text(&serde_json::from_str(json).expect("a number")).ok();
/// let expected = ["117", "1000", "2.5", "117"].map(|text| Some(text.to_owned()));
/// assert_eq!(["117.0", "1e3", "2.5", "117"].map(text), expected);
/// assert_eq!(text("18446744073709551615").as_deref(), Some("18446744073709551615"));
/// assert_eq!(text("9007199254740993.0"), None);
/// ```
///
/// # Errors
/// Returns an error if the number is so large that its last digits may be others than those written.
pub fn number_text(number: &Number) -> Result<String, InexactNumber> {
    match number.as_f64().filter(|_| number.is_f64()) {
        Some(float) if float.abs() >= MAX_EXACT => Err(InexactNumber::new(&number.to_string())),
        Some(whole) if whole.fract() == 0.0 => Ok((whole as i64).to_string()),
        _ => Ok(number.to_string()),
    }
}

/// A number whose last digits may be others than those written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the number {0} is too large to be exact")]
pub struct InexactNumber(String);

impl InexactNumber {
    /// Takes the text of the number.
    pub(crate) fn new(text: &str) -> Self {
        Self(text.to_owned())
    }
}

/// What to do about a number in JSON that is too large.
pub const AS_TEXT: &str = "write it as text, in quotation marks";

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
