//! Points whose cells are in quotation marks, as spreadsheet programs write numbers with decimal commas.

use super::grouped::{PlainNumber, digits, other_mark, without_apostrophes};
use crate::domain::cancel::polled;
use crate::domain::named_separator;
use crate::mesh::{MeshError, text};

/// Returns the number of a cell that has a mark or grouped digits. `None` for other cells. `grouping` is the mark, a point or a
/// comma, that groups digits in the file, if that is known.
fn plain_number(cell: &[u8], grouping: Option<u8>) -> Option<PlainNumber> {
    let plain = without_apostrophes(cell);
    let cell = plain.as_deref().unwrap_or(cell);
    let grouped = PlainNumber::of_grouped(cell);
    let grouped = grouped.or_else(|| of_one_group(cell, grouping?));
    if grouped.is_some() {
        return grouped;
    }
    let has_comma = cell.contains(&b',');
    if !has_comma && !cell.contains(&b'.') {
        return None;
    }
    let text = text::with_point(cell);
    let mark = Some(if has_comma { b',' } else { b'.' });
    text::number(&text).map(|_| PlainNumber { text, mark })
}

/// Returns the number of a cell such as `1,234`, in which a mark that groups digits stands before its only group.
fn of_one_group(cell: &[u8], grouping: u8) -> Option<PlainNumber> {
    let at = cell.iter().position(|byte| *byte == grouping)?;
    let (whole, group) = (&cell[..at], &cell[at + 1..]);
    let unsigned = whole.strip_prefix(b"-").unwrap_or(whole);
    let is_grouped = matches!(unsigned.len(), 1..=3)
        && digits(unsigned) == unsigned.len()
        && unsigned[0] != b'0'
        && group.len() == 3
        && digits(group) == 3;
    is_grouped.then(|| PlainNumber {
        text: [whole, group].concat(),
        mark: Some(other_mark(grouping)),
    })
}

/// Returns the mark, a point or a comma, that groups digits in the first number with several groups, or with one and a fraction.
fn grouping_mark(bytes: &[u8], separator: u8) -> Option<u8> {
    let of_cell = |cell: &Vec<u8>| {
        let grouping = other_mark(PlainNumber::of_grouped(cell)?.mark?);
        cell.contains(&grouping).then_some(grouping)
    };
    let mut lines = text::raw_lines(bytes);
    lines.find_map(|(_, line)| cells(line, separator).iter().find_map(of_cell))
}

/// Returns the text of a file without quotation marks, with semicolons between cells, with decimal points and without what
/// groups digits, line by line. Returns `None` if no cell is in quotation marks.
///
/// # Errors
/// Returns an error that names the first line in which a number has another decimal mark than those before.
pub(super) fn plain_text(bytes: &[u8]) -> Option<Result<Vec<u8>, MeshError>> {
    let mut quoted = text::raw_lines(bytes).filter(|(_, line)| line.contains(&b'"'));
    let separator = quoted.find_map(|(_, line)| separator_of(line))?;
    let plain = with_points(bytes, separator, None);
    // Numbers such as `1,234` have the mark of others if marks of that kind group digits.
    Some(plain.or_else(|fault| {
        let grouping = grouping_mark(bytes, separator).ok_or(fault)?;
        with_points(bytes, separator, Some(grouping))
    }))
}

fn with_points(bytes: &[u8], separator: u8, grouping: Option<u8>) -> Result<Vec<u8>, MeshError> {
    let mut plain = Vec::with_capacity(bytes.len());
    let mut common = None;
    for (line, content) in text::raw_lines(bytes) {
        if named_separator(content.trim_ascii()).is_some() {
            plain.push(b'\n');
            continue;
        }
        for (nth, cell) in cells(content, separator).into_iter().enumerate() {
            if nth > 0 {
                plain.push(b';');
            }
            let Some(number) = plain_number(&cell, grouping) else {
                plain.extend(joined(&cell));
                continue;
            };
            if let Some(mark) = number.mark
                && *common.get_or_insert(mark) != mark
            {
                let reason = text::other_decimal_mark(&cell, mark);
                return Err(MeshError::Line { line, reason });
            }
            plain.extend(number.text);
        }
        plain.push(b'\n');
    }
    Ok(plain)
}

/// Returns a cell that is no number, in one piece.
fn joined(cell: &[u8]) -> Vec<u8> {
    let is_joined = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
    let joined = |byte: &u8| if is_joined(byte) { b'_' } else { *byte };
    cell.iter().map(joined).collect()
}

/// Replaces the cell that the error of a plain text quotes by that of the file.
pub(super) fn with_cell_of(bytes: &[u8], fault: MeshError) -> MeshError {
    match fault {
        MeshError::Line { line, reason } => {
            let reason = with_quote_of(bytes, line, &reason).unwrap_or(reason);
            MeshError::Line { line, reason }
        }
        fault => fault,
    }
}

/// Returns a reason that begins with a cell of a line as the file has it. `None` if it begins with no cell.
fn with_quote_of(bytes: &[u8], line: u64, reason: &str) -> Option<String> {
    let mut lines = text::raw_lines(bytes);
    let (_, content) = lines.find(|(other, _)| *other == line)?;
    let separator = separator_of(content).unwrap_or(b',');
    cells(content, separator).iter().find_map(|cell| {
        let rest = reason.strip_prefix(&text::quote(&joined(cell)))?;
        Some(format!("{}{rest}", text::quote(cell)))
    })
}

/// Returns the separator of a line: the first tab, comma or semicolon outside quotation marks.
fn separator_of(line: &[u8]) -> Option<u8> {
    let mut is_quoted = false;
    polled(line).copied().find(|byte| {
        is_quoted ^= *byte == b'"';
        !is_quoted && b"\t,;".contains(byte)
    })
}

/// Returns the cells of a line without white space at their ends and without quotation marks.
fn cells(line: &[u8], separator: u8) -> Vec<Vec<u8>> {
    let mut cells = vec![Vec::new()];
    let mut is_quoted = false;
    for byte in polled(line) {
        match *byte {
            b'"' => is_quoted = !is_quoted,
            byte if byte == separator && !is_quoted => cells.push(Vec::new()),
            byte => {
                if let Some(cell) = cells.last_mut() {
                    cell.push(byte);
                }
            }
        }
    }
    let trimmed = cells.into_iter().map(|cell| cell.trim_ascii().to_vec());
    trimmed.collect()
}
