//! Ids of CSV that are whole numbers with the decimals `.0` or `,0`. Python writes them so if a value of the column is missing,
//! and may write a word such as `nan` for it. Spreadsheet programs write a comma in many languages.

use ::csv::ByteRecord;
use memchr::memmem;

use super::cell_forms::CellForm;
use super::draft::DraftRow;
use super::missing_words::MISSING;
use super::row_reader::row_reader;
use super::text::trimmed;
use crate::json_numbers::{InexactNumber, MAX_EXACT};
use mocban_core::domain::spelling::quoted;

/// Columns whose numbers are names.
const NAMES: [&str; 3] = ["id", "block", "character"];

/// Decimals of whole numbers.
const DECIMALS: [&str; 2] = [".0", ",0"];

/// Columns of names in which all values are whole numbers with the same decimals, or stand for missing values.
#[derive(Debug, Default)]
pub(super) struct WholeNumbers(Vec<NameColumn>);

/// A column of names.
#[derive(Debug)]
struct NameColumn {
    name: &'static str,
    /// Whether rows may have the same name, or none. Numbers without `.0` may stand beside the others then.
    is_of_groups: bool,
    /// The decimals of its numbers, once one is found.
    decimals: Option<&'static str>,
}

impl WholeNumbers {
    /// Finds such columns of a list by the standard names of its columns.
    pub(super) fn find(
        list: &[u8],
        delimiter: u8,
        columns: impl Iterator<Item = Option<&'static str>>,
    ) -> Self {
        // Most lists have none, so their rows are not read twice.
        let of_comma: &[u8] = if delimiter == b',' { b",0\"" } else { b",0" };
        if memmem::find(list, b".0").is_none() && memmem::find(list, of_comma).is_none() {
            return Self::default();
        }
        let names: Vec<_> = columns.enumerate().collect();
        // In a list of blocks, the block is the id.
        let has_id = names.iter().any(|(_, name)| *name == Some("id"));
        let names = names.into_iter();
        let names = names.filter_map(|(at, name)| Some((at, name?)));
        let names = names.filter(|(_, name)| NAMES.contains(name));
        let column = |name: &'static str| NameColumn {
            name,
            is_of_groups: has_id && name != "id",
            decimals: None,
        };
        let mut found: Vec<(usize, NameColumn)> =
            names.map(|(at, name)| (at, column(name))).collect();
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
            found.retain_mut(|(at, column)| {
                let cell = record.get(*at).unwrap_or_default();
                let Ok(cell) = std::str::from_utf8(cell) else {
                    return false;
                };
                let cell = trimmed(cell);
                if let Some((_, decimals)) = whole_and_decimals(cell) {
                    return *column.decimals.get_or_insert(decimals) == decimals;
                }
                cell.is_empty() || MISSING.contains(&cell) || column.is_of_groups && is_whole(cell)
            });
        }
        let found = found.into_iter().map(|(_, column)| column);
        Self(found.filter(|column| column.decimals.is_some()).collect())
    }

    /// Takes the decimals off the numbers of a row in these columns, and words for missing values out of columns whose values
    /// may be missing.
    ///
    /// # Errors
    /// Returns an error if a number is too large to be exact, or an id is missing.
    pub(super) fn apply(&self, draft: &mut DraftRow) -> Result<(), String> {
        for column in &self.0 {
            let NameColumn {
                name, is_of_groups, ..
            } = column;
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
            let Some((whole, decimals)) = whole_and_decimals(cell) else {
                continue;
            };
            let whole = whole.to_owned();
            let is_exact = whole
                .parse::<f64>()
                .is_ok_and(|number| number.abs() < MAX_EXACT);
            if !is_exact {
                let error = InexactNumber::new(cell);
                return Err(format!("{name:?}: {error}; write it as text"));
            }
            *cell = whole;
            let form = CellForm::WholeNumber(decimals);
            draft.unusual.push((form, (*name).to_owned()));
        }
        Ok(())
    }
}

/// Returns a whole number without its decimals, as Python writes it, or with a comma.
///
/// ```
/// use mocban_lists::manifest::whole_part;
///
/// assert_eq!(whole_part("117.0"), Some("117"));
/// assert_eq!(whole_part("117,0"), Some("117"));
/// assert_eq!(whole_part("0117.0"), None);
/// ```
pub fn whole_part(text: &str) -> Option<&str> {
    whole_and_decimals(text).map(|(whole, _)| whole)
}

/// Returns a whole number like [`whole_part`], and its decimals: `.0` or `,0`.
pub fn whole_and_decimals(text: &str) -> Option<(&str, &'static str)> {
    let mut found = DECIMALS.iter().filter_map(|decimals| {
        let whole = text.strip_suffix(decimals)?;
        is_whole(whole).then_some((whole, *decimals))
    });
    found.next()
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
    fn a_column_of_whole_numbers_with_a_decimal_comma_is_read_without() {
        let warning = "whole numbers that are written with ,0: 3, the first in column \"id\" on line 2; they are read without it, as in \
            JSON and XLSX";
        for list in [
            "id;mesh;print;block\n117,0;a;a;4,0\n118,0;b;b;\n",
            "id,mesh,print,block\n\"117,0\",a,a,\"4,0\"\n\"118,0\",b,b,\n",
        ] {
            let (ids, warnings) = read(list);
            assert_eq!(ids, ["117", "118"], "{list}");
            assert_eq!(warnings, [warning], "{list}");
        }
        let rows = parse_csv(b"id;mesh;print;block\n117,0;a;a;4,0\n").expect("a list");
        assert_eq!(rows[0].block.as_deref(), Some("4"));
    }

    #[test]
    fn words_for_missing_values_are_no_settings_and_unusual_names() {
        let list = "id,mesh,print,block,character,unit\nA,a,a,B1,nan,mm\nB,b,b,nan,None,nan\nNaN,c,c,NA,x,\n";
        let rows = parse_csv(list.as_bytes()).expect("a list");
        assert_eq!(rows[1].unit, None);
        assert_eq!(rows[1].block.as_deref(), Some("nan"), "kept");
        let (ids, warnings) = read(list);
        assert_eq!(ids, ["A", "B", "NaN"]);
        assert_eq!(
            warnings,
            [
                "words for missing values: 1, the first in column \"unit\" on line 3; they are read as empty cells",
                "names that are words for missing values: 4, the first in column \"character\" on line 3; they are kept, so \
                 clear these cells if there is no value"
            ]
        );
        let read = read_blocks(b"block,mesh,page,unit,side\nB,a,a,None,null\n").expect("a list");
        assert_eq!((read.rows[0].unit, read.rows[0].side), (None, None));
        assert!(read.warnings[0].starts_with("words for missing values: 2"));
        let read = read_blocks(b"block,mesh,page\nNA,a,a\nNB,b,b\n").expect("a list");
        assert_eq!(read.warnings, [""; 0], "initials");
    }

    #[test]
    fn a_column_with_other_values_stays_as_it_is() {
        for ids in [
            ["117.0", "117"],
            ["117.0", "1.5"],
            ["117.0", "a"],
            ["117.0", "0118.0"],
            ["117.0", "118.00"],
            ["117.0", "\"118,0\""],
            ["117.0", "=\"118.0\""],
            ["1.0.0", "x.0"],
            ["-0.0", "-.0"],
        ] {
            let rows = ids.map(|id| format!("{id},m,p\n"));
            let (read, warnings) = read(&format!("id,mesh,print\n{}", rows.concat()));
            let expected = ids.map(|id| id.trim_start_matches('=').trim_matches('"'));
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
