//! The names of the other columns that an import changes in known pairs or blocks.

use std::collections::BTreeSet;

use mocban_core::domain::sanitize;

/// Most columns that are named.
const SHOWN: usize = 20;
/// Longest name of a column, in characters.
const MAX_CHARS: usize = 60;

/// Names of columns, sorted.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ColumnNames {
    names: BTreeSet<String>,
    has_more: bool,
}

impl ColumnNames {
    pub(super) fn add(&mut self, name: &str) {
        let name = sanitize(name, MAX_CHARS);
        if self.names.len() < SHOWN {
            self.names.insert(name);
        } else if !self.names.contains(&name) {
            self.has_more = true;
        }
    }

    /// Returns the names in brackets behind a blank, or an empty text if there are none.
    pub(super) fn text(&self) -> String {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        match (names.as_slice(), self.has_more) {
            ([], _) => String::new(),
            (names, false) => format!(" ({})", names.join(", ")),
            (names, true) => format!(" ({}, …)", names.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ColumnNames, SHOWN};

    #[test]
    fn each_column_is_named_once_up_to_a_number() {
        let mut names = ColumnNames::default();
        assert_eq!(names.text(), "");
        for name in ["Kho lưu", "Ghi chú", "Kho lưu"] {
            names.add(name);
        }
        assert_eq!(names.text(), " (Ghi chú, Kho lưu)");
        for k in 0..SHOWN {
            names.add(&format!("c{k:02}"));
        }
        let text = names.text();
        assert_eq!(text.matches(", ").count(), SHOWN, "{text}");
        assert!(text.ends_with(", c17, …)"), "{text}");
    }
}
