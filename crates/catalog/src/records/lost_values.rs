//! Values of known pairs and blocks that an import empties, because it does not name them.

use std::collections::BTreeMap;

/// Values that an import empties, by column.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LostValues(BTreeMap<&'static str, LostColumn>);

/// The pairs or blocks that lose the value of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostColumn {
    /// How many they are.
    pub count: u64,
    /// The id of the first one.
    pub first: String,
}

impl LostValues {
    /// Adds a pair or block with its columns, each with whether it had a value and whether it still has one.
    pub(crate) fn add(&mut self, name: &str, columns: &[(&'static str, bool, bool)]) {
        for (column, _, _) in columns.iter().filter(|(_, had, has)| *had && !*has) {
            let first = || LostColumn {
                count: 0,
                first: name.to_owned(),
            };
            self.0.entry(*column).or_insert_with(first).count += 1;
        }
    }

    /// Returns the columns, sorted by name.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, &LostColumn)> {
        self.0.iter().map(|(column, lost)| (*column, lost))
    }
}
