//! The header of a list and its first rows, which help to choose its columns.

use super::chosen_columns::ChosenColumns;
use super::csv::column_names;
use super::row_reader::{is_blank, row_reader};
use super::text::CsvText;
use mocban_core::domain::sanitize;

/// Longest cell that is shown, in characters.
const MAX_SHOWN: usize = 60;
/// Largest number of columns that are shown.
const MAX_COLUMNS: usize = 40;

/// The header of a list of pairs and its first rows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ListHead {
    /// The names of the columns as written.
    pub header: Vec<String>,
    /// The standard name of each column, if it is known or chosen.
    pub columns: Vec<Option<&'static str>>,
    /// The standard name of each column by its own name, if it is known.
    pub by_name: Vec<Option<&'static str>>,
    /// Says why the columns are refused, of which none is then known.
    pub refused: Option<String>,
    /// The cells of the first rows, shortened.
    pub rows: Vec<Vec<String>>,
}

impl ListHead {
    /// Returns whether the columns that every list needs are known or chosen.
    pub fn is_complete(&self) -> bool {
        let needed = &ChosenColumns::FIELDS[..3];
        needed
            .iter()
            .all(|name| self.columns.contains(&Some(*name)))
    }
}

/// Reads the header of a CSV list and up to `rows` rows. `None` if it has no header that can be read.
pub fn read_head(bytes: &[u8], chosen: &ChosenColumns, rows: usize) -> Option<ListHead> {
    let text = CsvText::new(bytes).ok()?;
    let mut reader = row_reader(&text.bytes, text.delimiter);
    let mut record = ::csv::ByteRecord::new();
    if !reader.read_byte_record(&mut record).ok()? {
        return None;
    }
    let names = column_names(1, &record, "").ok()?;
    let unknown = || vec![None; names.len()];
    let by_name = ChosenColumns::default().assign(&names);
    let by_name = by_name.map_or_else(|_refused| unknown(), |found| found.columns);
    let (columns, refused) = match chosen.assign(&names) {
        Ok(found) => (found.columns, None),
        Err(why) => (unknown(), Some(why)),
    };
    let mut head = ListHead {
        columns,
        by_name,
        refused,
        header: names.iter().map(|name| (*name).to_owned()).collect(),
        rows: Vec::new(),
    };
    head.header.truncate(MAX_COLUMNS);
    while head.rows.len() < rows && matches!(reader.read_byte_record(&mut record), Ok(true)) {
        if is_blank(&record) {
            continue;
        }
        let cells = record.iter().take(head.header.len());
        let cells =
            cells.map(|cell| sanitize(&String::from_utf8_lossy(cell.trim_ascii()), MAX_SHOWN));
        head.rows.push(cells.collect());
    }
    Some(head)
}

#[cfg(test)]
mod tests {
    use super::{ChosenColumns, read_head};
    use crate::manifest::read_csv_as;

    const LIST: &str =
        "Nr;Model;Image;mesh;Zeichen\n1;a.stl;a.png;x;\u{660e}\n;;;;\n2;b.stl;b.png;y;\n";

    fn chosen(choices: &[(&'static str, &str)]) -> ChosenColumns {
        let mut columns = ChosenColumns::default();
        for (field, header) in choices {
            columns.choose(field, header);
        }
        columns
    }

    #[test]
    fn chosen_columns_are_read_in_place_of_those_with_their_names() {
        let columns = chosen(&[
            ("id", "Nr"),
            ("mesh", "Model"),
            ("print", "Image"),
            ("character", "Zeichen"),
        ]);
        let mut rows = Vec::new();
        let read = read_csv_as(LIST.as_bytes(), &columns, &mut |row| rows.push(row));
        assert_eq!(read.expect("two rows").renamed.len(), 4);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].mesh.to_str(), Some("a.stl"));
        assert_eq!(rows[0].character.as_deref(), Some("明"));
        assert_eq!(rows[0].meta["mesh"], "x", "the other column is kept");
        for (choices, reason) in [
            (
                &[("id", "Number")][..],
                "there is no column \"Number\" for id",
            ),
            (
                &[("id", "Nr"), ("mesh", "Nr")],
                "column \"Nr\" is chosen for two columns",
            ),
            (&[("id", "Nr")], "column \"print\" is missing"),
        ] {
            let refused = read_csv_as(LIST.as_bytes(), &chosen(choices), &mut drop);
            let refused = refused.expect_err("refused").to_string();
            assert!(refused.contains(reason), "{refused}");
        }
    }

    #[test]
    fn the_head_shows_what_is_known_of_the_columns() {
        let head = read_head(LIST.as_bytes(), &ChosenColumns::default(), 3).expect("a header");
        assert_eq!(head.header, ["Nr", "Model", "Image", "mesh", "Zeichen"]);
        assert_eq!(head.columns, [None, None, None, Some("mesh"), None]);
        assert_eq!(head.rows.len(), 2);
        assert!(!head.is_complete());
        let all = chosen(&[("id", "Nr"), ("mesh", "Model"), ("print", "Image")]);
        let head = read_head(LIST.as_bytes(), &all, 1).expect("a header");
        assert_eq!(head.columns[1], Some("mesh"));
        assert!(head.is_complete() && head.columns[3].is_none());
        assert_eq!(head.by_name, [None, None, None, Some("mesh"), None]);
        assert_eq!(head.refused, None);
        let twice = chosen(&[("id", "Nr"), ("mesh", "Nr")]);
        let refused = read_head(LIST.as_bytes(), &twice, 1).expect("a header");
        let why = refused.refused.expect("refused");
        assert!(why.contains("is chosen for two columns"), "{why}");
        let long = format!("a,b\n{},2\n", "x".repeat(500));
        let head = read_head(long.as_bytes(), &all, 1).expect("a header");
        assert!(head.rows[0][0].len() < 70);
        let blanks = " a ,b\n , \n  x\t,\" 2 \"\n";
        let head = read_head(blanks.as_bytes(), &all, 2).expect("a header");
        assert_eq!(head.header, ["a", "b"]);
        assert_eq!(head.rows, [["x", "2"]]);
        assert_eq!(read_head(b"", &all, 1), None);
        assert_eq!(read_head(b"PK\x03\x04", &all, 1), None);
    }
}
