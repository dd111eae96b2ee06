//! The first line of a list, such as `sep=;`, that names the separator of columns for Excel.

/// Longest such line with blanks.
const MAX_LINE_BYTES: usize = 32;

/// Returns the separator that the first line of a list names, and the number of bytes before the line break. Blanks do not
/// matter, so the separator is none. The line may be in quotation marks, and separators of empty cells may follow, as a program
/// writes them that saved the line as a cell.
pub(crate) fn separator_line(list: &[u8]) -> Option<(u8, usize)> {
    let head = &list[..list.len().min(MAX_LINE_BYTES)];
    let end = head.iter().position(|byte| b"\r\n".contains(byte))?;
    let line = without_blanks(&head[..end]);
    let line = unquoted(line).unwrap_or(line);
    let (name, rest) = line.split_at_checked(b"sep".len())?;
    let named = without_blanks(rest).strip_prefix(b"=")?;
    match without_blanks(named) {
        [separator, others @ ..]
            if name.eq_ignore_ascii_case(b"sep") && others.iter().all(|byte| byte == separator) =>
        {
            Some((*separator, end))
        }
        _ => None,
    }
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
    use super::separator_line;

    #[test]
    fn blanks_and_case_do_not_matter() {
        for (list, expected) in [
            ("sep=;\nid", Some((b';', 5))),
            ("Sep = ;\r\nid", Some((b';', 7))),
            ("SEP=, \rid", Some((b',', 6))),
            ("sep=\t\nid", Some((b'\t', 5))),
            ("\"sep=,\"\nid", Some((b',', 7))),
            (" \"Sep=\t\" \r\nid", Some((b'\t', 9))),
            ("\"sep=;\";;\n", Some((b';', 9))),
            ("sep=;;;\n", Some((b';', 7))),
            ("\"sep=;\"x\n", None),
            ("\"sep=;\n", None),
            ("sep=;", None),
            ("sep=;,\n", None),
            ("sep,mesh\n", None),
            ("id,mesh,print\n", None),
            ("", None),
        ] {
            assert_eq!(separator_line(list.as_bytes()), expected, "{list:?}");
        }
    }
}
