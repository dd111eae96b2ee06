//! Values as cells of CSV files.

use serde_json::Value;

/// Returns a value as a cell: numbers with all digits, lists and objects as JSON.
pub(super) fn cell(value: &Value, has_decimal_commas: bool) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text_cell(text),
        // Display of f64 has no exponent, unlike JSON.
        Value::Number(number) if number.is_f64() => {
            let text = number.as_f64().map(|number| number.to_string());
            let text = text.unwrap_or_default();
            if has_decimal_commas {
                text.replace('.', ",")
            } else {
                text
            }
        }
        other => other.to_string(),
    }
}

/// Returns a value of the user's list as a cell. Numbers of lists are texts, and get decimal commas like other numbers.
pub(super) fn list_cell(value: &Value, has_decimal_commas: bool) -> String {
    match value {
        Value::String(text) if has_decimal_commas && is_decimal(text) => text.replace('.', ","),
        value => cell(value, has_decimal_commas),
    }
}

/// Returns whether a text is a number with a decimal point and without an exponent.
fn is_decimal(text: &str) -> bool {
    let are_digits =
        |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let parts = text.strip_prefix('-').unwrap_or(text).split_once('.');
    parts.is_some_and(|(whole, fraction)| are_digits(whole) && are_digits(fraction))
}

/// First characters of a text that a spreadsheet may run as a formula, as OWASP lists them ("CSV Injection"), with their
/// full-width forms.
const FORMULA_STARTS: [char; 11] = ['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'];

/// Returns a text as a cell. A leading `'` keeps spreadsheets from running it as a formula.
pub(super) fn text_cell(text: &str) -> String {
    let is_formula = text.starts_with(FORMULA_STARTS);
    if is_formula { "'" } else { "" }.to_owned() + text
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::list_cell;

    fn cell(value: &serde_json::Value) -> String {
        super::cell(value, false)
    }

    #[test]
    fn no_text_is_a_formula_and_numbers_stay_numbers() {
        for text in [
            "=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1", "＝1", "＋1", "－1", "＠1",
        ] {
            assert_eq!(cell(&json!(text)), format!("'{text}"));
        }
        for text in ["", "1-1", "a=1", "'=1", "天"] {
            assert_eq!(cell(&json!(text)), text);
        }
        assert_eq!(cell(&json!(-1.5e-7)), "-0.00000015");
        assert_eq!(cell(&json!(-3)), "-3");
    }

    #[test]
    fn numbers_in_columns_of_the_user_have_decimal_commas_too() {
        for (value, expected) in [
            (json!("1.5"), "1,5"),
            (json!("-0.25"), "-0,25"),
            (json!(1.5), "1,5"),
        ] {
            assert_eq!(list_cell(&value, true), expected);
        }
        for text in ["", "15", "1.5.2", "1,5", ".5", "1.", "1.5 mm", "1e.5"] {
            assert_eq!(list_cell(&json!(text), true), text);
        }
        assert_eq!(list_cell(&json!("1.5"), false), "1.5");
    }
}
