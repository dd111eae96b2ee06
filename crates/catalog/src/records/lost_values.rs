//! Values of known pairs and blocks that an import empties, because it has none or empty ones.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use mocban_core::domain::sanitize;
use mocban_core::domain::spelling::quoted;

/// Largest number of columns that are counted one by one. The rows of a list in JSON may all have different ones.
const MAX_COLUMNS: usize = 20;
/// Longest name of a column, in characters.
const MAX_COLUMN_CHARS: usize = 60;
/// Stands for the metadata of further columns.
const OTHER_METADATA: &str = "other metadata";

/// Values that an import empties, by column.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LostValues(BTreeMap<String, LostColumn>);

/// The pairs or blocks that lose the value of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostColumn {
    /// How many they are.
    pub count: u64,
    /// The id of the first one.
    pub first: String,
}

impl LostValues {
    /// Adds a pair or block with its columns, each with whether it loses its value.
    pub(crate) fn add(&mut self, name: &str, columns: &[(&'static str, bool)]) {
        for (column, _) in columns.iter().filter(|(_, is_lost)| *is_lost) {
            self.count(name, (*column).to_owned());
        }
    }

    /// Adds the metadata that a pair or block had and no longer has.
    pub(crate) fn add_metadata(
        &mut self,
        name: &str,
        old: &Map<String, Value>,
        new: &Map<String, Value>,
    ) {
        let had = old.iter().filter(|(_, value)| has_value(value));
        let lost = had.filter(|(column, _)| !new.get(*column).is_some_and(has_value));
        let mut has_others = false;
        for (column, _) in lost {
            let column = quoted(&sanitize(column, MAX_COLUMN_CHARS));
            if self.0.len() < MAX_COLUMNS || self.0.contains_key(&column) {
                self.count(name, column);
            } else {
                has_others = true;
            }
        }
        if has_others {
            self.count(name, OTHER_METADATA.to_owned());
        }
    }

    fn count(&mut self, name: &str, column: String) {
        let first = || LostColumn {
            count: 0,
            first: name.to_owned(),
        };
        self.0.entry(column).or_insert_with(first).count += 1;
    }

    /// Returns the columns, sorted by name. Those of metadata are in quotation marks.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &LostColumn)> {
        self.0.iter().map(|(column, lost)| (column.as_str(), lost))
    }
}

/// Returns whether metadata is more than an empty cell.
pub fn has_value(value: &Value) -> bool {
    !value.is_null() && value.as_str() != Some("")
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, Value, json};

    use super::{LostValues, MAX_COLUMNS};

    fn metadata(value: &Value) -> Map<String, Value> {
        value.as_object().cloned().unwrap_or_default()
    }

    fn counts(lost: &LostValues) -> Vec<(&str, u64)> {
        let columns = lost.columns();
        columns.map(|(column, lost)| (column, lost.count)).collect()
    }

    #[test]
    fn each_lost_column_of_metadata_is_counted() {
        let old = metadata(&json!({ "shelf": "R.1", "room": 2, "note": "", "year": null }));
        let mut lost = LostValues::default();
        lost.add_metadata("a", &old, &old);
        assert!(counts(&lost).is_empty());
        lost.add_metadata("a", &old, &metadata(&json!({ "room": 3, "hall": 1 })));
        lost.add_metadata("b", &old, &metadata(&json!({ "room": "", "shelf": null })));
        assert_eq!(counts(&lost), [("\"room\"", 1), ("\"shelf\"", 2)]);
        let first = lost.columns().map(|(_, lost)| lost.first.as_str());
        assert_eq!(first.collect::<Vec<_>>(), ["b", "a"]);
    }

    #[test]
    fn many_columns_of_metadata_are_counted_together() {
        let names = (0..MAX_COLUMNS + 5).map(|k| (format!("c{k:03}"), json!(k)));
        let old: Map<String, Value> = names.collect();
        let mut lost = LostValues::default();
        for name in ["a", "b"] {
            lost.add_metadata(name, &old, &Map::new());
        }
        let counts = counts(&lost);
        assert_eq!(counts.len(), MAX_COLUMNS + 1);
        assert_eq!(counts.last(), Some(&("other metadata", 2)));
        assert!(counts.iter().all(|(_, count)| *count == 2));
    }
}
