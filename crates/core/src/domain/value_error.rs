//! Rewords the messages of `serde` about values of another type.

use super::spelling::quoted;

/// Rewords a message of `serde` about a value: `"many" is not a whole number from 0`. Returns other messages unchanged.
pub fn value_error_text(message: &str) -> String {
    let translated = wrong_type(message)
        .or_else(|| unknown_name(message))
        .or_else(|| {
            let field = message.strip_prefix("missing field ")?;
            Some(format!("{} is missing", field.replace('`', "")))
        });
    translated.unwrap_or_else(|| message.to_owned())
}

/// Translates `invalid type: string "many", expected usize`.
fn wrong_type(message: &str) -> Option<String> {
    let rest = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "))?;
    // The value may have the same word.
    let (found, expected) = rest.rsplit_once(", expected ")?;
    let found = match found {
        "sequence" => "a list",
        "map" => "an object",
        "null" | "unit value" | "Option value" => "null",
        value => value
            .strip_prefix("string ")
            .or_else(|| value.split('`').nth(1))
            .unwrap_or(value),
    };
    let needed = match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a string" | "a borrowed string" => "text",
        "a map" => "an object",
        "a sequence" => "a list",
        other => other,
    };
    Some(format!(
        "{found} is not {needed}{}",
        point_hint(found, needed)
    ))
}

/// Suggests a point if a number was written with a decimal comma.
fn point_hint(found: &str, needed: &str) -> String {
    let with_point = found.trim_matches('"').replacen(',', ".", 1);
    let is_number =
        needed == "a number" && found.contains(',') && with_point.parse::<f64>().is_ok();
    if is_number {
        format!("; write {with_point}")
    } else {
        String::new()
    }
}

/// Translates ``unknown variant `x`, expected one of `a`, `b` ``.
fn unknown_name(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown variant `")?;
    let (found, expected) = rest.rsplit_once("`, expected ")?;
    let names: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
    let found = quoted(found);
    Some(format!("{found} is not one of {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::value_error_text;

    #[test]
    fn messages_of_serde_are_told_in_own_words() {
        let text = |error: serde_json::Error| {
            let message = error.to_string();
            value_error_text(message.split(" at line ").next().unwrap_or_default())
        };
        let number = |json: &str| text(serde_json::from_str::<u64>(json).expect_err("refused"));
        assert_eq!(number("\"many\""), "\"many\" is not a whole number from 0");
        assert_eq!(number("-1"), "-1 is not a whole number from 0");
        assert_eq!(number("2.5"), "2.5 is not a whole number from 0");
        assert_eq!(number("null"), "null is not a whole number from 0");
        assert_eq!(number("[1]"), "a list is not a whole number from 0");
        assert_eq!(number("{}"), "an object is not a whole number from 0");
        let share = |json: &str| text(serde_json::from_str::<f64>(json).expect_err("refused"));
        assert_eq!(share("\"0,5\""), "\"0,5\" is not a number; write 0.5");
        assert_eq!(share("\"1,2,3\""), "\"1,2,3\" is not a number");
        assert_eq!(
            share("\", expected f32\""),
            "\", expected f32\" is not a number"
        );
        let flag = serde_json::from_str::<bool>("1").expect_err("refused");
        assert_eq!(text(flag), "1 is not true or false");
        let name = serde_json::from_str::<String>("5").expect_err("refused");
        assert_eq!(text(name), "5 is not text");
        for (message, told) in [
            (
                "unknown variant `foo`, expected `default` or `paper`",
                "\"foo\" is not one of default, paper",
            ),
            (
                "unknown variant `x`, expected one of `a`, `b`, `c`",
                "\"x\" is not one of a, b, c",
            ),
            ("missing field `pair`", "pair is missing"),
            ("trailing characters", "trailing characters"),
        ] {
            assert_eq!(value_error_text(message), told);
        }
    }
}
