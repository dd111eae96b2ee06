//! Forms of cells of CSV: texts that are kept from becoming numbers, and cells that take in what seems to be another row.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::column_names::shown_column;
use super::text::trimmed;

/// Returns the text of a cell without blanks at its ends. A formula that is a text alone, such as `="0117"`, with which
/// spreadsheet programs keep zeros, is this text, in which two quotation marks stand for one.
///
/// ```
/// use mocban_lists::manifest::plain_cell;
///
/// assert_eq!(plain_cell(" =\"0117\""), "0117");
/// assert_eq!(plain_cell("=\"a\"\"b\""), "a\"b");
/// assert_eq!(plain_cell("=A1"), "=A1");
/// ```
pub fn plain_cell(cell: &str) -> Cow<'_, str> {
    let cell = trimmed(cell);
    let inner = cell.strip_prefix("=\"");
    match inner.and_then(|rest| rest.strip_suffix('"')) {
        Some(inner) if !inner.contains('"') => Cow::Borrowed(trimmed(inner)),
        Some(inner) if !inner.replace("\"\"", "").contains('"') => {
            Cow::Owned(trimmed(&inner.replace("\"\"", "\"")).to_owned())
        }
        _ => Cow::Borrowed(cell),
    }
}

/// Returns the name of a column from its cell like [`plain_cell`]. No name has a quotation mark.
pub fn plain_header(cell: &str) -> &str {
    match plain_cell(cell) {
        Cow::Borrowed(name) => name,
        Cow::Owned(_) => trimmed(cell),
    }
}

/// Returns whether a cell begins like a formula. What a spreadsheet program shows for it is not known.
pub(super) fn is_formula(cell: &str) -> bool {
    cell.len() > 1 && cell.starts_with('=')
}

/// What is unusual about a cell that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum CellForm {
    /// It begins with an apostrophe and what a spreadsheet program would take for a number or a formula.
    Apostrophe,
    /// It has a line break, and as many separators as a row.
    TakesRow,
    /// It begins like a formula.
    Formula,
    /// It is a whole number with the decimals `.0` or `,0`, and is read without them.
    WholeNumber(&'static str),
    /// It is a word for a missing value among whole numbers, and is read as empty.
    MissingValue,
    /// It is a word for a missing value in a column of settings, and is read as empty.
    MissingSetting,
    /// It is a word for a missing value in a column of names, and is kept.
    MissingName,
}

impl CellForm {
    /// Returns whether a cell begins with the apostrophe that marks text in a spreadsheet program.
    pub(super) fn has_apostrophe(cell: &str) -> bool {
        matches!(cell.as_bytes(), [b'\'', next, ..] if next.is_ascii_digit() || b"=+-".contains(next))
    }

    /// Returns whether a cell of a list with this number of columns has what seems to be another row.
    pub(super) fn takes_row(cell: &str, delimiter: u8, columns: usize) -> bool {
        let separators = cell.bytes().filter(|byte| *byte == delimiter).count();
        cell.contains(['\n', '\r']) && separators + 1 >= columns
    }
}

/// Cells of a list in unusual forms.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UnusualCells(BTreeMap<CellForm, FormCount>);

/// Cells in one form: their number, and the column and line of the first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct FormCount {
    count: usize,
    column: String,
    line: usize,
}

impl UnusualCells {
    /// Adds the cells of a row on a line, each with its column.
    pub(super) fn add(&mut self, line: usize, cells: &[(CellForm, String)]) {
        for (form, column) in cells {
            let found = self.0.entry(*form).or_default();
            if found.count == 0 {
                found.column = shown_column(column);
                found.line = line;
            }
            found.count += 1;
        }
    }

