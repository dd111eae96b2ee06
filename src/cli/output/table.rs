//! Columns of plain text.

use unicode_width::UnicodeWidthStr;

use super::screen::terminal_line;

/// Formats rows as columns two spaces apart, without trailing blanks. `aligns` has one character per column: `<` for
/// left and `>` for right.
pub(crate) fn columns(rows: impl IntoIterator<Item = Vec<String>>, aligns: &str) -> String {
    let one_line = |row: Vec<String>| row.iter().map(|cell| terminal_line(cell)).collect();
    let rows: Vec<Vec<String>> = rows.into_iter().map(one_line).collect();
    let width_of_column = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| width(cell)).max().unwrap_or(0)
    };
    let aligns: Vec<(char, usize)> = (aligns.chars().zip(0..))
        .map(|(align, column)| (align, width_of_column(column)))
        .collect();
    rows.iter()
        .flat_map(|row| [line(row, &aligns), "\n".to_owned()])
        .collect()
}

fn line(row: &[String], aligns: &[(char, usize)]) -> String {
    let cells: Vec<String> = row
        .iter()
        .zip(aligns)
        .map(|(cell, (align, column_width))| {
            let blanks = " ".repeat(column_width.saturating_sub(width(cell)));
            if *align == '>' {
                blanks + cell
            } else {
                cell.clone() + &blanks
            }
        })
        .collect();
    cells.join("  ").trim_end().to_owned()
}

/// Returns the number of terminal columns of a text. A colour code takes none, a wide East Asian character takes two.
fn width(text: &str) -> usize {
    let mut parts = text.split("\u{1b}[");
    let first = parts.next().map_or(0, UnicodeWidthStr::width);
    let after_codes = parts.map(|part| part.split_once('m').map_or(0, |(_, rest)| rest.width()));
    first + after_codes.sum::<usize>()
}

/// Formats a number with its noun: `1 pair`, `2 pairs`.
pub(crate) fn count(number: u64, noun: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{ending}")
}

/// Formats numbers of pairs and blocks: `2 pairs and 1 block`. Leaves blocks out if there are none, and pairs if there
/// are only blocks.
pub(crate) fn pairs_and_blocks(pairs: u64, blocks: u64) -> String {
    match (pairs, blocks) {
        (pairs, 0) => count(pairs, "pair"),
        (0, blocks) => count(blocks, "block"),
        (pairs, blocks) => format!("{} and {}", count(pairs, "pair"), count(blocks, "block")),
    }
}

#[cfg(test)]
mod tests {
    use clap::ColorChoice;

    use super::{columns, count, pairs_and_blocks, width};
    use crate::cli::output::screen::{Palette, Tone};

    #[test]
    fn columns_line_up_whatever_the_colours_and_scripts() {
        let rows = [
            vec!["a".to_owned(), "永".to_owned(), "1".to_owned()],
            vec![
                "bb".to_owned(),
                Palette::choose(ColorChoice::Always, false).paint(Tone::Bad, "x"),
                "10".to_owned(),
            ],
            // Two Vietnamese letters: one as a single character, one as a base letter with two combining marks.
            vec![
                "Tr\u{1ea7}n".to_owned(),
                "a\u{302}\u{300}".to_owned(),
                "5".to_owned(),
            ],
        ];
        let text = columns(rows, "<<>");
        let ends: Vec<usize> = text.lines().map(width).collect();
        assert_eq!(ends, [12, 12, 12]);
    }

    #[test]
    fn a_cell_cannot_add_lines_or_hidden_characters() {
        let rows = [
            vec!["a\nnext: rm".to_owned(), "1".to_owned()],
            vec!["\u{202e}".to_owned(), "10".to_owned()],
        ];
        assert_eq!(columns(rows, "<>"), "a next: rm   1\n\\u{202e}    10\n");
    }

    #[test]
    fn one_is_singular() {
        assert_eq!(count(1, "pair"), "1 pair");
        assert_eq!(count(0, "pair"), "0 pairs");
    }

    #[test]
    fn what_there_is_none_of_is_left_out() {
        assert_eq!(pairs_and_blocks(1, 2), "1 pair and 2 blocks");
        assert_eq!(pairs_and_blocks(0, 1), "1 block");
        assert_eq!(pairs_and_blocks(0, 0), "0 pairs");
    }
}
