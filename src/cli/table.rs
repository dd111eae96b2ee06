//! Columns of plain text.

/// How a column stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// Lays rows out in columns two spaces apart; lines end without blanks.
pub(super) fn columns(rows: &[Vec<String>], aligns: &[Align]) -> String {
    let widths: Vec<usize> = (0..aligns.len())
        .map(|column| {
            rows.iter()
                .filter_map(|row| row.get(column))
                .map(|cell| width(cell))
                .max()
                .unwrap_or(0)
        })
        .collect();
    rows.iter()
        .flat_map(|row| [line(row, aligns, &widths), "\n".to_owned()])
        .collect()
}

fn line(row: &[String], aligns: &[Align], widths: &[usize]) -> String {
    let cells: Vec<String> = row
        .iter()
        .zip(aligns.iter().zip(widths))
        .map(|(cell, (align, width))| pad(cell, *align, *width))
        .collect();
    cells.join("  ").trim_end().to_owned()
}

fn pad(cell: &str, align: Align, wanted: usize) -> String {
    let blanks = " ".repeat(wanted.saturating_sub(width(cell)));
    match align {
        Align::Left => format!("{cell}{blanks}"),
        Align::Right => format!("{blanks}{cell}"),
    }
}

/// Columns a text takes on a terminal: colour codes take none, East Asian wide characters two.
pub(super) fn width(text: &str) -> usize {
    let mut columns = 0;
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        if c == '\u{1b}' {
            chars.by_ref().find(|c| *c == 'm');
        } else {
            columns += if is_wide(c) { 2 } else { 1 };
        }
    }
    columns
}

const fn is_wide(c: char) -> bool {
    matches!(c as u32, 0x1100..=0x115f | 0x2e80..=0xa4cf | 0xac00..=0xd7a3 | 0xf900..=0xfaff | 0xff00..=0xff60 | 0x2_0000..=0x3_fffd)
}

/// `1 pair`, `2 pairs`.
pub(super) fn count(number: u64, noun: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::{Align, columns, count, width};

    #[test]
    fn columns_line_up_whatever_the_colours_and_scripts() {
        let rows = [
            vec!["a".to_owned(), "永".to_owned(), "1".to_owned()],
            vec![
                "bb".to_owned(),
                "\u{1b}[31mx\u{1b}[0m".to_owned(),
                "10".to_owned(),
            ],
        ];
        let text = columns(&rows, &[Align::Left, Align::Left, Align::Right]);
        let ends: Vec<usize> = text.lines().map(width).collect();
        assert_eq!(ends, [10, 10]);
    }

    #[test]
    fn one_is_singular() {
        assert_eq!(count(1, "pair"), "1 pair");
        assert_eq!(count(0, "pair"), "0 pairs");
    }
}
