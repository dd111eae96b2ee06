//! Rows that a spreadsheet program does not show, such as rows that a filter leaves out. They are read like others.

/// Hidden rows of a table.
#[derive(Debug, Default)]
pub(super) struct HiddenRows {
    count: usize,
    /// Number of the first one.
    first: usize,
}

impl HiddenRows {
    /// Adds a row.
    pub(super) const fn add(&mut self, row: usize) {
        if self.count == 0 {
            self.first = row;
        }
        self.count += 1;
    }

    /// Returns a warning, if there are any.
    pub(super) fn warning(&self) -> Option<String> {
        let Self { count, first } = self;
        (*count > 0).then(|| {
            format!(
                "hidden rows are read, too: {count}, the first is row {first}; remove them if they are not meant"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::read_sheet;
    use super::super::test_helpers::{text_rows, workbook};

    #[test]
    fn hidden_rows_of_the_table_are_counted() {
        let rows = text_rows(&[
            &["id", "mesh", "print"],
            &["a", "m", "p"],
            &["b", "m", "p"],
            &["", "", ""],
            &["c", "m", "p"],
        ]);
        let hidden = |numbers: &[usize]| {
            let mut parts = rows.split("<row>");
            let mut text = parts.next().unwrap_or_default().to_owned();
            for (k, part) in (1..).zip(parts) {
                let hidden = if numbers.contains(&k) {
                    " hidden=\"1\""
                } else {
                    ""
                };
                text += "<row";
                text += hidden;
                text += ">";
                text += part;
            }
            let bytes = workbook(&[("a", &text)], "", "");
            read_sheet(&bytes, None).expect("a sheet").warning
        };
        assert_eq!(hidden(&[]), None);
        // A header is read by its names, and an empty row has no pair.
        assert_eq!(hidden(&[1, 4]), None);
        let expected =
            "hidden rows are read, too: 2, the first is row 3; remove them if they are not meant";
        assert_eq!(hidden(&[3, 5]).as_deref(), Some(expected));
    }
}
