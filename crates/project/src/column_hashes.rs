//! Hashes of the other columns of pairs and blocks, by which the columns that an import changes are found.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::Value;

use mocban_catalog::has_value;
use mocban_core::domain::ContentHash;

/// Most memory for the columns of the rows of a list, in estimated bytes.
const MAX_BYTES: usize = 16 << 20;
/// Memory for a column of a row, or for a name, besides the text of the name, in bytes. Estimated.
const ENTRY_BYTES: usize = 64;

/// Hashes of the values of other columns by name, without empty values.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ColumnHashes(BTreeMap<Arc<str>, ContentHash>);

/// Makes the hashes of many rows, which share the names of columns.
#[derive(Debug)]
pub struct ColumnHasher {
    names: BTreeSet<Arc<str>>,
    /// Bytes that are left of [`MAX_BYTES`].
    left: usize,
}

impl Default for ColumnHasher {
    fn default() -> Self {
        Self {
            names: BTreeSet::new(),
            left: MAX_BYTES,
        }
    }
}

impl ColumnHasher {
    /// Returns the hashes of the columns of a row. `None` if they need more memory than is left.
    pub fn hashes<'m>(
        &mut self,
        columns: impl IntoIterator<Item = (&'m String, &'m Value)>,
    ) -> Option<ColumnHashes> {
        let mut hashes = BTreeMap::new();
        for (name, value) in columns {
            if has_value(value) {
                let name = self.shared(name)?;
                self.left = self.left.checked_sub(ENTRY_BYTES)?;
                // Values always have a JSON form.
                let text = serde_json::to_vec(value).unwrap_or_default();
                hashes.insert(name, ContentHash::of(&text));
            }
        }
        Some(ColumnHashes(hashes))
    }

    fn shared(&mut self, name: &str) -> Option<Arc<str>> {
        if let Some(known) = self.names.get(name) {
            return Some(Arc::clone(known));
        }
        self.left = self.left.checked_sub(ENTRY_BYTES + name.len())?;
        let name: Arc<str> = name.into();
        self.names.insert(Arc::clone(&name));
        Some(name)
    }
}

impl ColumnHashes {
    /// Returns the names of the columns whose values a newer row lacks, and of the columns that get a first or another value.
    pub fn changes<'c>(&'c self, newer: &'c Self) -> [Vec<&'c str>; 2] {
        let lost = self.0.keys().filter(|name| !newer.0.contains_key(*name));
        let new = newer.0.iter();
        let changed = new.filter(|(name, hash)| self.0.get(*name) != Some(*hash));
        [
            lost.map(|name| &**name).collect(),
            changed.map(|(name, _)| &**name).collect(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::{ColumnHasher, ColumnHashes, ENTRY_BYTES};
    use serde_json::{Map, Value, json};

    fn columns(value: &Value) -> Map<String, Value> {
        value.as_object().cloned().unwrap_or_default()
    }

    #[test]
    fn lost_and_changed_columns_are_named() {
        let mut hasher = ColumnHasher::default();
        let mut hashes = |value: Value| hasher.hashes(&columns(&value)).expect("few columns");
        let old = hashes(json!({"shelf": "R.1", "room": 2, "note": "", "year": 1872}));
        assert_eq!(old.changes(&old), [Vec::<&str>::new(), Vec::new()]);
        let new = hashes(json!({"room": 3, "note": null, "year": 1872, "hall": "x"}));
        assert_eq!(old.changes(&new), [vec!["shelf"], vec!["hall", "room"]]);
        let none = ColumnHashes::default();
        assert_eq!(
            old.changes(&none),
            [vec!["room", "shelf", "year"], Vec::new()]
        );
    }

    #[test]
    fn columns_that_need_too_much_memory_are_not_kept() {
        let row = columns(&json!({"a": 1, "b": 2}));
        let mut hasher = ColumnHasher {
            left: 6 * ENTRY_BYTES + 2,
            ..ColumnHasher::default()
        };
        // The second row shares the names of the first one.
        for is_kept in [true, true, false] {
            assert_eq!(hasher.hashes(&row).is_some(), is_kept);
        }
        assert!(hasher.hashes(&Map::new()).is_some());
    }
}