    /// Returns a warning for each form that was found.
    pub fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.0.iter().map(|(form, found)| {
            let FormCount {
                count,
                column,
                line,
            } = found;
            match form {
                CellForm::Apostrophe => format!(
                    "cells that begin with an apostrophe: {count}, the first in column {column} on line {line}; it is kept, \
                     so remove it if it only marks text"
                ),
                CellForm::TakesRow => format!(
                    "cells in quotation marks with a line break and what seems to be another row: {count}, the first in column \
                     {column} on line {line}; close the quotation marks on their line if it is one"
                ),
                CellForm::Formula => format!(
                    "cells that begin with = like formulas: {count}, the first in column {column} on line {line}; they are \
                     kept as they are"
                ),
                CellForm::WholeNumber(decimals) => format!(
                    "whole numbers that are written with {decimals}: {count}, the first in column {column} on line {line}; they are \
                     read without it, as in JSON and XLSX"
                ),
                CellForm::MissingValue => format!(
                    "words for missing values beside whole numbers: {count}, the first in column {column} on line {line}; they \
                     are read as empty cells"
                ),
                CellForm::MissingSetting => format!(
                    "words for missing values: {count}, the first in column {column} on line {line}; they are read as empty \
                     cells"
                ),
                CellForm::MissingName => format!(
                    "names that are words for missing values: {count}, the first in column {column} on line {line}; they \
                     are kept, so clear these cells if there is no value"
                ),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{parse_csv, read_blocks, read_csv};
    use super::plain_cell;

    /// Returns the warnings about cells of a list of pairs.
    fn warnings(list: &str) -> Vec<String> {
        let read = read_csv(list.as_bytes(), &mut drop).expect(list);
        read.unusual_cells.warnings().collect()
    }

    #[test]
    fn texts_in_the_form_of_formulas_are_read() {
        for (cell, expected) in [
            ("=\"0117\"", "0117"),
            (" =\" a \" ", "a"),
            ("=\"\"", ""),
            ("=\"", "=\""),
            ("=\"a\"\"b\"", "a\"b"),
            ("=\"\"\"\"", "\""),
            ("=\"a\"\"\"b\"", "=\"a\"\"\"b\""),
            ("=\"a\"&\"b\"", "=\"a\"&\"b\""),
            ("=1", "=1"),
            ("0117", "0117"),
        ] {
            assert_eq!(plain_cell(cell), expected, "{cell}");
        }
        let list =
            "id,mesh,print,year,note\n\"=\"\"0117\"\"\",=\"a.stl\",a.png,\"=\"\"01\"\"\",=\"\"\n";
        let rows = parse_csv(list.as_bytes()).expect("a list");
        assert_eq!(rows[0].name.as_str(), "0117");
        assert_eq!(rows[0].mesh.to_str(), Some("a.stl"));
        assert_eq!(rows[0].meta["year"], "01");
        assert_eq!(rows[0].meta.len(), 1);
        let blocks = "block;mesh;page\n\"=\"\"007\"\"\";a.stl;=\"a.png\"\n";
        let read = read_blocks(blocks.as_bytes()).expect("a list");
        assert_eq!(read.rows[0].name.as_str(), "007");
        assert_eq!(read.rows[0].page.to_str(), Some("a.png"));
    }

    #[test]
    fn names_of_columns_and_doubled_quotes_are_read_in_the_form_of_formulas() {
        let list = "=\"id\",=\"mesh\",\"=\"\"print\"\"\",=\"character\",=\"note\"\n\
            =\"0117\",a.stl,a.png,\"=\"\"x\"\"\"\"y\"\"\",=\"z\"\"\"\n";
        let rows = parse_csv(list.as_bytes()).expect("a list");
        assert_eq!(rows[0].name.as_str(), "0117");
        assert_eq!(rows[0].character.as_deref(), Some("x\"y"));
        assert_eq!(rows[0].meta["note"], "z\"");
        let blocks = "=\"block\";=\"mesh\";=\"page\"\nb;m;p\n";
        assert_eq!(
            read_blocks(blocks.as_bytes()).expect("a list").rows.len(),
            1
        );
    }

    #[test]
    fn formulas_are_refused_in_known_columns_and_named_in_others() {
        for (row, column, shown) in [
            ("=0117,m,p,x", "id", "=0117"),
            ("a,=A1&\"\".stl\"\",p,x", "mesh", "=A1&\\\"\\\".stl\\\"\\\""),
            ("a,m,=\"p\"\"\"q\",x", "print", "=\\\"p\\\"\\\"\\\"q\\\""),
            ("a,m,p,=C2", "character", "=C2"),
        ] {
            let list = format!("id,mesh,print,character\n{row}\n");
            assert_eq!(
                parse_csv(list.as_bytes()).expect_err(row).to_string(),
                format!(
                    "line 2: column {column} has \"{shown}\", which begins like a formula; write the text itself"
                )
            );
        }
        let refused = read_blocks(b"block,mesh,page\n=7,m,p\n").expect_err("a formula");
        assert!(
            refused.to_string().contains("column block has \"=7\""),
            "{refused}"
        );
        let list = "id,mesh,print,character,year\na,m,p,=,=A1\nb,n,q,,=\n";
        assert_eq!(
            warnings(list),
            [
                "cells that begin with = like formulas: 1, the first in column \"year\" on line 2; they are kept as they are"
            ]
        );
        let rows = parse_csv(list.as_bytes()).expect("a list");
        assert_eq!(rows[0].character.as_deref(), Some("="));
        assert_eq!(rows[0].meta["year"], "=A1");
    }

    #[test]
    fn apostrophes_before_numbers_are_named() {
        let list = "id,mesh,print,note\n'0117,m,p,'t Hooft\n'0118,m,p,'=A1\n";
        let expected = "cells that begin with an apostrophe: 3, the first in column \"id\" on line 2; it is kept, so remove it \
            if it only marks text";
        assert_eq!(warnings(list), [expected]);
        assert_eq!(warnings("id,mesh,print,note\na,m,p,'t Hooft\n"), [""; 0]);
        let read = read_blocks(b"block,mesh,page\n'01,m,p\n").expect("a list");
        assert!(read.warnings[0].starts_with("cells that begin with an apostrophe: 1"));
    }

    #[test]
    fn a_cell_that_takes_in_a_row_is_named() {
        let list = "id,mesh,print,note\nA,a.stl,a.png,\"x\nB,b.stl,b.png,y\"\nC,c.stl,c.png,\"two\nlines, and more\"\n";
        let expected = "cells in quotation marks with a line break and what seems to be another row: 1, the first in column \
            \"note\" on line 2; close the quotation marks on their line if it is one";
        assert_eq!(warnings(list), [expected]);
        let list = "block,mesh,page,note\r\nA,a.stl,a.png,\"x\r\nB,b.stl,b.png,y\"\r\n";
        let read = read_blocks(list.as_bytes()).expect("a list");
        assert!(read.warnings[0].starts_with("cells in quotation marks with a line break"));
    }

    #[test]
    fn a_line_break_in_a_path_or_character_is_refused() {
        for (row, column) in [
            ("A,\"a.stl\nB,b.stl\",a.png,x", "mesh"),
            ("A,a.stl,\"a\r.png\",x", "print"),
            ("A,a.stl,a.png,\"x\ny\"", "character"),
        ] {
            let list = format!("id,mesh,print,character\n{row}\n");
            let refused = parse_csv(list.as_bytes()).expect_err(column).to_string();
            let reason = format!("line 2: column {column} has a line break; write it on one line");
            assert_eq!(refused, reason);
        }
        let refused = read_blocks(b"block,mesh,page\nb,m,\"p\nq\"\n").expect_err("a page");
        assert!(refused.to_string().contains("column page has a line break"));
    }
}
