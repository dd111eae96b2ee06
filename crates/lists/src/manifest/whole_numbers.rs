//! Ids of CSV that are whole numbers with the decimals `.0`. Python writes them so if a value of the column is missing, and
//! may write a word such as `nan` for it.

use ::csv::ByteRecord;
use memchr::memmem;

use super::cell_forms::CellForm;
use super::draft::DraftRow;
use super::row_reader::row_reader;
use super::text::trimmed;
use crate::json_numbers::{InexactNumber, MAX_EXACT};
use mocban_core::domain::spelling::quoted;

/// Columns whose numbers are names.
const NAMES: [&str; 3] = ["id", "block", "character"];

/// Words that programs for tables write for a missing value.
const MISSING: [&str; 8] = ["nan", "NaN", "NA", "N/A", "n/a", "<NA>", "None", "null"];

/// Columns of names in which all values are whole numbers with `.0`, or stand for missing values.
#[derive(Debug, Default)]
pub(super) struct WholeNumbers(Vec<NameColumn>);

/// A column of names.
#[derive(Debug)]
struct NameColumn {
    name: &'static str,
    /// Whether rows may have the same name, or none. Numbers without `.0` may stand beside the others then.
    is_of_groups: bool,
}

impl WholeNumbers {
    /// Finds such columns of a list by the standard names of its columns.
    pub(super) fn find(
        list: &[u8],
        delimiter: u8,
        columns: impl Iterator<Item = Option<&'static str>>,
    ) -> Self {
        // Most lists have none, so their rows are not read twice.
        if memmem::find(list, b".0").is_none() {
            return Self::default();
        }
        let names: Vec<_> = columns.enumerate().collect();
        // In a list of blocks, the block is the id.
        let has_id = names.iter().any(|(_, name)| *name == Some("id"));
        let names = names.into_iter();
        let names = names.filter_map(|(at, name)| Some((at, name?)));
        let names = names.filter(|(_, name)| NAMES.contains(name));
        let mut found: Vec<(usize, NameColumn, bool)> = names
            .map(|(at, name)| {
                let is_of_groups = has_id && name != "id";
                (at, NameColumn { name, is_of_groups }, false)
            })
            .collect();
        let mut reader = row_reader(list, delimiter);
        let mut record = ByteRecord::new();
        let mut is_header = true;
        while !found.is_empty() {
            reader.get_mut().begin_row();
            // A row that cannot be read is refused later.
            if !matches!(reader.read_byte_record(&mut record), Ok(true)) {
                break;
            }
            if std::mem::take(&mut is_header) {
                continue;
            }
            found.retain_mut(|(at, column, has_numbers)| {
                let cell = record.get(*at).unwrap_or_default();
                let Ok(cell) = std::str::from_utf8(cell) else {
                    return false;
                };
                let cell = trimmed(cell);
                let is_number = whole_part(cell).is_some();
                *has_numbers |= is_number;
                is_number
                    || cell.is_empty()
                    || MISSING.contains(&cell)
                    || column.is_of_groups && is_whole(cell)
            });
        }
        let found = found.into_iter().filter(|(_, _, has_numbers)| *has_numbers);
        Self(found.map(|(_, column, _)| column).collect())
    }

    /// Takes the decimals off the numbers of a row in these columns, and words for missing values out of columns whose values
    /// may be missing.
    ///
    /// # Errors
    /// Returns an error if a number is too large to be exact, or an id is missing.
    pub(super) fn apply(&self, draft: &mut DraftRow) -> Result<(), String> {
        for NameColumn { name, is_of_groups } in &self.0 {
            let Some(cell) = draft.cells.get_mut(name) else {
                continue;
            };
            if MISSING.contains(&cell.as_str()) {
                if !is_of_groups {
                    let cell = quoted(cell);
                    return Err(format!(
                        "column {name} has {cell}, a word for a missing value; write the name"
                    ));
                }
                draft.cells.remove(name);
                let form = CellForm::MissingValue;
                draft.unusual.push((form, (*name).to_owned()));
                continue;
            }
            let Some(whole) = whole_part(cell).map(str::to_owned) else {
                continue;
            };
            let is_exact = whole
                .parse::<f64>()
                .is_ok_and(|number| number.abs() < MAX_EXACT);
            if !is_exact {
                let error = InexactNumber::new(cell);
                return Err(format!("{name:?}: {error}; write it as text"));
            }
            *cell = whole;
            draft
                .unusual
                .push((CellForm::WholeNumber, (*name).to_owned()));
        }
        Ok(())
    }
}

/// Returns a whole number without its decimals, as Python writes it.
///
/// ```
/// use mocban_lists::manifest::whole_part;
///
/// assert_eq!(whole_part("117.0"), Some("117"));
/// assert_eq!(whole_part("0117.0"), None);
/// ```
pub fn whole_part(text: &str) -> Option<&str> {
    text.strip_suffix(".0").filter(|whole| is_whole(whole))
}

