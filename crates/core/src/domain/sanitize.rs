//! Sanitizing of text from files, names and messages before it is shown.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde_json::Value;

/// Returns whether a terminal or a browser acts on a character instead of showing it: control characters, characters
/// that change the direction of writing, and characters without width.
///
/// Combining marks, variation selectors (which choose among forms of one Han character), private-use characters and
/// characters of newer Unicode versions are shown.
pub const fn is_hidden(c: char) -> bool {
    matches!(
        c,
        '\0'..='\u{1f}'
            | '\u{7f}'..='\u{9f}'
            | '\u{ad}'
            | '\u{34f}'
            | '\u{61c}'
            | '\u{115f}'
            | '\u{1160}'
            | '\u{17b4}'
            | '\u{17b5}'
            | '\u{180b}'..='\u{180f}'
            | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{3164}'
            | '\u{feff}'
            | '\u{ffa0}'
            | '\u{fff0}'..='\u{fffb}'
            | '\u{13430}'..='\u{1345f}'
            | '\u{1bca0}'..='\u{1bca3}'
            | '\u{1d173}'..='\u{1d17a}'
            | '\u{e0000}'..='\u{e00ff}'
            | '\u{e01f0}'..='\u{e0fff}'
    )
}

/// Returns a text with escapes such as `\u{1b}` for hidden characters. Line breaks and tabs are kept.
///
/// ```
/// use mocban_core::domain::visible;
///
/// assert_eq!(visible("a\u{202e}b\n\u{1b}[2J"), "a\\u{202e}b\n\\u{1b}[2J");
/// ```
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match c {
            '\n' | '\t' => shown.push(c),
            '\r' if rest.peek() == Some(&'\n') => shown.push(c),
            _ => push_visible(&mut shown, c),
        }
    }
    Cow::Owned(shown)
}

/// Returns a text as one line: line breaks and tabs become blanks, other hidden characters become escapes.
///
/// ```
/// use mocban_core::domain::one_line;
///
/// assert_eq!(one_line("a\tb\nc\u{7}"), "a b c\\u{7}");
/// ```
pub fn one_line(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    text.chars().for_each(|c| push_in_line(&mut shown, c));
    Cow::Owned(shown)
}

/// Returns a value of metadata as text: a text without quotation marks, another value as JSON.
///
/// ```
/// use mocban_core::domain::value_text;
///
/// assert_eq!(value_text(&serde_json::json!("R.12")), "R.12");
/// assert_eq!(value_text(&serde_json::json!([1872])), "[1872]");
/// ```
pub fn value_text(value: &Value) -> Cow<'_, str> {
    let text = value.as_str().map(Cow::Borrowed);
    text.unwrap_or_else(|| Cow::Owned(value.to_string()))
}

/// Returns a text as one line, as [`one_line`] does. A result of more than `most` characters is cut, and three dots are
/// added.
///
/// ```
/// use mocban_core::domain::sanitize;
///
/// assert_eq!(sanitize("a\tb\u{1b}[2J", 40), "a b\\u{1b}[2J");
/// assert_eq!(sanitize("abcdef", 3), "abc...");
/// ```
pub fn sanitize(text: &str, most: usize) -> String {
    let (mut shown, mut count) = (String::new(), 0);
    for c in text.chars() {
        let mut piece = String::new();
        push_in_line(&mut piece, c);
        count += piece.chars().count();
        if count > most {
            shown.push_str("...");
            break;
        }
        shown.push_str(&piece);
    }
    shown
}

/// Returns a JSON text with the same values, in which hidden characters are written as JSON escapes such as `\u202e`.
/// Control characters up to U+001F are kept: in valid JSON they are only white space between tokens.
///
/// ```
/// use mocban_core::domain::visible_json;
///
/// assert_eq!(visible_json("[\n\"a\u{202e}\"]"), "[\n\"a\\u202e\"]");
/// ```
pub fn visible_json(text: &str) -> Cow<'_, str> {
    let is_escaped = |c: char| is_hidden(c) && c > '\u{1f}';
    if !text.contains(is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_escaped(c) {
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Formatting into memory does not fail.
                let _ = write!(shown, "\\u{unit:04x}");
            }
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

fn push_in_line(shown: &mut String, c: char) {
    match c {
        '\n' | '\r' | '\t' => shown.push(' '),
        _ => push_visible(shown, c),
    }
}

fn push_visible(shown: &mut String, c: char) {
    match c {
        '\0' => shown.push_str("\\0"),
        _ if is_hidden(c) => shown.extend(c.escape_unicode()),
        _ => shown.push(c),
    }
}

/// Joins names with commas. Names after the first `max` are only counted.
pub fn first_names(names: &[String], max: usize) -> String {
    let text = names[..names.len().min(max)].join(", ");
    match names.len().saturating_sub(max) {
        0 => text,
        more => format!("{text} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::{one_line, sanitize, visible, visible_json};

    #[test]
    fn text_becomes_one_short_line_without_control_characters() {
        assert_eq!(
            sanitize("rows of Tr\u{1ea7}n \"\u{660e}\"", 40),
            "rows of Tr\u{1ea7}n \"\u{660e}\""
        );
        assert_eq!(
            sanitize("a\nb\x1b[2J\u{202e}\0", 40),
            "a b\\u{1b}[2J\\u{202e}\\0"
        );
        assert_eq!(sanitize("Tra\u{302}\u{300}n", 40), "Tra\u{302}\u{300}n");
        assert_eq!(sanitize("abc", 3), "abc");
        assert_eq!(sanitize("abcd", 3), "abc...");
        assert_eq!(sanitize("a\0\0\0", 5), "a\\0\\0...");
    }

    #[test]
    fn vietnamese_and_han_nom_text_is_unchanged() {
        for text in [
            "Tra\u{302}\u{300}n",
            "\u{5b57}\u{5583}\u{3000}",
            "\u{20000}\u{2b740}\u{31350}\u{323b0}",
            "\u{e000}\u{f0000}",
            "\u{8fbb}\u{e0100}",
            "a \"b\" 'c' \\d",
        ] {
            assert_eq!(visible(text), text);
            assert_eq!(one_line(text), text);
            assert_eq!(sanitize(text, 40), text);
            assert_eq!(visible_json(text), text);
        }
    }

    #[test]
    fn hidden_characters_become_visible() {
        for c in [
            '\u{7}',
            '\u{8}',
            '\u{1b}',
            '\u{7f}',
            '\u{9b}',
            '\u{200b}',
            '\u{200f}',
            '\u{202e}',
            '\u{2066}',
            '\u{2028}',
            '\u{feff}',
            '\u{3164}',
            '\u{e0041}',
        ] {
            let escaped = format!("a{}b", c.escape_unicode());
            assert_eq!(visible(&format!("a{c}b")), escaped);
            assert_eq!(one_line(&format!("a{c}b")), escaped);
        }
        assert_eq!(visible("a\r\nb\rc\td"), "a\r\nb\\u{d}c\td");
        assert_eq!(one_line("a\r\nb\rc\td"), "a  b c d");
    }

    #[test]
    fn json_keeps_its_values() {
        let value = "a\u{202e}\u{9b}\u{e0041}\u{1b}\n\u{20000}\"";
        let text = serde_json::to_string_pretty(&[value]).expect("JSON");
        let shown = visible_json(&text);
        assert!(shown.is_ascii() || shown.contains('\u{20000}'), "{shown}");
        assert_eq!(visible(&shown), shown);
        let read: Vec<String> = serde_json::from_str(&shown).expect("JSON");
        assert_eq!(read, [value]);
    }
}
