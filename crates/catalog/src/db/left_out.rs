//! Rows that the reads of a catalog leave out, and the condition with which statements do so.

use std::collections::BTreeMap;

use crate::db::checksummed_table::ChecksummedTable;

/// The numbers of rows that a catalog leaves out, as JSON arrays by table.
#[derive(Debug, Default)]
pub(crate) struct LeftOut(BTreeMap<ChecksummedTable, String>);

impl LeftOut {
    pub(crate) const fn new(arrays: BTreeMap<ChecksummedTable, String>) -> Self {
        Self(arrays)
    }

    /// Returns the rows of a table, for a condition of [`is_counted`].
    pub(crate) fn of(&self, table: ChecksummedTable) -> &str {
        self.0.get(&table).map_or("[]", String::as_str)
    }
}

/// Returns the SQL of the condition that the list in a parameter lacks a row: see [`LeftOut::of`].
macro_rules! is_counted {
    ($column:literal, $parameter:literal) => {
        concat!(
            $column,
            " NOT IN (SELECT CAST(atom AS bigint) FROM json_each(",
            $parameter,
            "))"
        )
    };
}
pub(crate) use is_counted;
