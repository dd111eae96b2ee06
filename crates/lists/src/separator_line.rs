//! The first line of a list, such as `sep=;`, that names the separator of columns for Excel.

/// Longest such line with blanks.
const MAX_LINE_BYTES: usize = 32;

/// Returns the separator that the first line of a list names, and the number of bytes before the line break. Blanks do not
/// matter, so the separator is none.
pub(crate) fn separator_line(list: &[u8]) -> Option<(u8, usize)> {
    let head = &list[..list.len().min(MAX_LINE_BYTES)];
    let end = head.iter().position(|byte| b"\r\n".contains(byte))?;
    let (name, rest) = head[..end].split_at_checked(b"sep".len())?;
    let named = without_blanks(rest).strip_prefix(b"=")?;
    match *without_blanks(named) {
        [separator] if name.eq_ignore_ascii_case(b"sep") => Some((separator, end)),
        _ => None,
    }
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
