//! Columns that a person names for a list whose header has other names.

use std::collections::BTreeMap;

use super::row::COLUMNS;
use crate::columns::HeaderColumns;
use mocban_core::domain::spelling::quoted;

/// Columns of a list by the names in its header. They take the place of columns with known names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChosenColumns(BTreeMap<&'static str, String>);

impl ChosenColumns {
    /// The columns that can be chosen; a list needs the first three.
    pub const FIELDS: [&'static str; 6] = ["id", "mesh", "print", "character", "block", "unit"];

    /// Chooses the column with a name in the header; an empty name chooses none.
    pub fn choose(&mut self, field: &'static str, header: &str) {
        if header.is_empty() {
            self.0.remove(field);
        } else {
            self.0.insert(field, header.to_owned());
        }
    }

    /// Returns what the columns of a header are.
    ///
    /// # Errors
    /// Returns the reason if a chosen column is not there or is chosen twice, or two columns are the same.
    pub(super) fn assign(&self, header: &[&str]) -> Result<HeaderColumns, String> {
        let mut others = header.to_vec();
        let mut chosen = Vec::new();
        for (field, name) in &self.0 {
            let found = header.iter().position(|column| column == name);
            let Some(at) = found else {
                return Err(format!("there is no column {} for {field}", quoted(name)));
            };
            if others[at].is_empty() {
                return Err(format!("column {} is chosen for two columns", quoted(name)));
            }
            others[at] = "";
            chosen.push((at, *field));
        }
        let found = COLUMNS.assign(&others);
        let mut found = found.map_err(|same| same.reason(header))?;
        let is_free = |name: &str| chosen.iter().all(|(_, field)| *field != name);
        for column in &mut found.columns {
            *column = column.filter(|name| is_free(name));
        }
        found.renamed.retain(|(_, name)| is_free(name));
        found.unread.retain(|(_, name)| is_free(name));
        for (at, field) in chosen {
            found.columns[at] = Some(field);
            if header[at] != field {
                found.renamed.push((header[at].to_owned(), field));
            }
        }
        Ok(found)
    }
}
