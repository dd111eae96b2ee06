//! Points whose cells are in quotation marks, as spreadsheet programs write numbers with decimal commas.

use crate::domain::cancel::polled;
use crate::domain::named_separator;
use crate::mesh::text;

/// Returns the text of a file without quotation marks, with semicolons between cells and with decimal points, line by line.
/// Returns `None` if no cell is in quotation marks, or if some numbers have a comma and others a point.
pub(super) fn plain_text(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut quoted = text::raw_lines(bytes).filter(|(_, line)| line.contains(&b'"'));
    let separator = quoted.find_map(|(_, line)| separator_of(line))?;
    let mut plain = Vec::with_capacity(bytes.len());
    let (mut has_comma, mut has_point) = (false, false);
    for (_, line) in text::raw_lines(bytes) {
        if named_separator(line.trim_ascii()).is_some() {
            plain.push(b'\n');
            continue;
        }
        for (nth, cell) in cells(line, separator).into_iter().enumerate() {
            if nth > 0 {
                plain.push(b';');
            }
            let pointed = pointed(&cell);
            has_comma |= pointed.is_some();
            has_point |= cell.contains(&b'.') && text::number(&cell).is_some();
            let is_joined = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
            let joined = |byte: u8| if is_joined(&byte) { b'_' } else { byte };
            plain.extend(pointed.unwrap_or(cell).into_iter().map(joined));
        }
        plain.push(b'\n');
    }
    (!has_comma || !has_point).then_some(plain)
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

/// Replaces the decimal comma of a number by a point. Returns `None` for other cells.
fn pointed(cell: &[u8]) -> Option<Vec<u8>> {
    let pointed = cell.contains(&b',').then(|| text::with_point(cell))?;
    text::number(&pointed).is_some().then_some(pointed)
}
