//! Numbers in messages as Vietnamese pages write them.

use crate::digit_groups::grouped;

/// Returns a number, perhaps with a unit behind a blank, with groups of digits and a decimal comma, such as `1 234,5 mm` for
/// `1234.5 mm`. `None` if the text does not begin with a number.
pub(super) fn number_text(text: &str) -> Option<String> {
    if let Some(rest) = text.strip_prefix("more than ") {
        return number_text(rest).map(|number| format!("hơn {number}"));
    }
    let (number, unit) = text.split_at(text.find(' ').unwrap_or(text.len()));
    let (sign, digits) = number.split_at(usize::from(number.starts_with('-')));
    let (whole, decimals) = match digits.split_once('.') {
        Some((whole, decimals)) => (whole, format!(",{}", plain_digits(decimals)?)),
        None => (digits, String::new()),
    };
    let whole = grouped(plain_digits(whole)?.parse().ok()?);
    let unit = if unit == " times" { " lần" } else { unit };
    Some([sign, &whole, &decimals, unit].concat())
}

/// Returns digits, or `None` if there is something else or nothing.
fn plain_digits(text: &str) -> Option<&str> {
    let are_digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    are_digits.then_some(text)
}

#[cfg(test)]
mod tests {
    use super::number_text;

    #[test]
    fn digits_are_grouped_and_decimals_have_a_comma() {
        for (text, expected) in [
            ("7", Some("7")),
            ("1234", Some("1\u{202f}234")),
            ("1048615", Some("1\u{202f}048\u{202f}615")),
            ("0.20", Some("0,20")),
            ("-12345.6", Some("-12\u{202f}345,6")),
            ("1.2 GB", Some("1,2 GB")),
            ("2.34 times", Some("2,34 lần")),
            ("more than 100 times", Some("hơn 100 lần")),
            ("NaN", None),
            ("1e5", None),
            ("1.", None),
            (".5", None),
            ("-", None),
            ("", None),
            ("1.ply", None),
        ] {
            assert_eq!(number_text(text).as_deref(), expected, "{text:?}");
        }
    }
}
