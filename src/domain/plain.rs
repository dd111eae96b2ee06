//! Words out of files, as they may stand in a message.

/// The beginning of a text on one line: what a screen would not show, or would obey, comes as an escape; what is
/// longer than `most` characters ends in three dots.
pub fn plain(text: &str, most: usize) -> String {
    let mut shown = String::new();
    for (at, c) in text.chars().enumerate() {
        if at == most {
            shown.push_str("...");
            break;
        }
        match c {
            '"' | '\'' | '\\' => shown.push(c),
            '\n' | '\r' | '\t' => shown.push(' '),
            _ => shown.extend(c.escape_debug()),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn what_is_shown_is_one_short_line_without_commands_to_the_screen() {
        assert_eq!(
            plain("rows of Tr\u{1ea7}n \"\u{660e}\"", 40),
            "rows of Tr\u{1ea7}n \"\u{660e}\""
        );
        assert_eq!(
            plain("a\nb\x1b[2J\u{202e}\0", 40),
            "a b\\u{1b}[2J\\u{202e}\\0"
        );
        assert_eq!(plain("abc", 3), "abc");
        assert_eq!(plain("abcd", 3), "abc...");
    }
}
