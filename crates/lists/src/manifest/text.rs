//! Encoding, column separator and line numbers of a list. Spreadsheet programs may write UTF-16 or a byte-order mark.

use std::borrow::Cow;

use memchr::memchr_iter;

use mocban_core::domain::SeparatorLines;

const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";

/// Why a file is not a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotText {
    /// Invalid UTF-16 text.
    #[error("the text is UTF-16 and truncated or damaged; save it as UTF-8")]
    DamagedUtf16,
    /// A workbook, such as a file of Excel.
    #[error(
        "this is a workbook of an old format or with a password, or an archive; save the table as XLSX or as \"CSV UTF-8\" in the spreadsheet program"
    )]
    Workbook,
}

/// First bytes of a ZIP archive, such as an `.xlsx` or `.ods` file, and of an `.xls` file.
const WORKBOOKS: [&[u8]; 2] = [b"PK\x03\x04", b"\xd0\xcf\x11\xe0"];

/// Removes a byte-order mark and converts UTF-16 to UTF-8. Returns all other bytes unchanged: if they are not valid
/// UTF-8, the parser reports the line.
///
/// # Errors
/// Returns an error if UTF-16 is truncated or damaged, or if the bytes are those of a workbook.
pub fn as_utf8(bytes: &[u8]) -> Result<Cow<'_, [u8]>, NotText> {
    if WORKBOOKS.iter().any(|start| bytes.starts_with(start)) {
        return Err(NotText::Workbook);
    }
    match *bytes {
        [0xff, 0xfe, ref rest @ ..] => from_utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, ref rest @ ..] => from_utf16(rest, u16::from_be_bytes),
        // UTF-16 without a byte-order mark: a list starts with an ASCII character, which has one zero byte in UTF-16.
        [first, 0, ..] if first != 0 => from_utf16(bytes, u16::from_le_bytes),
        [0, second, ..] if second != 0 => from_utf16(bytes, u16::from_be_bytes),
        _ => Ok(bytes.strip_prefix(UTF8_MARK).unwrap_or(bytes).into()),
    }
}

/// A list in CSV, as its parser takes it.
#[derive(Debug)]
pub struct CsvText<'t> {
    /// The text. If it is not UTF-8, the parser reports the line.
    pub bytes: Cow<'t, [u8]>,
    /// The separator of columns.
    pub delimiter: u8,
}

impl<'t> CsvText<'t> {
    /// Decodes a list and finds its separator: the one that a first line such as `sep=;` names for Excel, if the header has
    /// it, or `delimiter`. The content of such lines, and blanks before quoted cells, are left out; no line moves.
    ///
    /// # Errors
    /// Returns an error if the bytes are not text.
    pub fn new(bytes: &'t [u8]) -> Result<Self, NotText> {
        let mut bytes = as_utf8(bytes)?;
        let named = SeparatorLines::find(&bytes);
        if let Some(SeparatorLines { breaks, end, .. }) = &named {
            bytes = match bytes {
                Cow::Borrowed(bytes) if breaks.is_empty() => Cow::Borrowed(&bytes[*end..]),
                bytes => Cow::Owned([breaks.as_slice(), &bytes[*end..]].concat()),
            };
        }
        // A spreadsheet program may have saved the list with another separator since the line was written.
        let is_used = |named: &u8| header(&bytes).contains(named);
        let named = named.map(|lines| lines.separator);
        let delimiter = named.filter(is_used).unwrap_or_else(|| delimiter(&bytes));
        if let Some(changed) = without_blanks_before_quotes(&bytes, delimiter) {
            bytes = Cow::Owned(changed);
        }
        Ok(Self { bytes, delimiter })
    }
}

