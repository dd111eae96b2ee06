//! Sanitizing of text from files before it is printed.

/// Returns a text as one line that is safe for terminals. Line breaks and tabs become blanks. Other control and
/// invisible characters become escapes. If more than `most` characters result, the rest is replaced by three dots.
///
/// ```
/// use mocban::domain::sanitize;
///
/// assert_eq!(sanitize("a\tb\u{1b}[2J", 40), "a b\\u{1b}[2J");
/// assert_eq!(sanitize("abcdef", 3), "abc...");
/// ```
pub fn sanitize(text: &str, most: usize) -> String {
    let (mut shown, mut count) = (String::new(), 0);
    for c in text.chars() {
        let piece = match c {
            '"' | '\'' | '\\' => c.to_string(),
            '\n' | '\r' | '\t' => " ".to_owned(),
            // Escaped after another character, so that a combining accent is kept.
            _ => format!(".{c}").escape_debug().skip(1).collect(),
        };
        count += piece.chars().count();
        if count > most {
            shown.push_str("...");
            break;
        }
        shown.push_str(&piece);
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::sanitize;

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
}
