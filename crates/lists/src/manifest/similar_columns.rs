//! Columns that are kept as metadata although their names are similar to that of an optional column.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::column_names::similar_column;
use mocban_core::domain::sanitize;
use mocban_core::domain::spelling::quoted;

/// Maximum number of different names of columns that are compared. JSON Lines may have other names in each row.
const MAX_NAMES: usize = 1000;

/// Names of columns of their own that differ by one letter from `side`.
const WORDS: [&str; 3] = ["site", "size", "slide"];

/// Finds columns that are kept as metadata although their names are similar to that of an optional column. Such a column
/// is not reported if a row has a value in the optional column itself.
#[derive(Debug, Default)]
pub(super) struct SimilarColumns {
    names: HashSet<String>,
    /// Found names by the optional column that they resemble.
    similar: BTreeMap<&'static str, String>,
    used: BTreeSet<&'static str>,
}

impl SimilarColumns {
    /// Adds the columns of a row: the optional ones, each with whether it has a value, and the names of the others.
    pub(super) fn add<'n>(
        &mut self,
        optional: &[(&'static str, bool)],
        others: impl Iterator<Item = &'n String>,
    ) {
        let used = optional.iter().filter(|(_, is_used)| *is_used);
        self.used.extend(used.map(|(name, _)| *name));
        for name in others {
            if self.names.len() == MAX_NAMES || self.names.contains(name) {
                continue;
            }
            self.names.insert(name.clone());
            let found = name.trim().to_lowercase();
            if WORDS.contains(&&*found) {
                continue;
            }
            let mut known = optional.iter().map(|(known, _)| *known);
            if let Some(known) = known.find(|known| similar_column(&found, known)) {
                self.similar.entry(known).or_insert_with(|| name.clone());
            }
        }
    }

    /// Returns whether a row has a value in an optional column.
    pub(super) fn is_used(&self, column: &str) -> bool {
        self.used.contains(column)
    }

    /// Returns a warning for each similar name.
    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        let similar = self.similar.iter();
        let unused = similar.filter(move |(known, _)| !self.is_used(known));
        unused.map(|(known, name)| {
            let name = quoted(&sanitize(name, 100));
            format!(
                "column {name} is kept as metadata; rename it to {known:?} if it is meant, and import again"
            )
        })
    }
}
