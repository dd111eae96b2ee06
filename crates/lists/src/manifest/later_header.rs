//! Finds the header of a list below a title.

use super::cell_forms::plain_header;
use super::draft::MAX_ROW_BYTES;
use super::text::trimmed;
use crate::columns::KnownColumns;

/// Number of lines in which a header below a title is searched.
const MAX_TITLE_LINES: usize = 20;

/// Returns the number of the first line below the first `above` ones that has these columns, of which the first `required` are
/// needed. Its separator may be another one.
pub fn later_header(
    list: &[u8],
    (delimiter, above): (u8, usize),
    known: &KnownColumns,
    required: usize,
) -> Option<usize> {
    let has_columns = |text: &str, delimiter: u8| {
        let cells = text.split(char::from(delimiter));
        let unquoted = |cell| trimmed(plain_header(cell).trim_matches('"'));
        let names: Vec<&str> = cells.map(unquoted).collect();
        known.assign(&names).is_ok_and(|found| {
            let mut needed = known.names[..required].iter();
            needed.all(|name| found.columns.contains(&Some(*name)))
        })
    };
    let lines = list.split(|byte| *byte == b'\n').take(MAX_TITLE_LINES);
    let lines = (1..).zip(lines).skip(above);
    let mut short = lines.filter(|(_, line)| line.len() <= MAX_ROW_BYTES);
    let found = short.find(|(_, line)| {
        let mut delimiters = [delimiter, b',', b';', b'\t'].into_iter();
        std::str::from_utf8(line)
            .is_ok_and(|text| delimiters.any(|delimiter| has_columns(text, delimiter)))
    });
    found.map(|(number, _)| number)
}
