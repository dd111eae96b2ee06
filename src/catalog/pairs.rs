//! Pairs as imported: their names, paths and what is known of them.

use super::read::PairFacts;
use super::{Catalog, Result};
use crate::domain::{PairName, UnixMillis};

/// A row to import.
pub type ImportRow = PairFacts;

/// What an import changed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImportSummary {
    /// Pairs that were not there.
    pub added: u64,
    /// Pairs that were there with other values, and which fields differ, by name.
    pub changed: Vec<PairChange>,
    /// Pairs that were there just so.
    pub unchanged: u64,
}

/// A pair whose values an import changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairChange {
    /// The pair.
    pub name: PairName,
    /// Names of the columns that differ, in the order of the manifest's columns.
    pub fields: Vec<&'static str>,
}

impl Catalog {
    /// Imports rows in one transaction: new ones are added, others take the new values.
    ///
    /// # Errors
    /// When the database refuses; then nothing is imported.
    pub async fn import(&self, rows: Vec<ImportRow>, now: UnixMillis) -> Result<ImportSummary> {
        let _ = (rows, now);
        todo!()
    }

    /// Names of all pairs, sorted.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn pair_names(&self) -> Result<Vec<PairName>> {
        todo!()
    }

    /// Those of the names that are no pairs, in the order given.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn unknown_names(&self, names: &[PairName]) -> Result<Vec<PairName>> {
        let _ = names;
        todo!()
    }
}
