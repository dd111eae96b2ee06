//! A line at the beginning of a table, such as `sep=;`, that names the separator of columns for Excel.

/// Longest such line with blanks.
const MAX_LINE_BYTES: usize = 32;
/// Most lines, with blank ones, among which the separator is named.
const MAX_LINES: usize = 16;

/// The lines at the beginning of a list that name its separator. There may be several, with blank lines before and between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeparatorLines {
    /// The separator that the last one names.
    pub separator: u8,
    /// The line breaks before the last one.
    pub breaks: Vec<u8>,
    /// The number of bytes before the line break of the last one.
    pub end: usize,
}

impl SeparatorLines {
    /// Finds the lines.
    ///
    /// ```
    /// use mocban_core::domain::SeparatorLines;
    ///
    /// let found = SeparatorLines::find(b"\r\nsep=;\r\na;b").expect("a separator");
    /// assert_eq!((found.separator, &*found.breaks, found.end), (b';', b"\r\n".as_slice(), 7));
    /// ```
    pub fn find(list: &[u8]) -> Option<Self> {
        let (mut found, mut breaks, mut at) = (None, Vec::new(), 0);
        for _ in 0..MAX_LINES {
            let Some(line) = first_line(&list[at..]) else {
                break;
            };
            let end = at + line.len();
            if let Some(separator) = named_separator(line) {
                let breaks = breaks.clone();
                found = Some(Self {
                    separator,
                    breaks,
                    end,
                });
            } else if !line.trim_ascii().is_empty() {
                break;
            }
            let is_crlf = list[end..].starts_with(b"\r\n");
            at = end + if is_crlf { 2 } else { 1 };
            breaks.extend_from_slice(&list[end..at]);
        }
        found
    }
}

/// Returns the first line without its line break. `None` if it is too long to name a separator, or has no line break.
fn first_line(list: &[u8]) -> Option<&[u8]> {
    let head = &list[..list.len().min(MAX_LINE_BYTES)];
    let end = head.iter().position(|byte| b"\r\n".contains(byte))?;
    Some(&head[..end])
}

/// Returns the separator that a line without its line break names. Blanks and case do not matter. The line may be in quotation
/// marks, and separators of empty cells may follow, as a program writes them that saved the line as a cell. Nothing after the
/// equals sign stands for a tab that was removed with the blanks.
pub fn named_separator(line: &[u8]) -> Option<u8> {
    let line = without_blanks(line);
    let line = without_blanks(unquoted(line).unwrap_or(line));
    let (name, rest) = line.split_at_checked(b"sep".len())?;
    let named = without_blanks(rest).strip_prefix(b"=")?;
    let separator = match without_blanks(named) {
        [] => b'\t',
        [separator, others @ ..]
            if *separator != b'"' && others.iter().all(|byte| byte == separator) =>
        {
            *separator
        }
        _ => return None,
    };
    name.eq_ignore_ascii_case(b"sep").then_some(separator)
}

/// Returns what stands in the quotation marks of a line, behind which there are only separators.
fn unquoted(line: &[u8]) -> Option<&[u8]> {
    let line = line.strip_prefix(b"\"")?;
    let close = line.iter().position(|byte| *byte == b'"')?;
    let mut rest = line[close + 1..].iter();
    rest.all(|byte| b",;|\t ".contains(byte))
        .then_some(&line[..close])
}

/// Returns a text without spaces at its ends. A tab may be the separator.
fn without_blanks(mut text: &[u8]) -> &[u8] {
    while let [b' ', rest @ ..] | [rest @ .., b' '] = text {
        text = rest;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::SeparatorLines;

    #[test]
    fn blanks_quotes_and_case_do_not_matter() {
        for (list, expected) in [
            ("sep=;\nid", Some((b';', 5))),
            ("Sep = ;\r\nid", Some((b';', 7))),
            ("SEP=, \rid", Some((b',', 6))),
            ("sep=\t\nid", Some((b'\t', 5))),
            ("sep=\nid", Some((b'\t', 4))),
            ("\"sep=,\"\nid", Some((b',', 7))),
            (" \"Sep = ;\" \nid", Some((b';', 11))),
            (" \"Sep=\t\" \r\nid", Some((b'\t', 9))),
            ("\"sep=;\";;\n", Some((b';', 9))),
            ("sep=;;;\n", Some((b';', 7))),
            ("\"sep=;\"x\n", None),
            ("sep=;", None),
            ("sep=;,\n", None),
            ("sep=\"\n", None),
            ("\"sep=;\n", None),
            ("sep,mesh\n", None),
            ("id,mesh,print\n", None),
            ("", None),
        ] {
            let found = SeparatorLines::find(list.as_bytes());
            let found = found.map(|lines| (lines.separator, lines.end));
            assert_eq!(found, expected, "{list:?}");
        }
    }
}