/// Returns whether a text is a whole number as Python writes it.
fn is_whole(text: &str) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    match digits.as_bytes() {
        [b'0'] => digits.len() == text.len(),
        [b'0', ..] | [] => false,
        bytes => bytes.iter().all(u8::is_ascii_digit),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{parse_csv, read_blocks, read_csv};

    /// Returns the ids of a list, and the warnings about its cells.
    fn read(list: &str) -> (Vec<String>, Vec<String>) {
        let mut ids = Vec::new();
        let read = read_csv(list.as_bytes(), &mut |row| {
            ids.push(row.name.as_str().to_owned());
        });
        let read = read.expect(list);
        (ids, read.unusual_cells.warnings().collect())
    }

    #[test]
    fn a_column_of_whole_numbers_with_decimals_is_read_without() {
        let list = "id,mesh,print,block,year\n117.0,a.stl,a.png,4.0,1872.0\n-2.0,b.stl,b.png,,\n0.0,c.stl,c.png,5.0,\n";
        let (ids, warnings) = read(list);
        assert_eq!(ids, ["117", "-2", "0"]);
        assert_eq!(
            warnings,
            [
                "whole numbers that are written with .0: 5, the first in column \"id\" on line 2; they are read without it, as in JSON and XLSX"
            ]
        );
        let rows = parse_csv(list.replace(',', "\t").as_bytes()).expect("a list");
        assert_eq!(rows[0].block.as_deref(), Some("4"));
        assert_eq!(rows[0].meta["year"], "1872.0");
        assert_eq!(rows[1].block, None);
        let blocks = "block;mesh;page\n\n7.0;a.stl;a.png\n;;\n";
        let read = read_blocks(blocks.as_bytes()).expect("a list");
        assert_eq!(read.rows[0].name.as_str(), "7");
        assert!(read.warnings[0].starts_with("whole numbers that are written with .0: 1"));
    }

    #[test]
    fn a_column_with_other_values_stays_as_it_is() {
        for ids in [
            ["117.0", "117"],
            ["117.0", "1.5"],
            ["117.0", "a"],
            ["117.0", "0118.0"],
            ["117.0", "118.00"],
            ["117.0", "=\"118.0\""],
            ["1.0.0", "x.0"],
            ["-0.0", "-.0"],
        ] {
            let rows = ids.map(|id| format!("{id},m,p\n"));
            let (read, warnings) = read(&format!("id,mesh,print\n{}", rows.concat()));
            let expected = ids.map(|id| id.trim_start_matches("=\"").trim_end_matches('"'));
            assert_eq!(read, expected);
            assert_eq!(warnings, [""; 0]);
        }
    }

    #[test]
    fn words_for_missing_values_beside_numbers_are_no_names() {
        let list = "id,mesh,print,block,character\n1.0,a,a,3.0,nan\n2.0,b,b,nan,b\n4.0,c,c,5,nan\n";
        let rows = parse_csv(list.as_bytes()).expect("a list");
        let blocks: Vec<_> = rows.iter().map(|row| row.block.as_deref()).collect();
        assert_eq!(blocks, [Some("3"), None, Some("5")]);
        assert_eq!(rows[0].character.as_deref(), Some("nan"), "a text");
        let (_, warnings) = read(list);
        assert_eq!(
            warnings[1..],
            [
                "words for missing values beside whole numbers: 1, the first in column \"block\" on line 3; they are read as \
                 empty cells"
            ]
        );
        for (list, column) in [
            ("id,mesh,print\n1.0,a,a\nnan,b,b\n", "id"),
            ("block,mesh,page\n1.0,a,a\nnan,b,b\n", "block"),
        ] {
            let pairs = parse_csv(list.as_bytes()).expect_err("no id").to_string();
            let blocks = read_blocks(list.as_bytes()).expect_err("no id").to_string();
            let reason = format!(
                "line 3: column {column} has \"nan\", a word for a missing value; write the name"
            );
            assert!([pairs, blocks].contains(&reason), "{reason}");
        }
    }

    #[test]
    fn a_number_that_is_too_large_to_be_exact_is_refused() {
        let list = "id,mesh,print\n1.0,m,p\n12345678901234567.0,m,p\n";
        assert_eq!(
            parse_csv(list.as_bytes()).expect_err("refused").to_string(),
            "line 3: \"id\": the number 12345678901234567.0 is too large to be exact; write it as text"
        );
        let (ids, _) = read("id,mesh,print\n12345678901234567,m,p\n");
        assert_eq!(ids, ["12345678901234567"], "a text of digits is exact");
    }
}