/// Removes the blanks before quoted cells, as in `1, "a, b"`: the parser takes a quote for one only at the start of a cell.
/// Returns `None` if there are none. A quote that is not closed before the end of the cell and the line stays as it is.
fn without_blanks_before_quotes(list: &[u8], delimiter: u8) -> Option<Vec<u8>> {
    let ends_cell = |byte: &u8| *byte == delimiter || matches!(byte, b'\n' | b'\r');
    let is_blank = |byte: &&u8| matches!(byte, b' ' | b'\t') && **byte != delimiter;
    // Almost no list has any.
    let is_after_blank = |quote: usize| quote > 0 && matches!(list[quote - 1], b' ' | b'\t');
    if !memchr_iter(b'"', list).any(is_after_blank) {
        return None;
    }
    let (mut kept, mut copied, mut at) = (Vec::new(), 0, 0);
    while at < list.len() {
        let start = at + list[at..].iter().take_while(is_blank).count();
        if list.get(start) == Some(&b'"') {
            let end = end_of_quotes(list, start);
            let after = end + list[end..].iter().take_while(is_blank).count();
            let is_closed =
                list.get(after).is_none_or(ends_cell) && !list[start..end].contains(&b'\n');
            if start > at && is_closed && list[..end].last() == Some(&b'"') && end > start + 1 {
                kept.extend_from_slice(&list[copied..at]);
                copied = start;
            }
            at = if start == at || is_closed { end } else { start };
        }
        let rest = list[at..].iter().position(ends_cell);
        at = rest.map_or(list.len(), |rest| at + rest + 1);
    }
    if copied == 0 {
        return None;
    }
    kept.extend_from_slice(&list[copied..]);
    Some(kept)
}

/// Returns the position behind the quote that closes the one at `start`, or the end of the list. Two quotes are a character.
fn end_of_quotes(list: &[u8], start: usize) -> usize {
    let mut at = start + 1;
    while let Some(quote) = list[at..].iter().position(|byte| *byte == b'"') {
        at += quote + 1;
        if list.get(at) != Some(&b'"') {
            return at;
        }
        at += 1;
    }
    list.len()
}

/// Returns a cell without blanks, no-break spaces and invisible marks at its ends.
pub fn trimmed(cell: &str) -> &str {
    // Visible ASCII at both ends, as most cells have it, is found without decoding.
    if let [first, .., last] = cell.as_bytes()
        && first.is_ascii_graphic()
        && last.is_ascii_graphic()
    {
        return cell;
    }
    cell.trim_matches(|c: char| c.is_whitespace() || matches!(c, '\u{feff}' | '\u{200b}'))
}

fn from_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<Cow<'_, [u8]>, NotText> {
    let (pairs, []) = bytes.as_chunks::<2>() else {
        return Err(NotText::DamagedUtf16);
    };
    let units = pairs.iter().map(|pair| unit(*pair));
    let text: Result<String, _> = char::decode_utf16(units).collect();
    text.map(|text| text.into_bytes().into())
        .ok()
        .ok_or(NotText::DamagedUtf16)
}

/// Returns the first line that is not blank.
fn header(bytes: &[u8]) -> &[u8] {
    let start = bytes.trim_ascii_start();
    let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
    start.split(is_end).next().unwrap_or(start)
}

/// Returns the column separator: the most frequent of tab, semicolon and comma in the first line that is not blank.
/// Returns a comma if the line has none of them.
fn delimiter(bytes: &[u8]) -> u8 {
    let header = header(bytes);
    let count = |delimiter: u8| header.split(|byte| *byte == delimiter).count();
    [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|delimiter| count(*delimiter))
        .unwrap_or(b',')
}

/// Finds the line on which each record of a CSV list starts. The position from the CSV parser is not enough: a line
/// feed or blank lines may lie between that position and the record.
#[derive(Debug)]
pub struct LineCounter<B> {
    bytes: B,
    at: usize,
    line: usize,
}

impl<B: AsRef<[u8]>> LineCounter<B> {
    /// Starts at the beginning of a list.
    pub const fn new(bytes: B) -> Self {
        Self {
            bytes,
            at: 0,
            line: 1,
        }
    }

