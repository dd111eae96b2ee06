//! Words of a command that can be copied into a shell.

use super::sanitize::is_hidden;

/// Quotes a word for a POSIX shell if it needs quotes. A word with characters that a terminal does not show is quoted
/// as `$'..'`, and each byte of such a character is escaped.
pub fn shell_quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else if word.contains(is_hidden) {
        let quoted = word.chars().map(|c| match c {
            '\'' | '\\' => format!("\\{c}"),
            _ if is_hidden(c) => {
                let hidden = c.to_string();
                // Three octal digits end the escape, whatever follows.
                let bytes = hidden.bytes().map(|byte| format!("\\{byte:03o}"));
                bytes.collect::<Vec<_>>().concat()
            }
            _ => c.to_string(),
        });
        format!("$'{}'", quoted.collect::<String>())
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Quotes an id as the last argument of a command. One that begins with a hyphen stands behind `--`, so that it is no
/// option.
pub fn quoted_id(id: &str) -> String {
    let quoted = shell_quoted(id);
    if id.starts_with('-') {
        format!("-- {quoted}")
    } else {
        quoted
    }
}

#[cfg(test)]
mod tests {
    use super::{quoted_id, shell_quoted};

    #[test]
    fn an_id_with_a_hyphen_at_its_start_is_no_option() {
        assert_eq!(quoted_id("-2+3"), "-- -2+3");
        assert_eq!(quoted_id("-a b"), "-- '-a b'");
        assert_eq!(quoted_id("a-b"), "a-b");
    }

    #[test]
    fn words_that_a_shell_would_split_are_quoted() {
        assert_eq!(shell_quoted("demo/a-b"), "demo/a-b");
        assert_eq!(shell_quoted("my scans"), "'my scans'");
        assert_eq!(shell_quoted("it's"), r"'it'\''s'");
        assert_eq!(shell_quoted(""), "''");
        assert_eq!(shell_quoted("a\n'\u{1b}5\\"), r"$'a\012\'\0335\\'");
    }
}
