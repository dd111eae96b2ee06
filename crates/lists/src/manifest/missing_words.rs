//! Words for missing values in columns of names and of settings.

use std::collections::BTreeMap;

use super::cell_forms::CellForm;

/// Words that programs for tables write for a missing value.
pub(super) const MISSING: [&str; 8] = ["nan", "NaN", "NA", "N/A", "n/a", "<NA>", "None", "null"];

/// The words of [`MISSING`] that are unlikely names of pairs and characters. Others, such as `NA`, may be initials.
const NO_NAMES: [&str; 6] = ["NaN", "N/A", "n/a", "<NA>", "None", "null"];

/// Columns of a list that may have words for missing values.
#[derive(Debug, Clone, Copy)]
pub(super) struct MissingWords {
    /// Columns of names that every row needs, and of characters.
    pub(super) names: &'static [&'static str],
    /// Columns of names that rows may lack.
    pub(super) groups: &'static [&'static str],
    /// Columns of a few known values.
    pub(super) settings: &'static [&'static str],
}

impl MissingWords {
    /// Finds such words in the cells of a row. Removes them from the columns of settings, where they can mean nothing else.
    pub(super) fn find(
        self,
        cells: &mut BTreeMap<&'static str, String>,
    ) -> Vec<(CellForm, String)> {
        let mut found = Vec::new();
        for (columns, words, form) in [
            (self.settings, &MISSING[..], CellForm::MissingSetting),
            (self.names, &NO_NAMES, CellForm::MissingName),
            (self.groups, &MISSING, CellForm::MissingName),
        ] {
            for column in columns {
                let cell = cells.get(column);
                if !cell.is_some_and(|cell| words.contains(&cell.as_str())) {
                    continue;
                }
                if form == CellForm::MissingSetting {
                    cells.remove(column);
                }
                found.push((form, (*column).to_owned()));
            }
        }
        found
    }
}
