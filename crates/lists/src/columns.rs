//! Columns of tables that people write: their names in any case, with blanks, and in Vietnamese.

use std::collections::BTreeMap;

use mocban_core::domain::spelling::{plain_form, quoted};

/// The columns of a kind of table.
#[derive(Debug, Clone, Copy)]
pub struct KnownColumns {
    /// Their names.
    pub names: &'static [&'static str],
    /// Other names of columns, without accents and in lower case, each with the name. Of several for one column, the first
    /// in this list is taken.
    pub other_names: &'static [(&'static str, &'static str)],
}

/// What each column of a header is.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct HeaderColumns {
    /// The name of each column, if it is known.
    pub columns: Vec<Option<&'static str>>,
    /// Columns with other names, as written, each with its name.
    pub renamed: Vec<(String, &'static str)>,
    /// Columns that are not known, although they have other names of columns that are, as written, each with the name.
    pub unread: Vec<(String, &'static str)>,
}

/// What a message says of two columns or keys that are written differently and are the same.
pub const HAVE_SAME_NAME: &str =
    "have the same name (upper and lower case, accents and blanks do not count)";

/// Two columns of a header, counted from 1, that are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SameColumn {
    /// The first column.
    pub first: usize,
    /// The second column.
    pub second: usize,
}

impl SameColumn {
    /// Returns why a header with these names is refused.
    pub fn reason(self, header: &[&str]) -> String {
        let Self { first, second } = self;
        let (one, other) = (header[first - 1], header[second - 1]);
        let [shown, shown_other] = [one, other].map(quoted);
        if one == other {
            format!("columns {first} and {second} are both named {shown_other}")
        } else {
            format!(
                "columns {first} and {second}, {shown} and {shown_other}, {HAVE_SAME_NAME}; rename one of them"
            )
        }
    }
}

impl HeaderColumns {
    /// Returns the first two columns of a header that are not known and have the same name. Columns without a name are left
    /// out.
    pub fn same_others(&self, header: &[&str]) -> Option<SameColumn> {
        let mut others = BTreeMap::new();
        let names = (1..).zip(header).zip(&self.columns);
        let unknown = names.filter(|((_, name), known)| known.is_none() && !name.is_empty());
        unknown
            .map(|(column, _)| column)
            .find_map(|(second, name)| {
                let first = others.insert(*name, second)?;
                Some(SameColumn { first, second })
            })
    }
}

impl KnownColumns {
    /// Returns what the columns of a header are. A column is known by its name, in any case and with blanks or hyphens in
    /// place of underscores; a name that is missing may also stand under another name.
    ///
    /// # Errors
    /// Returns an error if two columns have the same name, or the same other name.
    pub fn assign(&self, header: &[&str]) -> Result<HeaderColumns, SameColumn> {
        let mut columns: Vec<Option<&'static str>> = vec![None; header.len()];
        for (k, text) in header.iter().enumerate() {
            let Some(name) = self.named(text) else {
                continue;
            };
            if let Some(first) = columns.iter().position(|known| *known == Some(name)) {
                let (first, second) = (first + 1, k + 1);
                return Err(SameColumn { first, second });
            }
            columns[k] = Some(name);
        }
        let mut renamed = Vec::new();
        let plain: Vec<String> = header.iter().map(|text| plain_name(text)).collect();
        for (other, name) in self.other_names {
            if columns.contains(&Some(name)) {
                continue;
            }
            let mut found =
                (0..header.len()).filter(|k| columns[*k].is_none() && plain[*k] == *other);
            let Some(first) = found.next() else { continue };
            if let Some(second) = found.next() {
                let (first, second) = (first + 1, second + 1);
                return Err(SameColumn { first, second });
            }
            columns[first] = Some(name);
            renamed.push((header[first].trim().to_owned(), *name));
        }
        let known_elsewhere = |k: usize| {
            let mut others = self.other_names.iter();
            let (_, name) = others
                .find(|(other, name)| plain[k] == *other && columns.contains(&Some(*name)))?;
            Some((header[k].trim().to_owned(), *name))
        };
        let unknown = (0..header.len()).filter(|k| columns[*k].is_none());
        let unread = unknown.filter_map(known_elsewhere).collect();
        Ok(HeaderColumns {
            columns,
            renamed,
            unread,
        })
    }

