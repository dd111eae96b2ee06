//! Words out of files, as they may stand in a message.

/// The beginning of a text on one line: what a screen would not show, or would obey, comes as an escape; what is
/// longer than `most` characters, escapes counted as they are shown, ends in three dots.
pub fn sanitize(text: &str, most: usize) -> String {
    let (mut shown, mut count) = (String::new(), 0);
    for c in text.chars() {
        let piece = match c {
            '"' | '\'' | '\\' => c.to_string(),
            '\n' | '\r' | '\t' => " ".to_owned(),
            // Behind another character, so that an accent over a letter stays one.
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
    fn what_is_shown_is_one_short_line_without_commands_to_the_screen() {
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