    /// Returns the line of the next record after `position`, counted from 1. Positions must be in ascending order.
    pub fn at(&mut self, position: Option<&::csv::Position>) -> usize {
        let from = position.map_or(0, ::csv::Position::byte) as usize;
        let bytes = self.bytes.as_ref();
        let blank = bytes[from..]
            .iter()
            .take_while(|byte| matches!(**byte, b'\r' | b'\n'))
            .count();
        let at = self.at;
        let passed = &bytes[at..from + blank];
        // Old programs for the Macintosh end lines with a carriage return alone.
        let is_alone = |k: &usize| bytes.get(at + k + 1) != Some(&b'\n');
        let returns = memchr_iter(b'\r', passed).filter(is_alone).count();
        self.line += memchr_iter(b'\n', passed).count() + returns;
        self.at = from + blank;
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::{CsvText, LineCounter, NotText, as_utf8, delimiter};

    fn text(list: &str) -> (String, char) {
        let found = CsvText::new(list.as_bytes()).expect("text");
        let text = String::from_utf8(found.bytes.into_owned()).expect("UTF-8");
        (text, char::from(found.delimiter))
    }

    #[test]
    fn a_first_line_may_name_the_separator() {
        for list in [
            "sep=;\r\na;b,c,d\r\n",
            "\u{feff}SEP=;\na;b,c,d\n",
            "\"sep=;\";;\na;b,c,d\n",
            "\"Sep = ;\"\na;b,c,d\n",
        ] {
            let (text, separator) = text(list);
            assert_eq!((text.trim(), separator), ("a;b,c,d", ';'), "{list}");
            assert_eq!(text.lines().count(), 2, "lines are counted as in the file");
        }
        for list in ["sep=,\nsep=;\na;b,c,d\n", "\r\nsep=;\na;b,c,d\n"] {
            let (text, separator) = text(list);
            assert_eq!((text.trim(), separator), ("a;b,c,d", ';'), "{list}");
            assert_eq!(text.lines().count(), 3, "lines are counted as in the file");
        }
        assert_eq!(text("sep=;x\na,b\n").1, ';');
        assert_eq!(text("sep=,\r\n\na;b;c\n1;2,5;3\n").1, ';');
        assert_eq!(text("sep=|\na|b\n").1, '|');
        assert_eq!(text("sep,a\n").1, ',');
    }

    #[test]
    fn lines_are_counted_with_any_line_end() {
        for end in ["\n", "\r", "\r\n"] {
            let list = ["a,b", "c,d", "", "e,f"].join(end);
            let mut position = ::csv::Position::new();
            position.set_byte(list.find("c,d").expect("a record") as u64);
            let mut lines = LineCounter::new(list.as_bytes());
            assert_eq!(lines.at(Some(&position)), 2, "{end:?}");
            position.set_byte(list.find("e,f").expect("a record") as u64);
            assert_eq!(lines.at(Some(&position)), 4, "{end:?}");
        }
    }

    #[test]
    fn blanks_before_quoted_cells_are_left_out() {
        for (list, expected) in [
            ("1, \"a, b\",c\n", "1,\"a, b\",c\n"),
            (
                "1,\t \"a\" , \"b\"\"c\"\n \"d\"",
                "1,\"a\" ,\"b\"\"c\"\n\"d\"",
            ),
            // A quote inside a cell, inside quotes, and one that is not closed in its cell.
            ("1, \"a\" b,c\n", "1, \"a\" b,c\n"),
            ("1,\"x, \"\"y\"\" \",c\n", "1,\"x, \"\"y\"\" \",c\n"),
            ("1, \"a\nb\",c\n", "1, \"a\nb\",c\n"),
            ("1, \"", "1, \""),
            ("1, \"\",c", "1,\"\",c"),
            ("1,a\"b, c\"\n", "1,a\"b, c\"\n"),
        ] {
            assert_eq!(text(list).0, expected, "{list}");
        }
        // A tab separates cells.
        assert_eq!(text("a\tb\n1\t\"x\"\n").0, "a\tb\n1\t\"x\"\n");
    }

    #[test]
    fn utf16_and_marks_become_plain_utf8() {
        let text = "id;mesh\n明;b\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            [b"\xff\xfe", little.as_slice()].concat(),
            [b"\xfe\xff", big.as_slice()].concat(),
            little.clone(),
            big,
        ] {
            assert_eq!(as_utf8(&bytes).as_deref(), Ok(text.as_bytes()));
        }
        assert_eq!(
            as_utf8(&little[..little.len() - 1]),
            Err(NotText::DamagedUtf16)
        );
        assert_eq!(as_utf8(b"PK\x03\x04\x14\0"), Err(NotText::Workbook));
        assert_eq!(as_utf8(b""), Ok(b"".as_slice().into()));
    }

    #[test]
    fn header_determines_the_separator() {
        assert_eq!(delimiter(b"a;b;c\n1,5;2;3\n"), b';');
        assert_eq!(delimiter(b"a\tb\n"), b'\t');
        assert_eq!(delimiter(b"a\n"), b',');
    }
}