    /// Returns the column with this name.
    fn named(&self, text: &str) -> Option<&'static str> {
        let mut names = self.names.iter().copied();
        // The usual case first: objects of JSON repeat their keys in each row.
        let exact = names.clone().find(|name| name.eq_ignore_ascii_case(text));
        exact.or_else(|| {
            let plain = plain_name(text);
            names.find(|name| *name == plain)
        })
    }
}

/// Returns a name in lower case, without accents, and with one underscore between words.
pub fn plain_name(text: &str) -> String {
    let plain = plain_form(text);
    let words =
        plain.split(|c: char| c.is_whitespace() || matches!(c, '_' | '-' | '.' | '\u{feff}'));
    words
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join("_")
}

#[cfg(test)]
mod tests {
    use super::{KnownColumns, SameColumn};

    const COLUMNS: KnownColumns = KnownColumns {
        names: &["id", "face_down", "block"],
        other_names: &[("so_hieu_van", "block"), ("khoi", "block"), ("ma", "id")],
    };

    fn columns(header: &[&str]) -> Vec<Option<&'static str>> {
        COLUMNS.assign(header).expect("columns that differ").columns
    }

    #[test]
    fn case_blanks_and_accents_do_not_matter() {
        for header in [
            ["ID", "Face Down", "BLOCK"],
            [" id ", "face-down", "Block\u{a0}"],
            ["Mã", "FACE_DOWN", "Khối"],
            ["ma", "face  down", "Số Hiệu Ván"],
            ["MÃ", "face.down", "so hieu van"],
        ] {
            let expected = [Some("id"), Some("face_down"), Some("block")];
            assert_eq!(columns(&header), expected, "{header:?}");
        }
    }

    #[test]
    fn headings_that_are_written_differently_are_both_shown() {
        let of = |header: &[&str]| {
            let same = COLUMNS.assign(header).expect_err("two of one name");
            same.reason(header)
        };
        assert_eq!(
            of(&["block", "x", "block"]),
            "columns 1 and 3 are both named \"block\""
        );
        for (one, other) in [
            ("block", "Block"),
            ("Khối", "khoi"),
            ("face_down", "Face Down"),
        ] {
            let shown = format!("columns 1 and 2, \"{one}\" and \"{other}\", have the same name (");
            let reason = of(&[one, other]);
            assert!(reason.starts_with(&shown), "{reason}");
        }
    }

    #[test]
    fn the_name_of_a_column_comes_before_other_names() {
        assert_eq!(columns(&["khối", "block"]), [None, Some("block")]);
        assert_eq!(columns(&["khối", "số hiệu ván"]), [None, Some("block")]);
        let found = COLUMNS.assign(&["Khối ", "other"]).expect("one block");
        assert_eq!(found.renamed, [("Khối".to_owned(), "block")]);
        let (first, second) = (1, 3);
        for header in [["khối", "x", "Khoi"], ["block", "x", "Block"]] {
            assert_eq!(COLUMNS.assign(&header), Err(SameColumn { first, second }));
        }
    }

    #[test]
    fn other_names_of_a_column_that_is_known_are_returned() {
        for (header, expected) in [
            (["khối", "block"], &[("khối", "block")][..]),
            (["Khối ", "Số hiệu ván"], &[("Khối", "block")]),
            (["ma", "x"], &[]),
            (["id", "khối"], &[]),
        ] {
            let found = COLUMNS.assign(&header).expect("columns that differ");
            let unread = found.unread.iter();
            let unread: Vec<(&str, &str)> = unread.map(|(text, name)| (&**text, *name)).collect();
            assert_eq!(unread, expected, "{header:?}");
        }
    }
}
